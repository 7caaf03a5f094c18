"""The state of trials that run side by side, in arrays whose last axis is the trial.

A `Batch` holds the arrays of all its trials. A hook gets `Trials`: some of them, whose
arrays hold these alone. A read gathers the values of these trials, and an assignment
scatters them among the others.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from train.simulate.arm import Array, Mask, Places
from train.simulate.contact import bed_law, by_depth
from train.simulate.groups import (
    Arm,
    Bed,
    ContactState,
    Group,
    JointGains,
    Pair,
    PerJoint,
    PerRow,
    RowSprings,
    SkinLoad,
    StepClock,
)
from train.simulate.plan import ANSWER, Call, Plan
from train.simulate.scene_model import Scene, TrialSpec

__all__ = ["Array", "Group", "Mask", "Pair", "PerJoint", "PerRow", "Places", "Trials"]
G = TypeVar("G", bound="Group")
WINDOW_HALF = 6
"""Columns on either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no surface to press."""


@dataclass
class Batch:
    """n trials of a scene, from the setup to their last step.

    An effect keeps its own state in `states`, as a small dataclass whose arrays also end
    in the trial axis; without the effect it does not exist.

    Attributes:
        values: {name: (n,)} the values drawn for each trial.
        plan: the hooks to run.
        states: {effect: its state}.
        everyone: all of the trials.
    """

    scene: Scene
    specs: tuple[TrialSpec, ...]
    values: dict[str, Array]
    plan: Plan
    states: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Begin the groups of arrays."""
        scene = self.scene
        columns = 2 * min(WINDOW_HALF, (scene.skin.cols - 1) // 2) + 1
        usual = [max(1, round(1.0 / (scene.rate_hz * s.step_s))) for s in self.specs]
        h = 1.0 / (scene.rate_hz * np.array(usual))
        stiffness = np.array(scene.stiffness)[:, None]
        damping = np.array(scene.damping)[:, None]
        self.n = len(self.specs)
        self.sizes = {"row": scene.skin.rows, "column": columns, "joint": scene.arm.dof}
        self.sizes |= {"xyz": 3, "pair": 2, "spring": 0, "line": 1}
        self.joints = JointGains(stiffness, damping)
        self.clock = self.begin(
            StepClock,
            usual=usual,
            steps=usual,
            steps_left=0,
            frame=0,
            h=h,
        )
        self.arm = self.begin(Arm)
        self.contact = self.begin(ContactState)
        self.contact.arrays["free_depth"] = self.contact.y[0]
        self.bed = self.begin(
            Bed,
            columns=0,
            springs=0,
            law_gaps=np.inf,
            gain=1.0,
            lost=False,
        )
        self.bed.arrays["first_row_force"] = self.bed.row_force[0]
        self.touch = self.begin(SkinLoad)
        self.row_springs: RowSprings | None = None
        self.everyone = Trials(self, np.arange(self.n), np.arange(self.n))

    def begin(self, group: type[G], **values: Any) -> G:
        """A group whose arrays begin at some values, and otherwise at 0."""
        arrays = {}
        for name, kind in group.__annotations__.items():
            shape = [self.sizes[axis] for axis in getattr(kind, "__metadata__", ())]
            arrays[name] = np.full((*shape, self.n), values.get(name, 0.0))
        return group(arrays)


class Gathered(dict[str, Any]):
    """Arrays and groups of some trials, each gathered when it is first asked for."""

    def __init__(self, source: Mapping[str, Any], places: Any) -> None:
        """Of the arrays or groups of all trials."""
        self.source = source
        self.places = places

    def __missing__(self, name: str) -> Any:
        """Gather one."""
        values = self.source[name]
        if isinstance(values, Group):
            self[name] = type(values)(values.arrays, self.places)
        else:
            self[name] = values.take(self.places)
        return self[name]


class Trials:
    """Some trials of a batch; each array holds these m trials alone.

    Attributes:
        scene, joints: those of all trials.
        places, within: (m,) their places in the batch, and in the trials of which they
            were chosen.
        clock, arm, contact, bed, touch: the groups of arrays.
        values: {name: (m,)} the values drawn for each trial.
        states: {effect: its state}.
    """

    def __init__(self, batch: Batch, places: Places, within: Places) -> None:
        """The trials at some places of a batch, in rising order."""
        self.batch = batch
        self.places = places
        self.within = within
        self.scene = batch.scene
        self.joints = batch.joints
        at = None if len(places) == batch.n else places
        self.clock = StepClock(batch.clock.arrays, at)
        self.arm = Arm(batch.arm.arrays, at)
        self.contact = ContactState(batch.contact.arrays, at)
        self.bed = Bed(batch.bed.arrays, at)
        self.touch = SkinLoad(batch.touch.arrays, at)
        self.values = Gathered(batch.values, places)
        self.states = Gathered(batch.states, at)
        self._parts: dict[int, Trials | None] = {}
        self._callers: dict[tuple[str, ...], list[tuple[Call, Trials | None]]] = {}
        self._law: RowSprings | None = None
        self._last_choice: tuple[bytes, Trials] | None = None

    def __len__(self) -> int:
        """The number of trials."""
        return len(self.places)

    def only(self, which: Mask) -> "Trials":
        """Those of these trials for which `which` (m,) is true."""
        within = which.nonzero()[0]
        if len(within) == len(self):
            return self
        choice = which.tobytes()
        if self._last_choice is None or self._last_choice[0] != choice:
            # Most steps choose those trials which the step before has chosen.
            chosen = Trials(self.batch, self.places[within], within)
            self._last_choice = choice, chosen
        return self._last_choice[1]

    def calls(self, *stages: str) -> Iterator[tuple[Call, "Trials"]]:
        """The hooks of stages, each with those of these trials that call for it."""
        if stages not in self._callers:
            self._callers[stages] = self._find_callers(stages)
        for call, part in self._callers[stages]:
            yield call, self if part is None else part

    def _find_callers(
        self, stages: tuple[str, ...]
    ) -> list[tuple[Call, "Trials | None"]]:
        """The hooks of stages that any of these trials call for, each with its part."""
        callers = []
        for stage in stages:
            for call in self.batch.plan.stages[stage]:
                part = self._part(call.which)
                if part is None or len(part):
                    callers.append((call, part))
        return callers

    def _part(self, which: Mask) -> "Trials | None":
        """Those of these trials that a mask (n,) of the plan names; None for all, since
        trials that held themselves would outlive their use."""
        key = id(which)
        if key not in self._parts:
            part = self.only(which[self.places])
            self._parts[key] = None if part is self else part
        return self._parts[key]

    def run(self, *stages: str) -> None:
        """Run the hooks of stages."""
        for call, callers in self.calls(*stages):
            call.function(callers)

    def add_state(self, effect: str, group: type[Group], **arrays: Any) -> None:
        """Add an effect's state; arrays (..., m) that are left out begin at 0."""
        state = self.batch.begin(group)
        for name, values in arrays.items():
            shape = *np.shape(values)[:-1], self.batch.n
            array = np.zeros(shape, dtype=np.asarray(values).dtype)
            array[..., self.places] = values
            state.arrays[name] = array
        self.batch.states[effect] = state

    def equilibrium(self, t: Any) -> Array:
        """(dof, m) equilibrium angles at times (m,)."""
        way = self.arm.rate * np.minimum(t, self.arm.travel_s)
        return np.asarray(self.arm.start + way)

    def add_springs(
        self,
        gaps: Array,
        stiffness: Array,
        intact: Array | None = None,
    ) -> None:
        """Add springs (S, m) to each row; with `intact` (S, rows, m), they may break."""
        bed = self.bed.arrays
        first = int(self.bed.springs.max())
        added = slice(first, first + len(gaps))
        more = max(added.stop - len(bed["gaps"]), 0)
        if intact is not None and bed["intact"].shape[1] == 1:
            bed["intact"] = np.repeat(bed["intact"], intact.shape[1], axis=1)
        padding = (0, more), (0, 0)
        bed["gaps"] = np.pad(bed["gaps"], padding, constant_values=np.inf)
        bed["stiffness"] = np.pad(bed["stiffness"], padding)
        bed["intact"] = np.pad(bed["intact"], (*padding, (0, 0)), constant_values=1.0)
        bed["gaps"][added, self.places] = np.where(stiffness > 0.0, gaps, np.inf)
        bed["stiffness"][added, self.places] = stiffness
        if intact is not None:
            bed["intact"][added, :, self.places] = intact
        self.bed.springs = np.array(added.stop)

    def set_bed_law(self, gaps: Array, stiffness: Array) -> Places:
        """Set the law of springs (E, m); returns their order by depth."""
        order, gaps, stiffness = by_depth(gaps, stiffness)
        bed = self.bed.arrays
        padding = (0, max(len(gaps) - len(bed["law_gaps"]), 0)), (0, 0)
        bed["law_gaps"] = np.pad(bed["law_gaps"], padding, constant_values=np.inf)
        bed["slopes"] = np.pad(bed["slopes"], padding)
        bed["intercepts"] = np.pad(bed["intercepts"], padding)
        bed["law_gaps"][: len(gaps), self.places] = gaps
        self.set_lines(*bed_law(gaps, stiffness))
        return order

    def set_lines(self, slopes: Array, intercepts: Array) -> None:
        """Set the first lines (E, m) of the bed's law."""
        lines = slice(len(slopes))
        self.batch.bed.slopes[lines, self.places] = slopes
        self.batch.bed.intercepts[lines, self.places] = intercepts

    def set_row_law(self, gaps: Array, stiffness: Array) -> None:
        """Set the springs (S, m) of each row, of stiffness (S, 1, m) or (S, rows, m),
        for a forearm that pivots."""
        order = gaps.argsort(axis=0, kind="stable")
        deep = int(np.isfinite(gaps).sum(axis=0).max())
        stiffness = np.take_along_axis(stiffness, order[:, None], 0)[:deep]
        law = self.batch.row_springs
        if law is None:
            n = self.batch.n
            nothing = np.zeros((stiffness.shape[1], deep, n))
            law = RowSprings(np.full((deep, n), np.inf), nothing)
        law.gaps[:deep, self.places] = np.take_along_axis(gaps, order, 0)[:deep]
        law.stiffness[:, :deep, self.places] = stiffness.swapaxes(0, 1)
        # A new record tells the trials that have gathered the law to do so again.
        self.batch.row_springs = replace(law)

    def row_law(self) -> RowSprings:
        """The springs of these trials' rows."""
        law = self.batch.row_springs
        assert law is not None
        if self._law is not law:
            self._law = law
            self._row_springs = RowSprings(
                law.gaps.take(self.places, -1),
                law.stiffness.take(self.places, -1),
            )
        return self._row_springs

    def solve_loads(self, y: Array, c: Array, where: Mask | None = None) -> Array:
        """(2, m) the loads of the contacts.

        Args:
            y, c: (m,) depth without load, and metres that it gives way for each newton.
            where: (m,) whether to solve a contact; the others keep their loads.
        """
        if where is not None:
            loads = self.contact.loads.copy()
            loads[:, where] = self.only(where).solve_loads(y[where], c[where])
            return loads
        loads = np.zeros((2, len(self)))
        for call, callers in self.calls(ANSWER):
            if callers is self:
                return np.asarray(call.function(self, y, c))
            at = callers.within
            loads[:, at] = call.function(callers, y[at], c[at])
        return loads
