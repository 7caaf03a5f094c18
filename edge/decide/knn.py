"""The formula of a decision by nearest training trials, in numpy, with ONNX Runtime's
bits.

It is written over the constants that stand in a model file beside its graph, under the
names that `export/graph.py` gives them. All that decides is made of whole numbers below
2^53, which no order of summation rounds.
"""

from collections.abc import Mapping

import numpy as np

from edge.arrays import Array, Floats, Integers
from edge.decide.info import ModelInfo

LARGEST = float(np.finfo(np.float64).max)


class Constants:
    """The constants of a model file at one of its decision points.

    >>> from edge import demo
    >>> from edge.decide import onnx_file
    >>> contents = onnx_file.read(demo.MODEL.read_bytes(), "the demo")
    >>> Constants(contents.constants, point=0).numbers("limits of space 0").item()
    8388608.0
    """

    def __init__(self, arrays: Mapping[str, Array], point: int) -> None:
        self._arrays = arrays
        self._point = point
        self._numbers: dict[str, Array] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def numbers(self, name: str, axes: int = 0, first: int = 0) -> Array:
        """A constant, whose whole numbers stay whole.

        Args:
            name: of the constant.
            axes: how many it has. Where it differs by decision point, the file has one
                more, which is the first.
            first: the first decision point on that axis.
        """
        if name not in self._numbers:
            array = self._arrays[name]
            if array.ndim > axes:
                array = array[self._point - first]
            kind = np.int64 if array.dtype == np.int64 else np.float64
            self._numbers[name] = np.asarray(array, kind)
        return self._numbers[name]

    def space(self, task: str) -> int:
        """The number of a task's space."""
        return int(self.numbers(f"space of {task}"))

    def coordinates(self, task: str) -> Array:
        """(components, rows) those of a task's training trials, times -2."""
        number = int(self.numbers(f"rows of {task}"))
        return self.numbers(f"coordinates of rows {number}", 2)

    def projection(self, space: int) -> tuple[int, str]:
        """The first decision point of the projection in use, and the end of its
        constants' names."""
        for first in range(self._point, 0, -1):
            if f"means of space {space} from {first}" in self:
                return first, f"of space {space} from {first}"
        return 0, f"of space {space} from 0"


def clipped(x: Floats, limit: Array) -> tuple[Floats, Floats]:
    """Numbers (n, m) cut off at plus and minus a limit, and their summed excess
    (n,)."""
    inside = x.clip(-limit, limit)
    return inside, np.asarray(np.abs(x - inside).sum(axis=1))


def project(at: Constants, space: int, features: Floats) -> tuple[Floats, Floats]:
    """Whole coordinates (n, c) of features (n, width), and how much was cut off to get
    them (n,): not finite where a feature is not."""
    first, name = at.projection(space)
    x = features
    if f"columns {name}" in at:
        x = features[:, at.numbers(f"columns {name}", 1)]
    centred = x - at.numbers(f"means {name}", 1, first)
    scaled = np.rint(centred * at.numbers(f"gains {name}", 1, first))
    steps, far = clipped(scaled, at.numbers("most steps"))
    products = np.rint(steps @ at.numbers(f"weights {name}", 2, first))
    z, farther = clipped(products, at.numbers(f"limits of space {space}"))
    # A feature that another space takes must be finite too.
    return z, far + farther + np.abs(features * 0.0).sum(axis=1)


def squared_distances(x: Floats, factor: Floats, rows: Array, lengths: Array) -> Floats:
    """(n, rows) squared distances of points x (n, c).

    Args:
        x: the points.
        factor: (n, c) the points times the squares of the coordinates' weights.
        rows: (c, rows) the training trials times -2.
        lengths: (rows,) the squared lengths of these.
    """
    return np.asarray(factor @ rows + lengths + (x * x).sum(axis=1, keepdims=True))


def vote(labels: Integers, classes: int) -> tuple[Integers, Floats]:
    """(n,) majority of the nearest trials' labels (n, k), and the share of each label
    (n, classes); a tie goes to the nearest of the tied."""
    shares = (labels[:, :, None] == np.arange(classes)).mean(axis=1)
    votes = np.take_along_axis(shares, labels, axis=1)
    first = votes.argmax(axis=1)[:, None]
    return np.take_along_axis(labels, first, axis=1)[:, 0], shares


