"""Decisions compared with labels: accuracy and confusion matrices as text."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from edge.classifier import AS_TRAINED
from edge.errors import printable
from edge.model.info import Task

NONE = "(none)"
"""The column of trials without a decision."""


class Summary:
    """Compares each recording's first decision for each task with its label."""

    def __init__(self, tasks: Mapping[str, Task]) -> None:
        self._tasks = tasks
        self._pairs: dict[str, Counter[tuple[str, str]]] = {task: Counter() for task in tasks}
        self.recordings = 0
        self.as_trained = 0
        """Recordings whose features equal those of a training trial."""

    def add(self, labels: Mapping[str, str], events: Iterable[Mapping[str, Any]]) -> None:
        """Take in the events of one recording and its labels."""
        self.recordings += 1
        first: dict[str, str] = {}
        as_trained = False
        for event in events:
            if event["event"] == "decision":
                first.setdefault(event["task"], printable(event["label"] or NONE))
                as_trained |= AS_TRAINED in event["flags"]
        self.as_trained += as_trained
        for task in self._tasks:
            if task in labels:
                self._pairs[task][printable(labels[task]), first.get(task, NONE)] += 1

    def accuracy(self, task: str) -> tuple[int, int]:
        """(right, labelled) recordings of a task."""
        pairs = self._pairs[task]
        return sum(n for (truth, said), n in pairs.items() if truth == said), pairs.total()

    def text(self) -> str:
        """One table per task: rows are what was touched, columns what was decided."""
        parts = [f"{self.recordings} recordings"]
        if self.as_trained:
            parts.append(
                f"{self.as_trained} of them have the coordinates of a training trial to the last "
                "bit and are most likely the same recordings, so this accuracy does not apply to "
                "new touches; the nested accuracy that `make export` printed does"
            )
        for task in self._tasks:
            right, total = self.accuracy(task)
            if total == 0:
                parts.append(f"{printable(task)}: no recording has a label")
                continue
            low, high = wilson(right, total)
            parts.append(
                f"{printable(task)}: {right} of {total} right, {right / total:.2%} "
                f"(95 % interval {low:.1%} to {high:.1%})\n" + self._matrix(task)
            )
        return "\n\n".join(parts)

    def _matrix(self, task: str) -> str:
        pairs = self._pairs[task]
        truths = sorted({truth for truth, _ in pairs})
        said = sorted({label for _, label in pairs} | set(truths))
        width = max(map(len, truths))
        # The columns of a wide matrix are numbered, so that 36 objects still fit on a screen.
        short = sum(len(label) + 2 for label in said) > 100
        heads = [str(i + 1) for i in range(len(said))] if short else said
        sizes = [max(len(head), 3) for head in heads]
        lines = [
            " " * (width + (5 if short else 0))
            + "".join(f"  {h:>{s}}" for h, s in zip(heads, sizes, strict=True))
        ]
        for truth in truths:
            number = f"{said.index(truth) + 1:>3}  " if short else ""
            cells = [str(pairs[truth, label] or ".") for label in said]
            lines.append(
                number
                + f"{truth:<{width}}"
                + "".join(f"  {c:>{s}}" for c, s in zip(cells, sizes, strict=True))
            )
        return "\n".join(lines)


def wilson(right: int, total: int, z: float = 1.959963984540054) -> tuple[float, float]:
    """Wilson's score interval of a proportion (95 % by default).

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212.
    """
    p, zz = right / total, z * z / total
    centre = (p + zz / 2) / (1 + zz)
    half = z / (1 + zz) * math.sqrt(p * (1 - p) / total + zz / (4 * total))
    return max(0.0, centre - half), min(1.0, centre + half)
