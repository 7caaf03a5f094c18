"""The candidates among features, scalings, projections and their numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from edge.arrays import Integers
from train.choose.options import FitOptions
from train.choose.search import NEIGHBOURS, SHRINKAGES, SearchGrid
from train.data.feature_sets import expand
from train.data.vectors import Labels
from train.model.agreement import joint_tasks
from train.model.pipeline import Choice
from train.model.projection import KINDS
from train.model.scaling import BY_COLUMN

PLAIN = (
    ("paper",),
    ("contact",),
    ("moments",),
    ("contact", "moments"),
    ("taxels",),
    ("sqrt_taxels",),
    ("kernels",),
    ("moments", "zone_kernels"),
)
"""Combinations of feature sets that are candidates for recordings without joint
angles."""
WITH_JOINTS = (
    ("paper",),
    ("contact", "joints"),
    ("moments", "joints"),
    ("contact", "moments", "joints"),
    ("contact", "sqrt_joints"),
    ("sqrt_joints",),
    ("taxels",),
    ("sqrt_taxels",),
    ("contact", "joints", "posture"),
    ("moments", "joints", "posture"),
    ("kernels", "joints"),
    ("moments", "zone_kernels", "joints"),
)
"""Those for recordings with joint angles, whose changes show how far the object gave
way. The arm tells that an object has begun to move before the skin does, and roots let
a small motion count."""
WITH_SHEAR = (
    ("contact", "shear"),
    ("moments", "shear"),
)
"""Those that recordings of a skin of three axes have besides, with or without joint
angles."""
OF_SKIN = (
    ("contact", "moments"),
    ("moments", "zone_kernels"),
    ("taxels",),
    ("sqrt_taxels",),
    ("kernels",),
    ("sqrt_taxels", "kernels"),
)
OF_JOINTS = (("joints",), ("joints", "posture"))
"""For known objects, each of `OF_SKIN` is a candidate with each of these, and with
shear and without, where the recordings have them."""
DRAWN = ("contact",)
DRAWN_WITH_JOINTS = ("contact", "joints")
"""The combination tried for touches of simulated objects that are drawn from kinds
(`kinds_of`). Joint angles at onset and single taxels say how the scene is built.
Moments say how large and of what form a contact is, in which simulators of soft objects
differ most. How far the contact turns the joints back is a second measure of how the
object gives way, whatever the skin."""
QUICK = 3
"""Combinations tried by a quick choice, from the first on."""
COMPONENTS = (1, 2, 3, 4, 5, 6, 8, 10, 14, 20)
QUICK_SHRINKAGES = (0.3, 0.03)
FEW_NEIGHBOURS = (1, 3, 5)
PAPER_SCALINGS = ("none", "I", "IV", "V")
DRAWN_SHRINKAGES = (1.0, 0.3)
DRAWN_COMPONENTS = (1, 2, 3, 4, 6, 8, 10)
"""Those tried for touches of simulated objects of several kinds, and the most
discriminants. Another physics differs most in differences that are small beside the
features' spread."""


@dataclass(frozen=True)
class Candidate:
    """Features, and how they are projected.

    Attributes:
        sets: names of feature sets and of single features.
        projection: one of `train.model.projection.KINDS`.
        grids: the settings tried with them.
        known: whether it is tried for known objects alone, where no groups are left
            out.
    """

    sets: tuple[str, ...]
    projection: str
    grids: tuple[SearchGrid, ...]
    known: bool = False

    @property
    def name(self) -> str:
        """The names of its features, as `--features` takes them."""
        return " ".join(self.sets)


