"""Explain a model's decisions on recordings.

Prints the training trials nearest to a touch, and in which features it is more like the
nearest trial with the answer, or more like the nearest one with another label, the
strongest first. `edge-classify show REC --model model.onnx` draws the curves.
"""

import argparse
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from edge.app.options import add_file, apart
from edge.app.output import Output
from edge.app.texts import wrapped
from edge.arrays import Array, Booleans, Floats, Integers
from edge.decide.graph import Graph
from edge.decide.info import ModelInfo
from edge.decide.model import Model
from edge.decide.summary import contact_of
from edge.errors import InputError, counted
from edge.files import parsing
from edge.record.recording import Recording, load
from edge.record.saving import find

MOST = 3
"""Features that a line names."""


class Space(NamedTuple):
    """The coordinates in which a task compares touches, and the training trials in
    them.

    A touch's coordinates are z = W'd, where d are its features less their mean in
    training, scaled and cut off at the training data's reach. Its squared distance to a
    trial at b is |z|^2 + |b|^2 - 2 b'z. The last term is a sum over the features: 2
    b'W_f'd_f is how much nearer feature f brings the touch to the trial than its mean
    would.

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

            def constant(name: str, rank: int) -> Array:
                """The last row, where decision points have different ones."""
                array = graph.constants[f"{name} of {task}"]
                return array if array.ndim == rank else array[-1]

            unit = value(graph.makers[f"{task}_distances"].inputs[1])
            components = model.info.tasks[task].components
            columns = np.arange(model.info.width)
            if "Gather" in first:
                columns = value(first["Gather"][1])
            columns_of_rows = constant("coordinates", 2).astype(np.float64)
            rows = columns_of_rows.T[:, :components] * (-0.5 * unit)
            # Trials without a label are infinitely far away.
            rows[np.isinf(constant("lengths", 1))] = np.inf
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
    rival: Near | None
    pulls: dict[str, float]


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
        return Explanation(nearest, None, {})
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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the model to explain")
    help = ".npz files or folders"
    parser.add_argument("recordings", nargs="+", metavar="REC", help=help)


def run(arguments: argparse.Namespace) -> int:
    """Print an explanation for each recording and task."""
    models, recordings = apart(arguments.recordings, arguments.model)
    if len(models) != 1 or not recordings:
        raise InputError("give one model.onnx, and the recordings to explain")
    model = Model(models[0])
    output = Output.of(arguments)
    for path in find(recordings):
        if not output.as_json:
            output.text(str(path))
        for line in explanations(model, load(path), str(path)):
            output.event(line, text(line))
    return 0


def explanations(
    model: Model,
    recording: Recording,
    name: str,
) -> Iterator[dict[str, Any]]:
    """For each task, why the model answers a recording's first contact as it does.

    Raises:
        InputError: the recording does not suit the model, or holds no contact.
    """
    info = model.info
    vector = info.vector(contact_of(model, recording, name))
    for task, decision in model.decide(vector).items():
        labels = info.tasks[task].labels
        answer = labels.index(decision.label)
        rows = decision.neighbours.tolist()
        true_label = recording.labels.get(task)
        truth = labels.index(true_label) if true_label in labels else None
        space = Space.of(model, task)
        why = explain(space, vector, rows, answer, info.features, info.widths, truth)
        yield {
            "event": "explanation",
            "source": name,
            "task": task,
            "label": decision.label,
            "confidence": decision.confidence,
            "votes": decision.votes,
            "nearest": [_trial(near, info, labels) for near in why.voters],
            "rival": why.rival and _trial(why.rival, info, labels),
            "pulls": why.pulls,
        }


def _trial(near: Near, info: ModelInfo, labels: Sequence[str]) -> dict[str, Any]:
    """A training trial near a touch, with its name and its label."""
    return {
        **near._asdict(),
        "label": labels[near.label],
        "trial": info.trial(near.row),
    }


def text(line: dict[str, Any]) -> str:
    """An explanation for a person."""
    label = line["label"]
    nearest = line["nearest"]
    rival = line["rival"]
    votes = round(line["votes"] * len(nearest))
    lines = [f"{line['task']}: {label}, by {votes} of {counted(len(nearest), 'vote')}"]
    lines.append("  The nearest training trials, each with its distance:")
    lines += map(trial_text, nearest)
    if rival:
        lines += ["  The nearest one with another label:", trial_text(rival)]
        strongest = list(line["pulls"].items())[:MOST]
        for nearer, sign in ((label, 1.0), (rival["label"], -1.0)):
            names = [name for name, pull in strongest if sign * pull > 0.0]
            if names:
                sentence = f"It is more like {nearer} in {', '.join(names)}."
                lines += wrapped(sentence, "  ")
    return "\n".join(lines)


def trial_text(trial: dict[str, Any]) -> str:
    """A training trial: distance, name and label."""
    return f"  {trial['distance']:7.3f}  {trial['trial']}: {trial['label']}"
