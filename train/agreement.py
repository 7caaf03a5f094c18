"""Which tasks' labels are the pairs of two others', as the training labels show."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Labels = Mapping[str, NDArray[np.str_]]
"""{task: (n,) labels}; empty where a trial has none."""


def products(y: Labels) -> dict[str, tuple[str, str]]:
    """{task: two other tasks whose labels together determine its own, and follow from
    it}.

    Neither of the two determines the task alone.
    """
    pairs: dict[str, tuple[str, str]] = {}
    for task, labels in y.items():
        factors = [
            other
            for other in y
            if other != task
            and _determines(labels, y[other])
            and not _determines(y[other], labels)
        ]
        for a, b in combinations(factors, 2):
            joined = np.char.add(np.char.add(y[a], "\0"), y[b])
            if task not in pairs and _determines(joined, labels):
                pairs[task] = (a, b)
    return pairs


def _determines(a: NDArray[np.str_], b: NDArray[np.str_]) -> bool:
    """Whether the labels b follow from the labels a."""
    pairs = {(x, z) for x, z in zip(a.tolist(), b.tolist(), strict=True) if x and z}
    return len(pairs) == len({x for x, _ in pairs})


def factors_of(y: Labels) -> dict[str, dict[str, tuple[int, ...]]]:
    """{product: its `edge.model.agreement.Factors`}, where every pair of labels was
    met.

    No task belongs to two products.
    """
    out: dict[str, dict[str, tuple[int, ...]]] = {}
    used_tasks: set[str] = set()
    for task, factors in products(y).items():
        met = set(zip(*(y[t].tolist() for t in (task, *factors)), strict=True))
        pairs = sorted(labels for labels in met if all(labels))
        names = {factor: sorted(set(y[factor].tolist()) - {""}) for factor in factors}
        if used_tasks & {task, *factors} or len(pairs) != np.prod(
            list(map(len, names.values()))
        ):
            continue
        used_tasks |= {task, *factors}
        indices = zip(factors, list(zip(*pairs, strict=True))[1:], strict=True)
        out[task] = {f: tuple(map(names[f].index, labels)) for f, labels in indices}
    return out


def families(y: Labels) -> list[tuple[str, ...]]:
    """The tasks that are decided together: a product and its two factors each."""
    return [(task, *factors) for task, factors in factors_of(y).items()]