def features_of(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """The features of some candidates, each once."""
    return expand([name for candidate in candidates for name in candidate.sets])


CHOOSE_ALL = FitOptions()


def candidates(
    y: Labels,
    fixed: FitOptions = CHOOSE_ALL,
    *,
    joints: bool = False,
    shear: bool = False,
    drawn: bool = False,
) -> list[Candidate]:
    """Every candidate with the settings that are held fixed.

    Features of several units need scaling by Method IV. Principal components of the
    paper's three features are tried with more scalings and numbers where you ask for
    these features only. Beside other candidates the best of so many settings would win
    by chance. Methods II and III are left out, as Method I and no scaling have the same
    neighbours. Where `kinds_of` names kinds (`drawn`) only what carries over to other
    skins and arms is tried.
    """
    mode = Mode.drawn(joints) if drawn else Mode.all_others(joints, shear, fixed.quick)
    mode = mode.asked(fixed)
    projections = KINDS if fixed.projection is None else (fixed.projection,)
    every = dict.fromkeys((*mode.usual, *mode.known))
    combinations = []
    for sets, kind in product(every, projections):
        if fixed.asks or mode.tries(kind, sets):
            grid = _grid(sets, kind, fixed, mode)
            grids = _scaled(_with_targets(grid, y, mode), sets, fixed, mode)
            known = sets not in mode.usual
            combinations.append(Candidate(sets, kind, grids, known))
    return combinations


@dataclass(frozen=True)
class Mode:
    """The candidates that are tried by default.

    Attributes:
        usual: feature sets that are tried together.
        known: those that are tried for known objects besides.
        shrinkages: of discriminants.
        components: numbers of coordinates.
        most_directions: of discriminants; None for all.
        components_alone: try principal components of other sets than the paper's.
        together: try the discriminants of all tasks side by side.
    """

    usual: Sequence[tuple[str, ...]]
    known: Sequence[tuple[str, ...]]
    shrinkages: tuple[float, ...]
    components: tuple[int, ...]
    most_directions: int | None
    components_alone: bool
    together: bool

    @classmethod
    def drawn(cls, joints: bool) -> Mode:
        """The mode of objects that a scene drew from kinds."""
        return cls(
            usual=[DRAWN_WITH_JOINTS if joints else DRAWN],
            known=[],
            shrinkages=DRAWN_SHRINKAGES,
            components=DRAWN_COMPONENTS,
            most_directions=DRAWN_COMPONENTS[-1],
            components_alone=False,
            together=False,
        )

    @classmethod
    def all_others(cls, joints: bool, shear: bool, quick: bool) -> Mode:
        """The mode of all others, or of a quick choice."""
        usual = WITH_JOINTS if joints else PLAIN
        angles = ("joints",) if joints else ()
        sheared = [(*sets, *angles) for sets in WITH_SHEAR] if shear else []
        return cls(
            usual=[*usual[: QUICK if quick else None], *sheared],
            known=[] if quick else _beside_every_other(joints, shear),
            shrinkages=QUICK_SHRINKAGES if quick else SHRINKAGES,
            components=COMPONENTS,
            most_directions=None,
            components_alone=not quick,
            together=True,
        )

    def asked(self, fixed: FitOptions) -> Mode:
        """The same mode, with the features that are asked for in place of others."""
        if not fixed.asks:
            return self
        usual = self.usual if fixed.features is None else [tuple(fixed.features)]
        return replace(self, usual=usual, known=[])

    def tries(self, kind: str, sets: Sequence[str]) -> bool:
        """Whether a projection of some feature sets is tried by default.

        Discriminants are not, for the paper's few features. A quick choice tries
        discriminants alone for the others. So does one for simulated objects, because
        principal components do not hold back the coordinates in which simulators
        differ.
        """
        if sets == ("paper",):
            return kind == "pca"
        return kind == "lda" or (self.components_alone and sets in self.usual)


def _beside_every_other(joints: bool, shear: bool) -> list[tuple[str, ...]]:
    """Each of `OF_SKIN` beside what else the recordings have."""
    of_joints = OF_JOINTS if joints else ((),)
    of_shear = ((), ("shear", "taxel_shear")) if shear else ((),)
    return [
        (*skin, *tangential, *angles)
        for skin, tangential, angles in product(OF_SKIN, of_shear, of_joints)
    ]


def _grid(
    sets: tuple[str, ...], kind: str, fixed: FitOptions, mode: Mode
) -> SearchGrid:
    """The numbers that are tried for some feature sets and a projection."""
    neighbours = NEIGHBOURS if fixed.thorough(kind) else FEW_NEIGHBOURS
    components = mode.components if fixed.components is None else (fixed.components,)
    return SearchGrid(
        projection=kind,
        features=expand(sets),
        components=components,
        shrinkages=mode.shrinkages,
        most_directions=mode.most_directions,
        neighbours=neighbours if fixed.k is None else (fixed.k,),
    )


def _with_targets(grid: SearchGrid, y: Labels, mode: Mode) -> list[SearchGrid]:
    """A grid, and that of the discriminants of all tasks side by side."""
    complete = {task: labels for task, labels in y.items() if (labels != "").all()}
    if grid.projection == "pca" or not mode.together or len(complete) < 2:
        return [grid]
    pairs = joint_tasks(complete)
    together = tuple(task for task in sorted(complete) if task not in pairs)
    return [grid, replace(grid, targets=together)]


def _scaled(
    grids: Sequence[SearchGrid],
    sets: Sequence[str],
    fixed: FitOptions,
    mode: Mode,
) -> tuple[SearchGrid, ...]:
    """The grids with each method of scaling that is tried.

    Beside other features a motion of the arm that begins counts as much as a large one
    only where every column has its own scale.
    """
    of_joints = any("joints" in name for name in sets)
    scaled = []
    for grid in grids:
        methods: Sequence[str] = ("IV",)
        if fixed.scaling is not None:
            methods = (fixed.scaling,)
        elif sets == ("paper",) and fixed.thorough(grid.projection):
            methods = PAPER_SCALINGS
        elif grid.targets and sets in mode.usual and of_joints:
            methods = ("IV", BY_COLUMN)
        scaled += [replace(grid, scaling=method) for method in methods]
    return tuple(scaled)


def costs(choices: Sequence[Choice], widths: Mapping[str, int]) -> Integers:
    """(choices,) rank of the price of each choice's features, projection and targets,
    from 0.

    The price is the number of weights of the largest projection tried: these are
    fitted, stored on the board and multiplied for a decision. At an equal price the
    first choice ranks lower.

    Args:
        choices: the candidates' settings.
        widths: columns of each feature.
    """
    sizes: dict[tuple[object, ...], int] = {}
    kinds = [(choice.features, choice.projection, choice.targets) for choice in choices]
    for kind, choice in zip(kinds, choices, strict=True):
        columns = sum(widths[name] for name in choice.features or widths)
        sizes[kind] = max(sizes.get(kind, 0), choice.components * columns)
    ranking = sorted(sizes, key=sizes.__getitem__)
    return np.array([ranking.index(kind) for kind in kinds])


def places_of(candidate: Candidate, choices: Sequence[Choice]) -> Integers:
    """Indices of the choices that belong to a candidate."""
    names = {(grid.features, grid.projection) for grid in candidate.grids}
    return np.flatnonzero([(c.features, c.projection) in names for c in choices])
