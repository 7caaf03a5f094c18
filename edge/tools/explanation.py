"""Why a model answers as it does: each feature's pull towards a training trial.

A touch's coordinates are z = W'd, where d are its features less their mean in training,
scaled and cut off at the training data's reach. Its squared distance to a trial at b is
|z|^2 + |b|^2 - 2 b'z. The last term is a sum over the features: 2 b'W_f'd_f is how much nearer
feature f brings the touch to the trial than its mean would.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from edge.files import parsing
from edge.model.graph import Graph
from edge.model.model import Model

STEPS = (0.25, 0.5, 0.75, 1.0, 1.2, 1.5, 2.0, 3.0, 4.0)
"""Multiples of the change at which two trials become equally near. A further trial on
the way may take less, several votes more."""


class Space(NamedTuple):
    """The coordinates in which a task compares touches, and the training trials in
    them.

    Attributes:
        columns: (p,) of the feature vectors that it takes.
        mean, gain: (p,) of these columns.
        weights: (p, c) from scaled differences to coordinates.
        rows: (n, c) training trials.
        labels: (n,) indices of their labels.
        reach, limit: the sizes at which scaled differences, and coordinates, are cut
            off.
    """

    columns: NDArray[np.int64]
    mean: NDArray[np.float64]
    gain: NDArray[np.float64]
    weights: NDArray[np.float64]
    rows: NDArray[np.float64]
    labels: NDArray[np.int64]
    reach: float = np.inf
    limit: float = np.inf

    @classmethod
    def of(cls, model: Model, task: str) -> Self:
        """Read a task's space, at the full window, from the model file.

        Raises:
            InputError: the file is damaged.
        """
        with parsing(model.path, "a model that can be explained", "; export it again"):
            graph = Graph(model.contents)
            nodes = graph.path(f"{task}_neighbours")
            # Of two operators of a kind, the one nearer to the features counts.
            first = {node.operator: node.inputs for node in reversed(nodes)}
            limits = [node.inputs[2] for node in nodes if node.operator == "Clip"]
            voters = next(
                node.inputs[0]
                for node in model.contents.nodes
                if f"{task}_neighbours" in node.inputs
            )
            names = {
                "mean": first["Sub"][1],
                "gain": first["Mul"][1],
                "weights": first["MatMul"][1],
                "columns of rows": first["Gemm"][1],
                "lengths": first["Gemm"][2],
                "unit": graph.makers[f"{task}_distances"].inputs[1],
                "labels": voters,
                "reach": limits[0],
                "limit": limits[1],
            }
            if "Gather" in first:
                names["columns"] = first["Gather"][1]
            last = len(model.decision_points_s) - 1
            inputs = {"decision_point": np.array([last])}
            computed = graph.run(list(names.values()), inputs)
            values = dict(zip(names, computed, strict=True))
            unit = values["unit"]
            components = model.info.tasks[task].components
            rows = values["columns of rows"].T[:, :components] * (-0.5 * unit)
            rows[np.isinf(values["lengths"])] = np.inf  # trials without a label
            return cls(
                columns=values.get("columns", np.arange(model.info.width)),
                mean=values["mean"],
                gain=values["gain"],
                weights=values["weights"][:, :components] * unit,
                rows=rows,
                labels=values["labels"],
                reach=float(values["reach"]),
                limit=float(values["limit"]) * float(unit),
            )

    def differences(self, vector: NDArray[np.float64]) -> NDArray[np.float64]:
        """(p,) scaled differences of a feature vector from the mean."""
        scaled = (vector[self.columns] - self.mean) * self.gain
        return np.clip(scaled, -self.reach, self.reach)

    def coordinates(self, differences: NDArray[np.float64]) -> NDArray[np.float64]:
        """(c,) coordinates of scaled differences."""
        z = np.clip(differences, -self.reach, self.reach) @ self.weights
        return np.clip(z, -self.limit, self.limit)

    def vote(self, z: NDArray[np.float64], k: int) -> int:
        """The label of the k nearest trials; of tied ones that of the nearest."""
        voters = self.labels[
            np.argsort(((self.rows - z) ** 2).sum(axis=1), kind="stable")[:k]
        ]
        return int(voters[np.bincount(voters)[voters].argmax()])


class Near(NamedTuple):
    """A training trial near a touch: its row, label (index) and distance, and the
    features' pulls.

    A feature's pull is the amount by which it lowers the squared distance. The
    strongest pull comes first.
    """

    row: int
    label: int
    distance: float
    pulls: dict[str, float]


class Change(NamedTuple):
    """The least change of one feature that would have given another answer (index of
    its label).

    Its size is a root mean square over the window, in the feature's unit, like its
    mean.
    """

    feature: str
    label: int
    size: float
    mean: float


class Explanation(NamedTuple):
    """Why a touch was answered as it was.

    Attributes:
        voters: the nearest training trials, nearest first.
        rival: the nearest trial with another label than the answer, or with the right
            label if that is known; None without such a trial.
        pulls: {feature: how much more it pulls towards the nearest trial with the
            answer than towards the rival}, the strongest first.
        changes: one for each feature that can change the answer, the smallest of them,
            in deviations of the training trials, first. There are none where the votes
            are for another label already, and the answer follows from other tasks.
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
    differences = space.differences(vector)
    shifts = np.array([differences[c] @ space.weights[c] for c in members.values()])
    z = space.coordinates(differences)
    squares = ((space.rows - z) ** 2).sum(axis=1)

    def pulls(towards: NDArray[np.float64]) -> dict[str, float]:
        by_feature = zip(members, (2.0 * shifts @ towards).tolist(), strict=True)
        return dict(sorted(by_feature, key=lambda pull: -abs(pull[1])))

    def near(row: int) -> Near:
        distance = float(np.sqrt(squares[row]))
        return Near(row, int(space.labels[row]), distance, pulls(space.rows[row]))

    nearest, answered = tuple(map(near, voters)), space.labels == label
    others = space.labels == truth
    if truth == label or not others.any():
        others = ~answered & (space.labels >= 0)
    if not others.any():
        return Explanation(nearest)
    ally, rival = (
        int(np.where(rows, squares, np.inf).argmin()) for rows in (answered, others)
    )
    pulled = pulls(space.rows[ally] - space.rows[rival])
    if space.vote(z, len(voters)) != label:
        return Explanation(nearest, near(rival), pulled)
    # A vote changes where a trial of another label comes as near as the last one for
    # the answer.
    votes = np.isin(np.arange(len(squares)), voters)
    leaves = np.where(votes & answered, squares, -np.inf).argmax()
    joins = np.where(others & ~votes, squares, np.inf).argmin()
    direction = space.rows[leaves] - space.rows[joins]
    changes = []
    for name, columns in members.items():
        slope = 2.0 * space.weights[columns] @ direction
        if not slope.any():
            continue
        step = slope * (min(squares[leaves] - squares[joins], 0.0) / (slope @ slope))
        for times in STEPS:
            changed = differences.copy()
            changed[columns] += times * step
            answer = space.vote(space.coordinates(changed), len(voters))
            if answer != label:
                x = times * step / space.gain[columns]
                change = Change(
                    name, answer, float(np.sqrt((x**2).mean())), float(x.mean())
                )
                changes.append((times**2 * (step**2).mean(), change))
                break
    ordered = tuple(change for _, change in sorted(changes, key=lambda pair: pair[0]))
    return Explanation(nearest, near(rival), pulled, ordered)
