"""The data set that every section of the study works on, and the processes to work with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.recording import Recording
from edge.touch.contact import FeatureSeries
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from train.dataset import DataSet
from train.evaluate import Labels
from train.simulate.scene_model import Scene
from train.study import skins


@dataclass
class Context:
    """A data set, its recordings, and the processes to work with.

    Attributes:
        dataset: followed for the paper's three features, up to 2 s.
        scene: what they were simulated from, or None.
        jobs: processes.
        cluster: a joblib backend that is not this machine's, or None.
        ours: {(table, setting, task): accuracy in percent}, beside the paper's numbers.
        others: the same of further data sets of the scene.
        progress: show how far the work is.
    """

    dataset: DataSet
    scene: Scene | None
    jobs: int
    cluster: str | None = None
    ours: dict[tuple[str, str, str], float] = field(default_factory=dict)
    others: list[dict[tuple[str, str, str], float]] = field(default_factory=list)
    progress: bool = True

    @property
    def every(self) -> list[dict[tuple[str, str, str], float]]:
        """`ours` of each data set."""
        return [self.ours, *self.others]

    @property
    def tested(self) -> int:
        """Trials behind the mean of each number over `every` data set."""
        return len(self.every) * len(self.dataset.trials)

    @property
    def labels(self) -> Labels:
        """{task: (n,) labels} of the tasks that have more than one class."""
        every = {task: self.dataset.labels(task) for task in self.dataset.tasks}
        return {task: labels for task, labels in every.items() if len(set(labels)) > 1}

    @property
    def recordings(self) -> list[Recording]:
        """The recording of each trial."""
        return [trial.recording for trial in self.dataset.trials]

    @property
    def series(self) -> list[FeatureSeries | None]:
        """The series of each trial."""
        return [trial.series for trial in self.dataset.trials]

    def vectors(
        self, window_s: float = WINDOW_S, names: Sequence[str] = FEATURES
    ) -> NDArray[np.float64]:
        """The trials' feature vectors."""
        return skins.vectors(self.series, window_s, SAMPLES, names)

    def map(
        self, what: str, function: Callable[..., Any], cases: Sequence[tuple[Any, ...]]
    ) -> list[Any]:
        """function(*case) of each case, in order, by all processes."""
        # A memory map would make arrays read-only files; these are small.
        run = Parallel(
            n_jobs=self.jobs, backend=self.cluster, return_as="generator", max_nbytes=None
        )
        work = (delayed(_single)(function, case) for case in cases)
        hidden = not self.progress
        return list(tqdm(run(work), total=len(cases), desc=f"{what:<22}", disable=hidden))

    def follow_again(
        self, what: str, views: Sequence[skins.View]
    ) -> list[list[FeatureSeries | None]]:
        """The trials' contacts in each of several views, in the order of the trials."""
        data = self.dataset
        # A recording travels to another process once, however many views it is seen in.
        parts = np.array_split(np.arange(len(self.recordings)), 8 * self.jobs)
        cases = [
            ({i: self.recordings[i] for i in part.tolist()}, views, data.tracking, data.chain)
            for part in parts
            if part.size
        ]
        merged: list[dict[int, FeatureSeries | None]] = [{} for _ in views]
        for answer in self.map(what, skins.follow_views, cases):
            for all_seen, seen in zip(merged, answer, strict=True):
                all_seen |= seen
        return [[seen[i] for i in sorted(seen)] for seen in merged]


def _single(function: Callable[..., Any], case: tuple[Any, ...]) -> Any:
    with threadpool_limits(1):
        return function(*case)
