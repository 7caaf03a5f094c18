"""The candidates among features, scalings, projections and their numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from train.agreement import products
from train.evaluate import Labels
from train.feature_sets import expand
from train.pipeline import Choice
from train.projection import KINDS
from train.search import NEIGHBOURS, SHRINKAGES, SearchGrid

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
    ("taxels",),
    ("sqrt_taxels",),
    ("contact", "joints", "posture"),
    ("moments", "joints", "posture"),
    ("kernels", "joints"),
    ("moments", "zone_kernels", "joints"),
)
"""Those for recordings with joint angles, whose changes show how far the thing gave
way."""
DRAWN, DRAWN_WITH_JOINTS = ("contact",), ("contact", "joints")
"""The combination tried for touches of simulated things that are drawn from kinds
(`kinds_of`). Joint angles at onset and single taxels say how the scene is built.
Moments say how large and of what form a contact is, in which simulators of soft things
differ most. How far the contact turns the joints back is a second measure of how the
thing gives way, whatever the skin."""
QUICK = 3
"""Combinations tried by a quick choice, from the first on."""
COMPONENTS = (1, 2, 3, 4, 5, 6, 8, 10, 14, 20)
QUICK_SHRINKAGES = (0.3, 0.03)
FEW_NEIGHBOURS = (1, 3, 5)
PAPER_SCALINGS = ("none", "I", "IV", "V")
DRAWN_SHRINKAGES, DRAWN_COMPONENTS = (1.0, 0.3), (1, 2, 3, 4, 6, 8, 10)
"""Those tried for touches of simulated things of several kinds, and the most
discriminants. Another physics differs most in differences that are small beside the
features' spread."""


@dataclass(frozen=True)
class Candidate:
    """Features, and how they are projected.

    Attributes:
        sets: names of feature sets and of single features.
        projection: one of `train.projection.KINDS`.
        grids: the settings tried with them.
    """

    sets: tuple[str, ...]
    projection: str
    grids: tuple[SearchGrid, ...]

    @property
    def name(self) -> str:
        """The names of its features, as `--features` takes them."""
        return " ".join(self.sets)


def known_products(y: Labels) -> dict[str, tuple[str, str]]:
    """{product: its factors} as `products`, where every trial with the one has labels
    of both."""
    return {
        task: factors
        for task, factors in products(y).items()
        if all((y[factor][y[task] != ""] != "").all() for factor in factors)
    }


def candidates(
    y: Labels,
    features: Sequence[str] | None = None,
    projection: str | None = None,
    scaling: str | None = None,
    components: int | None = None,
    k: int | None = None,
    *,
    joints: bool = False,
    drawn: bool = False,
    quick: bool = False,
) -> list[Candidate]:
    """Every candidate; arguments you pass are held fixed.

    Features of several units need scaling by Method IV. Principal components of the
    paper's three features are tried with more scalings and numbers where you ask for
    these features only. Beside other candidates the best of so many settings would win
    by chance. Methods II and III are left out, as Method I and no scaling have the same
    neighbours. The discriminants of all tasks side by side tell known things best, so
    they are tried where no group is left out. Where `kinds_of` names kinds (`drawn`)
    only what carries over to other skins and arms is tried.
    """
    combinations_tried: Sequence[tuple[str, ...]] = WITH_JOINTS if joints else PLAIN
    if drawn:
        combinations_tried = [DRAWN_WITH_JOINTS if joints else DRAWN]
    if quick:
        combinations_tried = combinations_tried[:QUICK]
    if features is not None:
        combinations_tried = [tuple(features)]
    shrinkages = (
        DRAWN_SHRINKAGES if drawn else QUICK_SHRINKAGES if quick else SHRINKAGES
    )
    counts = DRAWN_COMPONENTS if drawn else COMPONENTS
    tried = []
    for sets in combinations_tried:
        for kind in KINDS if projection is None else (projection,):
            paper = sets == ("paper",)
            # By default discriminants are not tried for the paper's few features. A
            # quick choice tries discriminants alone for the others. So does one for
            # simulated things, because principal components do not hold back the
            # coordinates in which simulators differ.
            untried = kind == "lda" if paper else kind == "pca" and (quick or drawn)
            if features is None and projection is None and untried:
                continue
            thorough = features is not None and kind == "pca"
            scalings = PAPER_SCALINGS if paper and thorough else ("IV",)
            neighbours = NEIGHBOURS if thorough else FEW_NEIGHBOURS
            grid = SearchGrid(
                projection=kind,
                features=expand(sets),
                components=counts if components is None else (components,),
                shrinkages=shrinkages,
                most_directions=DRAWN_COMPONENTS[-1] if drawn else None,
                neighbours=neighbours if k is None else (k,),
            )
            pairs = {} if kind == "pca" else known_products(y)
            grids = [
                grid,
                *(replace(grid, targets=pairs[t], tasks=(t,)) for t in pairs),
            ]
            together = tuple(
                t for t in sorted(y) if t not in pairs and (y[t] != "").all()
            )
            if kind == "lda" and len(together) > 1 and not drawn:
                grids.append(replace(grid, targets=together))
            scaled = [
                replace(grid, scaling=method)
                for method in (scalings if scaling is None else (scaling,))
                for grid in grids
            ]
            tried.append(Candidate(tuple(sets), kind, tuple(scaled)))
    return tried


def costs(choices: Sequence[Choice], widths: Mapping[str, int]) -> NDArray[np.int64]:
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
        weights = choice.components * sum(
            widths[name] for name in choice.features or widths
        )
        sizes[kind] = max(sizes.get(kind, 0), weights)
    ranks = {
        kind: rank
        for rank, kind in enumerate(sorted(sizes, key=lambda kind: sizes[kind]))
    }
    return np.array([ranks[kind] for kind in kinds], dtype=np.int64)


def places_of(candidate: Candidate, choices: Sequence[Choice]) -> NDArray[np.int64]:
    """The places of a candidate's own choices."""
    names = {(grid.features, grid.projection) for grid in candidate.grids}
    return np.flatnonzero([(c.features, c.projection) in names for c in choices])
