"""The same trials decided with the features of shear and without them, and what shear
costs on the wire."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from edge.touch.measures import SHEAR, feature
from train.data.dataset import DataSet
from train.report.work import Workers
from train.tradeoff.choices import Points, chosen, unseen
from train.tradeoff.wires import microcontroller

KNOWN = "known objects"
UNSEEN = "unseen objects"


@dataclass(frozen=True)
class Answers:
    """The choices of quick candidates at each window.

    Attributes:
        points: the choices.
    """

    points: Points

    @property
    def tasks(self) -> list[str]:
        """The tasks."""
        return list(next(iter(self.points.values())))

    def shares(self, task: str, kind: str) -> dict[float, float | None]:
        """{window: accuracy} for `KNOWN` or `UNSEEN` objects; None if no group was left
        out."""
        shares: dict[float, float | None] = {}
        for window, tasks in self.points.items():
            choice = tasks[task]
            result = choice.by_trial if kind == KNOWN else unseen(choice)
            hits = None if result is None else np.asarray(result.hits)
            shares[window] = None if hits is None else float(hits.mean())
        return shares


@dataclass(frozen=True)
class Compared:
    """The same trials with shear and without.

    Attributes:
        sheared, plain: the answers with all features, and without those of shear.
    """

    sheared: Answers
    plain: Answers


def without(dataset: DataSet) -> DataSet:
    """The same trials without the features of shear."""
    names = [name for name in dataset.names if feature(name).quantity not in SHEAR]
    return dataset.of(names)


def answers(dataset: DataSet, windows: Sequence[float], workers: Workers) -> Answers:
    """The quick choice at each window."""
    cases = [(dataset, window) for window in windows]
    results = workers.map("windows", chosen, cases)
    return Answers(dict(zip(windows, results, strict=True)))


def compared(dataset: DataSet, windows: Sequence[float], workers: Workers) -> Compared:
    """The answers with shear beside those without."""
    return Compared(
        answers(dataset, windows, workers),
        answers(without(dataset), windows, workers),
    )


def price(dataset: DataSet) -> str:
    """What three axes cost on the wire."""
    all_axes = microcontroller(replace(dataset.layout, axes=3))
    normal_only = microcontroller(replace(dataset.layout, axes=None))
    return (
        f"{dataset.layout.rows * dataset.layout.cols * 4} bytes a frame fewer: "
        f"{1.0 / normal_only.frame_s:.0f} frames a second on one bus at 1 MHz instead of "
        f"{1.0 / all_axes.frame_s:.0f}"
    )
