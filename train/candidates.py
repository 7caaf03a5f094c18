"""What `train.fit` chooses among: feature sets, scalings, projections and their numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from edge.touch.feature_sets import expand
from train.evaluate import NEIGHBOURS, SHRINKAGES, Labels, SearchGrid
from train.pipeline import Choice
from train.projection import KINDS

PLAIN = (
    ("paper",),
    ("contact",),
    ("moments",),
    ("contact", "moments"),
    ("taxels",),
    ("sqrt_taxels",),
)
"""Sets of features that any skin gives, each a candidate."""
WITH_JOINTS = (
    ("paper",),
    ("contact", "joints"),
    ("moments", "joints"),
    ("contact", "moments", "joints"),
    ("taxels",),
    ("sqrt_taxels",),
    ("contact", "joints", "posture"),
    ("moments", "joints", "posture"),
)
"""Those of recordings that have joint angles, whose changes cost nothing to follow and tell how far
the thing gave way."""
QUICK = 3
"""The first of them."""
COMPONENTS = (1, 2, 3, 4, 5, 6, 8, 10, 14, 20)
QUICK_SHRINKAGES = (0.3, 0.03)
FEW_NEIGHBOURS = (1, 3, 5)
PAPER_SCALINGS = ("none", "I", "IV", "V")
FEWEST_GROUPS = 3
"""Objects a class needs before whole objects can be left out."""


@dataclass(frozen=True)
class Candidate:
    """Features, and how they are projected.

    Attributes:
        sets: names of the sets, and of single features.
        projection: one of `train.projection.KINDS`.
        grids: what it is searched over.
    """

    sets: tuple[str, ...]
    projection: str
    grids: tuple[SearchGrid, ...]

    @property
    def name(self) -> str:
        """The names of its features, as `--features` takes them."""
        return " ".join(self.sets)


def candidates(
    y: Labels,
    *,
    joints: bool = False,
    features: Sequence[str] | None = None,
    projection: str | None = None,
    scaling: str | None = None,
    components: int | None = None,
    k: int | None = None,
    quick: bool = False,
) -> list[Candidate]:
    """Every candidate; what is given is fixed.

    Features of many units need Method IV. Principal components of the paper's three, where they
    alone are asked for, are tried in each of its scalings that has neighbours of its own (Methods
    I and II, and III and no scaling, differ by what centring removes); beside other candidates
    they have no more settings than those: the best of many would win by chance.
    """
    if features is not None:
        every: Sequence[tuple[str, ...]] = (tuple(features),)
    else:
        every = (WITH_JOINTS if joints else PLAIN)[: QUICK if quick else None]
    found = []
    for sets in every:
        names = expand(sets)
        for kind in KINDS if projection is None else (projection,):
            paper = sets == ("paper",)
            if features is None and projection is None and paper != (kind == "pca"):
                continue
            searched = features is not None and kind == "pca"
            scalings = PAPER_SCALINGS if paper and searched else ("IV",)
            neighbours = NEIGHBOURS if searched else FEW_NEIGHBOURS
            grid = SearchGrid(
                projection=kind,
                features=names,
                components=COMPONENTS if components is None else (components,),
                shrinkages=QUICK_SHRINKAGES if quick else SHRINKAGES,
                neighbours=neighbours if k is None else (k,),
            )
            found.append(
                Candidate(
                    tuple(sets),
                    kind,
                    tuple(
                        replace(grid, scaling=one, targets=targets, tasks=tasks)
                        for one in (scalings if scaling is None else (scaling,))
                        for targets, tasks in _targets(y, kind)
                    ),
                )
            )
    return found


def _targets(y: Labels, kind: str) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """(targets, tasks) of the grids of a projection: its own, and those of products."""
    more = products(y) if kind == "lda" else {}
    return [((), ()), *((pair, (task,)) for task, pair in more.items())]


def products(y: Labels) -> dict[str, tuple[str, str]]:
    """{task: the two others whose labels together are its own}, none of them its own alone."""
    found = {}
    for task, labels in y.items():
        others = [other for other in y if other != task and not _tells(y[other], labels)]
        for i, one in enumerate(others):
            for two in others[i + 1 :]:
                both = np.char.add(np.char.add(y[one], "\0"), y[two])
                parts = all(_tells(labels, y[other]) for other in (one, two))
                if task not in found and parts and _tells(both, labels):
                    found[task] = (one, two)
    return found


def _tells(a: NDArray[np.str_], b: NDArray[np.str_]) -> bool:
    """Whether the labels b follow from the labels a."""
    pairs = set(zip(a.tolist(), b.tolist(), strict=True))
    return len(pairs) == len(set(a.tolist()))


def groupable(labels: NDArray[np.str_], groups: NDArray[np.str_]) -> bool:
    """Whether whole groups can be left out: every class has several, and so is met without."""
    return len(set(labels.tolist())) > 1 and all(
        len(set(groups[labels == label].tolist())) >= FEWEST_GROUPS for label in set(labels)
    )


def costs(choices: Sequence[Choice], widths: Mapping[str, int]) -> NDArray[np.int64]:
    """(candidates,) how dear the features and projection of each are, from 0.

    By the weights of the largest projection that they may take: these are the numbers that are
    fitted, stored on the board and multiplied for a decision. Of equal ones the first is cheaper.

    Args:
        choices: the candidates.
        widths: columns of each feature.
    """
    sizes: dict[tuple[tuple[str, ...], str], int] = {}
    kinds = [(choice.features, choice.projection) for choice in choices]
    for kind, choice in zip(kinds, choices, strict=True):
        weights = choice.components * sum(widths[name] for name in choice.features or widths)
        sizes[kind] = max(sizes.get(kind, 0), weights)
    ranks = {kind: rank for rank, kind in enumerate(sorted(sizes, key=lambda one: sizes[one]))}
    return np.array([ranks[kind] for kind in kinds], dtype=np.int64)
