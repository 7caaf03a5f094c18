"""The data set that every section of the study works on."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from edge.arrays import Floats
from edge.features.vector import FEATURES, SAMPLES, WINDOW_S
from train.data.dataset import DataSet
from train.data.vectors import Labels
from train.report.work import Workers
from train.simulate.scene_model import Scene


@dataclass(frozen=True)
class Context:
    """A data set and the processes to work with.

    Attributes:
        dataset: contacts followed for up to 2 s.
        scene: the scene that the recordings were simulated from, if any.
        workers: the processes.
    """

    dataset: DataSet
    scene: Scene | None = None
    workers: Workers = field(default_factory=Workers)

    @property
    def labels(self) -> Labels:
        """{task: (n,) labels} of the tasks that have more than one class."""
        y = {task: self.dataset.labels(task) for task in self.dataset.tasks}
        return {task: labels for task, labels in y.items() if len(set(labels)) > 1}

    def vectors(self, names: Sequence[str] = FEATURES) -> Floats:
        """The trials' feature vectors."""
        return self.dataset.features(WINDOW_S, SAMPLES, names)
