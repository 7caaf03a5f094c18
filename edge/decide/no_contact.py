"""Decisions on a stream without contact, of models that have a label for it."""

import time

import numpy as np

from edge.decide.events import Decided
from edge.decide.model import Model
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout


class Untouched:
    """Notes how near the frames before any contact come to one."""

    def __init__(self, model: Model, layout: SkinLayout) -> None:
        self._model = model
        self._layout = layout
        self._missing_taxels = False
        self._strongest = 0

    def push(self, frame: Frame) -> None:
        """Take in a frame."""
        readable = np.True_ if frame.valid is None else frame.valid
        strongest = int(frame.counts.max(initial=0, where=readable))
        self._strongest = max(self._strongest, strongest)
        self._missing_taxels |= bool((self._layout.alive & ~readable).any())

    def decisions(self, end_s: float, began: float) -> list[Decided]:
        """The answers of the tasks that have a label for no contact.

        Args:
            end_s: when the stream ended.
            began: when the question was asked, by `time.perf_counter`.
        """
        answers = []
        for name, task in self._model.info.tasks.items():
            if task.no_contact is not None:
                answer = Decided(
                    name,
                    task.no_contact,
                    confidence=1.0,
                    window_s=0.0,
                    onset_s=end_s,
                    latency_ms=round((time.perf_counter() - began) * 1e3, 3),
                    strongest=round(self._strongest / max(self._layout.onset, 1), 3),
                    model=self._model.named,
                ).flagged(
                    no_contact=True,
                    missing_taxels=self._missing_taxels,
                    near_contact=self._strongest > self._layout.threshold_counts,
                )
                answers.append(answer)
        return answers