def answer(at: Constants, task: str, z: Floats, off: Floats) -> dict[str, Array]:
    """{output: its value} of a task, by coordinates z (n, c) and what was cut off
    (n,)."""
    if f"mask of {task}" in at:
        z = z * at.numbers(f"mask of {task}", 1)
    rows = at.coordinates(task)
    number = int(at.numbers(f"lengths of {task}"))
    lengths = at.numbers(f"lengths of rows {number}", 1)
    squares = squared_distances(z, z, rows, lengths)
    labels = at.numbers(f"labels of {task}", 1)
    classes = int(labels.max()) + 1
    k = at.numbers(f"k of {task}", 1).item()
    neighbours = squares.argsort(axis=1, kind="stable")[:, :k]
    nearest = np.sqrt(np.take_along_axis(squares, neighbours, axis=1))
    # A vector that is not finite has no label.
    voters = np.where(off[:, None] <= LARGEST, labels[neighbours], -1)
    label, shares = vote(voters, classes)
    outputs = {
        f"{task}_label": label,
        f"{task}_scores": shares,
        f"{task}_distances": nearest * at.numbers("units", 1)[at.space(task)],
        f"{task}_neighbours": neighbours,
    }
    if f"scales of {task}" in at:
        counts = at.numbers(f"counts of {task}", 1)
        means = [
            _mean_root(squares[:, labels == i], int(counts[i])) for i in range(classes)
        ]
        scale = at.numbers(f"scales of {task}")
        outputs[f"{task}_label_distances"] = np.stack(means, axis=1) * scale
    return outputs


def _mean_root(squares: Floats, count: int) -> Floats:
    """(n,) mean of the rounded roots of the smallest squares (n, m)."""
    nearest = np.sort(squares, axis=1)[:, :count]
    return np.asarray(np.rint(np.sqrt(nearest)).sum(axis=1) / count)


def doubts(at: Constants, features: Floats) -> dict[str, Array]:
    """(n,) the outlier score and the distance to known objects of features (n, width);
    see `train.model.outlier_score`."""
    centred = features - at.numbers("outlier means", 1)
    scaled = np.rint(centred * at.numbers("outlier gains", 1))
    steps, _ = clipped(scaled, at.numbers("outlier most steps"))
    inner = steps @ at.numbers("outlier weights", 2)
    inner = np.rint(inner * at.numbers("outlier factor"))
    outside = np.maximum((steps**2).sum(axis=1) - (inner**2).sum(axis=1), 1.0)
    white = inner @ at.numbers("outlier whitening", 2)
    white = np.rint(white * at.numbers("outlier whitening factors"))
    y, _ = clipped(white, at.numbers("outlier limit"))
    weights = at.numbers("known weights", 1)
    weighted = y * weights
    spread = np.sqrt(outside)
    return {
        "outlier_score": spread * _least_root(at, "outlier", y, y),
        "known_distance": _least_root(at, "known", weighted, weighted * weights),
    }


def _least_root(at: Constants, kind: str, y: Floats, factor: Floats) -> Floats:
    """(n,) root of the smallest of the squared distances times the nearness."""
    rows = at.numbers("outlier coordinates", 2)
    squares = squared_distances(y, factor, rows, at.numbers(f"{kind} lengths", 1))
    nearness = at.numbers(f"{kind} nearness", 1)
    return np.asarray(np.sqrt((squares * nearness).min(axis=1)))


class NearestTrials:
    """A scorer of `edge.decide.engines` that needs no more than numpy.

    Attributes:
        name: one of `edge.decide.engines.ENGINES`.
    """

    name = "numpy"

    def __init__(self, arrays: Mapping[str, Array], info: ModelInfo) -> None:
        """Take the constants and the metadata of a model file."""
        self._tasks = tuple(info.tasks)
        self._points = [Constants(arrays, point) for point in range(len(info.points_s))]
        self._has_doubts = bool(info.decision_points_s)

    def score(self, vectors: Floats, point: int) -> dict[str, Array]:
        """{output: its value} for vectors (n, width) of a decision point."""
        at = self._points[point]
        with np.errstate(all="ignore"):
            spaces = {at.space(task) for task in self._tasks}
            projected = {space: project(at, space, vectors) for space in spaces}
            most = np.max([off for _, off in projected.values()], axis=0)
            outputs = {"out_of_range": np.where(most <= 0.0, 0.0, 1.0)}
            if self._has_doubts:
                outputs |= doubts(at, vectors)
            for task in self._tasks:
                outputs |= answer(at, task, *projected[at.space(task)])
        return outputs
