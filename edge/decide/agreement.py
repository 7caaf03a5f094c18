"""Tasks that agree: one whose labels are the pairs of two others' labels is decided
with them."""

from collections.abc import Mapping, Sequence

import numpy as np

from edge.arrays import Array

Factors = Mapping[str, Sequence[int]]
"""{factor: the index of its label for each label of the joint task}. A joint task, such
as category, has one label for each pair of its two factors' labels, such as mobility
and softness, that was met in training."""


def agreed(
    task: str,
    factors: Factors,
    distances: Mapping[str, Array],
) -> tuple[dict[str, Array], dict[str, Array]]:
    """The nearest answer in which a joint task and its factors agree.

    An answer's distance is the sum of its three labels' distances.

    Args:
        task: the joint task.
        factors: of the joint task.
        distances: {task: (..., labels) in log odds} of the three tasks at least.

    Returns:
        {task: (...) indices of the answer's labels}, and {task: (..., labels) distance
        of the nearest answer with each label}, of the three tasks.
    """
    columns = {factor: np.array(indices) for factor, indices in factors.items()}
    totals = sum(
        (distances[f][..., indices] for f, indices in columns.items()), distances[task]
    )
    best = np.asarray(totals.argmin(axis=-1))
    labels = {task: best}
    nearest = {task: totals}
    for factor, indices in columns.items():
        labels[factor] = indices[best]
        with_label = [
            totals[..., indices == i].min(axis=-1) for i in range(indices.max() + 1)
        ]
        nearest[factor] = np.stack(with_label, axis=-1)
    return labels, nearest


def joint_label(factors: Factors, indices: Mapping[str, int]) -> int | None:
    """The index of the joint task's label for the factors' labels (indices); None where
    this pair is unseen."""
    pairs = list(zip(*factors.values(), strict=True))
    pair = tuple(indices[factor] for factor in factors)
    return pairs.index(pair) if pair in pairs else None


def factors_fit(
    factors: Factors,
    labels: Mapping[str, tuple[str, ...]],
    task: str,
) -> bool:
    """Whether each label of the task is a pair of the factors' labels, and each of
    these is in one.

    Args:
        factors: of the task.
        labels: {task: its labels} of a model.
        task: the joint task.
    """
    lengths = {len(indices) for indices in factors.values()}
    if len(factors) != 2 or lengths != {len(labels[task])}:
        return False
    for factor, indices in factors.items():
        if {*indices} != {*range(len(labels.get(factor, ())))}:
            return False
    pairs = list(zip(*factors.values(), strict=True))
    if len({*pairs}) < len(pairs):
        return False
    first, second = (labels[factor] for factor in factors)
    return _named_after(pairs, first, second, labels[task])


def _named_after(
    pairs: Sequence[tuple[int, int]],
    first: Sequence[str],
    second: Sequence[str],
    names: tuple[str, ...],
) -> bool:
    """Whether names stand for their pairs of labels, where they are made of these, as
    `rigid-fixed` is. Other names stand for any pair."""
    forward = []
    backward = []
    for a, b in pairs:
        forward.append(f"{first[a]}-{second[b]}")
        backward.append(f"{second[b]}-{first[a]}")
    return all(
        tuple(pair_names) == names or set(pair_names) != set(names)
        for pair_names in (forward, backward)
    )
