"""Why a model answers as it does: each feature's pull towards a training trial.

A touch's coordinates are z = W'd, where d are its features less their mean in training,
scaled and cut off at the training data's reach. Its squared distance to a trial at b is
|z|^2 + |b|^2 - 2 b'z. The last term is a sum over the features: 2 b'W_f'd_f is how much
nearer feature f brings the touch to the trial than its mean would.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from edge.arrays import Array, Booleans, Floats, Integers
from edge.files import parsing
from edge.model.graph import Graph
from edge.model.model import Model


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

    columns: Integers
    mean: Floats
    gain: Floats
    weights: Floats
    rows: Floats
    labels: Integers
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
            # The projection's constants have no names of their own. Of two operators of
            # a kind, the one nearer to the features counts.
            first = {node.operator: node.inputs for node in reversed(nodes)}
            limits = [node.inputs[2] for node in nodes if node.operator == "Clip"]
            last = len(model.decision_points_s) - 1

            def value(name: str) -> Array:
                return graph.run([name], {"decision_point": np.array([last])})[0]

            def constant(name: str) -> Array:
                """A row for each decision point, of which the last counts."""
                array = graph.constants[f"{name} of {task}"]
                return array[-1] if last else array

            unit = value(graph.makers[f"{task}_distances"].inputs[1])
            components = model.info.tasks[task].components
            columns = np.arange(model.info.width)
            if "Gather" in first:
                columns = value(first["Gather"][1])
            columns_of_rows = constant("columns").astype(np.float64)
            rows = columns_of_rows.T[:, :components] * (-0.5 * unit)
            # Trials without a label are infinitely far away.
            rows[np.isinf(constant("lengths"))] = np.inf
            return cls(
                columns=columns,
                mean=value(first["Sub"][1]),
                gain=value(first["Mul"][1]),
                weights=value(first["MatMul"][1])[:, :components] * unit,
                rows=rows,
                labels=graph.constants[f"labels of {task}"],
                reach=float(value(limits[0])),
                limit=float(value(limits[1])) * float(unit),
            )

    def differences(self, vector: Floats) -> Floats:
        """(p,) scaled differences of a feature vector from the mean."""
        scaled = (vector[self.columns] - self.mean) * self.gain
        return np.clip(scaled, -self.reach, self.reach)

    def coordinates(self, differences: Floats) -> Floats:
        """(c,) coordinates of scaled differences."""
        return np.clip(differences @ self.weights, -self.limit, self.limit)


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


class Explanation(NamedTuple):
    """Why a touch was answered as it was.

    Attributes:
        voters: the nearest training trials, nearest first.
        rival: the nearest trial with another label than the answer, or with the right
            label if that is known; None without such a trial.
        pulls: {feature: how much more it pulls towards the nearest trial with the
            answer than towards the rival}, the strongest first.
    """

    voters: tuple[Near, ...]
    rival: Near | None = None
    pulls: dict[str, float] = {}  # noqa: RUF012


def explain(
    space: Space,
    vector: Floats,
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
    touch = _Touch(space, vector, features, widths)
    nearest = tuple(map(touch.near, voters))
    answered = space.labels == label
    other_rows = space.labels == truth
    if truth == label or not other_rows.any():
        other_rows = ~answered & (space.labels >= 0)
    if not other_rows.any():
        return Explanation(nearest)
    ally = touch.nearest(answered)
    rival = touch.nearest(other_rows)
    pulls = touch.pulls(space.rows[ally] - space.rows[rival])
    return Explanation(nearest, touch.near(rival), pulls)


class _Touch:
    """A touch in a task's space.

    Attributes:
        space: of the task.
        members: {feature: (columns,) whether each column of the space is of it}.
        differences: (p,) from the mean, scaled.
        shifts: (features, c) how far each feature moves the touch from the mean.
        z: (c,) its coordinates.
        squares: (n,) squared distances of the training trials.
    """

    def __init__(
        self,
        space: Space,
        vector: Floats,
        features: Sequence[str],
        widths: Sequence[int],
    ) -> None:
        """Place a feature vector (width,), with the features' names and widths."""
        feature_of = np.repeat(features, widths)[space.columns]
        self.space = space
        self.members = {
            name: feature_of == name for name in features if name in feature_of
        }
        self.differences = space.differences(vector)
        self.shifts = np.array(
            [self.differences[c] @ space.weights[c] for c in self.members.values()]
        )
        self.z = space.coordinates(self.differences)
        self.squares = ((space.rows - self.z) ** 2).sum(axis=1)

    def pulls(self, towards: Floats) -> dict[str, float]:
        """{feature: how much it pulls in a direction (c,)}, the strongest first."""
        strengths = (2.0 * self.shifts @ towards).tolist()
        by_feature = zip(self.members, strengths, strict=True)
        return dict(sorted(by_feature, key=lambda pull: -abs(pull[1])))

    def near(self, row: int) -> Near:
        """A training trial beside the touch."""
        distance = float(np.sqrt(self.squares[row]))
        label = int(self.space.labels[row])
        return Near(row, label, distance, self.pulls(self.space.rows[row]))

    def nearest(self, among: Booleans) -> int:
        """The nearest training trial of some (n,)."""
        return int(np.where(among, self.squares, np.inf).argmin())
