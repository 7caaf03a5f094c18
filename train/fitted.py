"""A fitted model, with everything that its file says about it."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

from edge.arrays import Floats
from train.choose.candidates import Candidate
from train.choose.settings import Chosen
from train.data.dataset import DataSet
from train.data.vectors import Vectors
from train.model.pipeline import Choice, ContactClassifier
from train.model.stopping import EarlySettings, SequentialClassifier


@dataclass(frozen=True)
class Fitted:
    """A fitted model, with everything that its file says about it.

    Attributes:
        dataset: the trials it was fitted on, with the features that it takes.
        measured: the trials that the settings were chosen by, with the features of
            every candidate.
        window_s: of the full decision.
        samples: values of a feature.
        X: (n, p) feature vectors at the full window.
        chosen: {task: its settings}.
        candidates: the candidates that they were chosen among.
        classifier: at the full window.
        sequential: at all decision points, where it was calibrated.
        notes: sentences that a user should read.
    """

    dataset: DataSet
    measured: DataSet
    window_s: float
    samples: int
    X: Floats = field(repr=False)
    chosen: dict[str, Chosen]
    candidates: tuple[Candidate, ...]
    classifier: ContactClassifier
    sequential: SequentialClassifier | None = None
    notes: tuple[str, ...] = ()

    @property
    def early(self) -> EarlySettings | None:
        """Settings of the decision points before the full window, where these have
        their own."""
        return None if self.sequential is None else self.sequential.early

    @cached_property
    def _vectors(self) -> Vectors:
        """Those of `measured`."""
        return self.measured.vectors(self.window_s, self.samples, {})

    def selection(self, choices: Iterable[Choice]) -> tuple[DataSet, Vectors]:
        """The trials of `measured`, and their vectors, with the features and labels that
        some settings of the tasks take."""
        tasks = set(self.chosen)
        features: list[str] = []
        for choice in choices:
            tasks.update(choice.targets)
            features += choice.features
        y = {task: self.measured.labels(task) for task in tasks}
        return self.measured.of(features), replace(self._vectors.of(features), y=y)
