"""What a batch of trials begins with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.compiled import Array, addresses
from train.simulate.contact import sort_bed
from train.simulate.scene_model import Cylinder, Scene, TrialSpec
from train.simulate.trial import TRIAL, Part, Rows


@dataclass
class Bed:
    """The springs between skin and object: L lines (rows, or stems) of S springs.

    Attributes:
        gaps: (S, n) metres at which a spring is touched, at zero depth of its line.
        stiffness: (S, n) newtons a metre.
        weight: (L, n) the part of each line that the object covers.
        line_gap: (L, n) metres by which the object's face draws back; (1, n) where it is flat.
    """

    gaps: Array
    stiffness: Array
    weight: Array
    line_gap: Array


@dataclass
class State:
    """A batch of n trials: what the setup finds out, for all of them at once, and their records.

    The base's functions set what is declared here; an effect keeps a part of its own
    (`trial.Part`), so the state of an effect that is not called for does not exist. What a trial
    is from its first step to its last stands in its record: `trial` has those of all.

    Attributes:
        steps: of a frame.
        values: {name: (n,)} of what was drawn for each trial.
        solve: address of the compiled function that answers for the contact.
        records: (n,) of `TRIAL`; `here`, `own` and `solve` are set from the beginning.
        trial: the same, with its fields as attributes.
        own: {part: (n,) of its records}, the called effects' own state.
        arrays: {name: (n, ...)} what the records hold addresses of, trial by trial.
        start, rate: (dof, n) and (dof, 1), the equilibrium point at t = 0 and its speed.
        lag: (dof, 1) radians by which a joint trails its equilibrium point in free motion.
        travel_s: (dof, n) seconds for which the equilibrium point moves.
        damping, joint_k: (dof, 1) of each joint.
        q: (dof, n) radians, before the first step.
        row_z: (rows, 1) metres in the skin's link, of its rows.
        z: (n,) the same of what meets the object.
        columns: (C, n) those that can touch; `column_gaps` (C, n) metres that each lies back at
            zero depth, `reach` the part of it that the face can touch.
        taxel_k: (n,) newtons a metre, of a taxel and what is in series with it.
    """

    scene: Scene
    skin: Cylinder
    trials: tuple[TrialSpec, ...]
    n: int
    steps: int
    values: dict[str, Array]
    solve: int
    own: dict[Part, Rows] = field(default_factory=dict)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    records: NDArray[Any] = field(init=False)
    trial: Rows = field(init=False)

    travel_s: Array = field(init=False)
    start: Array = field(init=False)
    lag: Array = field(init=False)
    rate: Array = field(init=False)
    damping: Array = field(init=False)
    joint_k: Array = field(init=False)
    q: Array = field(init=False)

    row_z: Array = field(init=False)
    z: Array = field(init=False)
    columns: NDArray[np.intp] = field(init=False)
    column_gaps: Array = field(init=False)
    reach: Array = field(init=False)
    taxel_k: Array = field(init=False)
    bed: Bed = field(init=False)

    def __post_init__(self) -> None:
        """The records, which know where they are."""
        self.records = np.zeros(self.n, dtype=TRIAL)
        self.records["here"] = addresses(self.records)
        self.records["solve"] = self.solve
        self.trial = self.records.view(Rows)

    def of(self, part: Part) -> Rows:
        """An effect's own state (n,)."""
        return self.own[part]

    def begin(self, part: Part, /, **values: Any) -> Rows:
        """An effect's own state, zero but for these values (n,); `of` finds it, and so does what
        is compiled."""
        rows = self.own[part] = part.rows(self.n)
        self.records["own"][:, part.slot] = addresses(rows)
        for name, value in values.items():
            rows[name] = value
        return rows

    def lend(self, name: str, values: NDArray[Any]) -> NDArray[np.int64]:
        """(n,) addresses of values (..., n), laid out trial by trial; `arrays` has them."""
        assert name not in self.arrays, f"{name} is lent already: its address would be lost"
        by_trial = values.transpose(-1, *range(values.ndim - 1))
        own = self.arrays[name] = by_trial.copy()
        return addresses(own)

    def obey(self, gaps: Array, stiffness: Array) -> NDArray[np.intp]:
        """Give the records the law of springs (E, n), phi(a) = max_s (K_s a - B_s), and the depths
        from which each K_s counts; (E, n) which spring is the first, second and so on by depth."""
        order, *law = sort_bed(gaps, stiffness)
        self.records["law_lines"] = len(gaps)
        for name, part in zip(("law_gaps", "slopes", "intercepts"), law, strict=True):
            self.records[name] = self.lend(name, part)
        return order

    def places(self, fields: list[tuple[Part | None, str]]) -> NDArray[np.int64]:
        """(fields, n) addresses of a field of the trials themselves, or of an effect's part."""
        found = np.zeros((len(fields), self.n), dtype=np.int64)
        for place, (part, name) in zip(found, fields, strict=True):
            rows = self.trial if part is None else self.own[part]
            place[:] = addresses(rows) + rows.dtype.fields[name][1]
        return found
