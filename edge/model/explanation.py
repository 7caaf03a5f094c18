"""Why a model answers as it does: what drew a touch towards a training trial, feature by feature.

A touch's coordinates are z = W'd, where d are its features less their mean in training, scaled. Its
squared distance to a trial at b is |z|^2 + |b|^2 - 2 b'z. The last term is a sum over the features:
2 b'W_f'd_f is how much nearer feature f brings the touch to the trial than its mean would.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge.files import parsing, read_bytes
from edge.model import onnx_file
from edge.model.model import LARGEST_BYTES, Model

STEPS = (1.0, 1.2, 1.5, 2.0, 3.0, 4.0)
"""Multiples of the change that makes the rival as near; several votes may take more."""


class Space(NamedTuple):
    """What a task compares touches by.

    Attributes:
        columns: (p,) of the feature vectors that it takes.
        mean, gain: (p,) of these.
        weights: (p, c) from scaled differences to coordinates.
        rows: (n, c) training trials.
        labels: (n,) indices of their labels.
    """

    columns: NDArray[np.int64]
    mean: NDArray[np.float64]
    gain: NDArray[np.float64]
    weights: NDArray[np.float64]
    rows: NDArray[np.float64]
    labels: NDArray[np.int64]

    @classmethod
    def of(cls, model: Model, task: str) -> Space:
        """Read a task's space, at the full window, from the model file.

        Raises:
            InputError: the file is damaged, or was changed since the model was loaded.
        """
        with parsing(model.path, "a model that can be explained", "; export it again"):
            nodes, constants = onnx_file.graph(read_bytes(model.path, LARGEST_BYTES))

            def constant(name: str) -> NDArray[np.float64]:
                """A constant, or its value at the last decision point."""
                if name in constants:
                    return constants[name].astype(np.float64)
                operator, (source, *_) = nodes[name]
                return constant(source)[-1] if operator == "Gather" else constant(source)

            # From the neighbours back to the features, through each operator's first input. Of two
            # products the one nearer to the features is the gain.
            name, path = f"{task}_neighbours", {}
            while name in nodes:
                operator, (name, *path[operator]) = nodes[name]
            unit, c = constant(nodes[f"{task}_distances"][1][1]), model.info.tasks[task].components
            columns = path.get("Gather")
            rows = constant(path["Gemm"][0]).T[:, :c] * (-0.5 * unit)
            rows[np.isinf(constant(path["Gemm"][1]))] = np.inf  # trials without a label
            voters = next(given for _, given in nodes.values() if f"{task}_neighbours" in given)
            return cls(
                constants[columns[0]] if columns else np.arange(model.info.width),
                constant(path["Sub"][0]),
                constant(path["Mul"][0]),
                constant(path["MatMul"][0])[:, :c] * unit,
                rows,
                constants[voters[0]],
            )

    def vote(self, z: NDArray[np.float64], k: int) -> int:
        """The label of the k nearest trials; of tied ones that of the nearest."""
        voters = self.labels[np.argsort(((self.rows - z) ** 2).sum(axis=1), kind="stable")[:k]]
        return int(voters[np.bincount(voters)[voters].argmax()])


class Near(NamedTuple):
    """A training trial near a touch: its row, label (index) and distance, and the features' pulls.

    A pull is by how much a feature lowers the squared distance; the strongest come first.
    """

    row: int
    label: int
    distance: float
    pulls: dict[str, float]


class Change(NamedTuple):
    """The least change of one feature that would have given another answer (index of its label).

    Its size is a root mean square over the window, in the feature's unit, like its mean.
    """

    feature: str
    label: int
    size: float
    mean: float


class Explanation(NamedTuple):
    """Why a touch was answered as it was.

    Attributes:
        voters: the nearest training trials, nearest first.
        rival: the nearest one of another label than the answer, or of the right one; None if there
            is none.
        pulls: {feature: how much more it pulls towards the nearest trial with the answer than
            towards the rival}, the strongest first.
        changes: one for each feature that can change the answer, the smallest of them, in
            deviations of the training trials, first.
    """

    voters: tuple[Near, ...]
    rival: Near | None = None
    pulls: dict[str, float] = {}  # noqa: RUF012
    changes: tuple[Change, ...] = ()


def explain(
    space: Space,
    vector: NDArray[np.float64],
    voters: Sequence[int],
    label: int,
    features: Sequence[str],
    widths: Sequence[int],
    truth: int | None = None,
) -> Explanation:
    """Explain an answer.

    Args:
        space: of the task.
        vector: (width,) features of the touch.
        voters: rows of the nearest training trials.
        label: index of the answer.
        features: names of the features in the vector.
        widths: columns of each.
        truth: index of the label that is right, if it is known: the rival then has it.
    """
    feature_of = np.repeat(features, widths)[space.columns]
    members = {name: feature_of == name for name in features if name in feature_of}
    d = (vector[space.columns] - space.mean) * space.gain
    parts = np.array([d[own] @ space.weights[own] for own in members.values()])
    z = parts.sum(axis=0)
    squares = ((space.rows - z) ** 2).sum(axis=1)

    def pulls(towards: NDArray[np.float64]) -> dict[str, float]:
        by_feature = zip(members, (2.0 * parts @ towards).tolist(), strict=True)
        return dict(sorted(by_feature, key=lambda pull: -abs(pull[1])))

    def near(row: int) -> Near:
        distance = float(np.sqrt(squares[row]))
        return Near(row, int(space.labels[row]), distance, pulls(space.rows[row]))

    nearest, own = tuple(map(near, voters)), space.labels == label
    if own.all():
        return Explanation(nearest)
    others = space.labels == truth
    others = others if truth != label and others.any() else ~own
    a, b = (int(np.where(those, squares, np.inf).argmin()) for those in (own, others))
    apart = space.rows[a] - space.rows[b]
    changes = []
    for name, columns in members.items():
        slope = 2.0 * space.weights[columns] @ apart
        if not slope.any():
            continue
        step = slope * (min(squares[a] - squares[b], 0.0) / (slope @ slope))
        for change in (times * step for times in STEPS):
            answer = space.vote(z + change @ space.weights[columns], len(voters))
            if answer != label:
                x = change / space.gain[columns]
                size = float(np.sqrt((x**2).mean()))
                changes.append(((change**2).mean(), Change(name, answer, size, float(x.mean()))))
                break
    ordered = tuple(change for _, change in sorted(changes, key=lambda pair: pair[0]))
    return Explanation(nearest, near(b), pulls(apart), ordered)
