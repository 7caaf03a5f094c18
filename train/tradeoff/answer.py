"""The report's first section: how accurate a decision is after how long, and how to have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from edge.commands.summary import wilson
from train.evaluate import Labels
from train.report.tables import Figure, Section, Table
from train.tradeoff import plots
from train.tradeoff.board import Board
from train.tradeoff.early import FOLDS, StoppingComparison

SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the tables."""
SURE = (0.5, 0.7, 0.9)
"""Confidences of the tables at which waiting ends, where no error rate can be certified."""


@dataclass(frozen=True)
class Answer:
    """A way to decide one task, its time and its accuracy.

    Attributes:
        how: in words.
        seconds: from onset to decision; the mean where it varies.
        right: trials decided rightly.
        total: trials.
        command: that has it.
    """

    how: str
    seconds: float
    right: int
    total: int
    command: str

    @property
    def accuracy(self) -> float:
        """0 to 1."""
        return self.right / self.total

    @property
    def interval(self) -> tuple[float, float]:
        """95 % (Wilson)."""
        return wilson(self.right, self.total)


def answers(found: StoppingComparison, after_s: float) -> list[Answer]:
    """Fixed windows, then deciding when sure.

    Args:
        found: a task's held-out decisions.
        after_s: seconds from the end of the window to the decision: the wire and the arithmetic.
    """
    n = found.trials
    rows = []
    for window, right in zip(found.decision_points_s, found.right, strict=True):
        if window in SHOWN_S:
            command = f"make export EXPORT='--window {window:g}'"
            how = f"after {window:g} s"
            rows.append(Answer(how, window + after_s, int(right.sum()), n, command))
    able = [one for one in found.certified if one.folds > FOLDS // 2]
    for before, one in zip([None, *able], able, strict=False):
        if before is not None and (one.mean_s, one.wrong) == (before.mean_s, before.wrong):
            continue  # the same rule is certified for the smaller error
        command = f"edge-classify run --error {one.asked:g}"
        how = f"when sure, at most {100 * one.asked:g} % wrong"
        rows.append(Answer(how, one.mean_s + after_s, round((1 - one.wrong) * n), n, command))
    for threshold, seconds, wrong in [] if able else found.when_sure():
        if threshold in SURE:
            how = f"when {100 * threshold:.0f} % sure; no error rate is certified"
            rows.append(Answer(how, seconds + after_s, round((1 - wrong) * n), n, ""))
    return rows


def gain(found: StoppingComparison) -> tuple[float, float, float]:
    """(mean seconds, share wrong then, share wrong of a fixed window of that length): the most
    that deciding when sure gains between 0.4 s and 90 % of the full window."""
    points = np.array(found.decision_points_s)
    best = (float(points[-1]), float(found.fixed[-1]), float(found.fixed[-1]))
    for _, seconds, wrong in found.when_sure():
        fixed = float(np.interp(seconds, points, found.fixed))
        if 0.4 <= seconds <= 0.9 * points[-1] and fixed - wrong > best[2] - best[1]:
            best = seconds, wrong, fixed
    return best


def sentence(task: str, found: StoppingComparison, labels: Sequence[str]) -> str:
    """What a task's table says."""
    windows = [w for w in (0.2, 0.4, 1.0, 1.2) if w in found.decision_points_s]
    shares = [1.0 - found.fixed[found.decision_points_s.index(w)] for w in windows]
    fixed = ", ".join(f"{100 * a:.0f} % at {w:g} s" for w, a in zip(windows, shares, strict=True))
    _, counts = np.unique(labels, return_counts=True)
    guess, most = 100 / len(counts), 100 * counts.max() / counts.sum()
    seconds, wrong, beside = gain(found)
    error = float(np.sqrt((wrong * (1 - wrong) + beside * (1 - beside)) / found.trials))
    # The best of many thresholds is ahead by one standard error by luck alone.
    if beside - wrong > 2 * error:
        early = (
            f"Deciding when sure: {100 * (1 - wrong):.0f} % at {seconds:.2f} s on average, where a "
            f"fixed window as long gives {100 * (1 - beside):.0f} %."
        )
    else:
        early = (
            "Deciding when sure gains nothing that is beyond chance over a fixed window here: take "
            "the window."
        )
    return (
        f"{task}: {fixed}. {early} Guessing is right {guess:.0f} % of the time, always naming the "
        f"most frequent label {most:.0f} %."
    )


def section(
    both: Mapping[str, StoppingComparison],
    y: Labels,
    wire_s: float,
    board: Board,
    features: int,
) -> Section:
    """The answer, task by task, and the picture.

    Args:
        both: held-out decisions of each task.
        y: its labels.
        wire_s: from the end of the window until its last frame is read.
        board: whose arithmetic it is.
        features: feature types measured.
    """
    arithmetic_s = board.arithmetic_s(features)
    tables = []
    for task, found in both.items():
        table = Table(
            f"answer_{task}",
            task,
            ("time s", "accuracy %", "95 % interval", "how", "command"),
            narrow=4,
        )
        for one in answers(found, wire_s + arithmetic_s):
            low, high = one.interval
            table.rows.append(
                (
                    round(one.seconds, 3),
                    round(100 * one.accuracy, 1),
                    f"{100 * low:.0f} to {100 * high:.0f}",
                    one.how,
                    f"`{one.command}`" if one.command else "",
                )
            )
        tables.append(table)
    text = [sentence(task, found, y[task].tolist()) for task, found in both.items()]
    wide, narrow = (plots.answer(both, y, wire_s, arithmetic_s, phone=p) for p in (False, True))
    title = "Accuracy against time to decision, a panel a task; below, where the time goes"
    return Section("The answer", text, tables, [Figure("tradeoff", title, wide, narrow)])


def reasons(wire_s: float, board: Board, features: int, breakaways: Mapping[str, float]) -> Section:
    """Where the time goes, what is waited for, and how to have each answer.

    Args:
        wire_s, board, features: as for `section`.
        breakaways: {object: seconds} before which a movable object stands still.
    """
    arithmetic_s = board.arithmetic_s(features)
    notes = []
    notes.append(
        f"Of the time, waiting is nearly all: the last frame's way over the wire takes "
        f"{1e3 * wire_s:.1f} ms, and all arithmetic of a decision {1e3 * arithmetic_s:.2f} ms on "
        f"{board.name}."
    )
    if breakaways:
        slow = sorted(breakaways.values())
        notes.append(
            "What is waited for is mostly physics: an object that can move stands still, and so "
            "looks like one that cannot, until the arm pushes harder than friction holds. In this "
            f"scene that takes {slow[0]:.2f} to {slow[-1]:.2f} s from onset, by object."
        )
    notes.append(
        "Ready-made: `make export FRONT=fast`, `FRONT=balanced` or `FRONT=accurate` takes a "
        "window, features and scaling from the best settings below; `FRONT=500` the most accurate "
        "one within 500 ms, `FRONT=0.8` the fastest one that reaches 80 %. `edge-classify run "
        "--error 0.1` decides as soon as it is sure, so that at most one decision in ten is wrong; "
        "what the trials cannot certify is refused, with the smallest error that they can."
    )
    return Section("Why, and how to have it", notes)


GLOSSARY = {
    "accuracy": "The share of held-out contacts whose label is named rightly. Held out means that "
    "the contact took no part in fitting the model, nor in choosing its features, projection or "
    "number of neighbours (nested cross-validation).",
    "95 % interval": "Wilson's, for a share of so many trials.",
    "confidence": "The calibrated probability that the label named is right.",
    "certified": "Shown by the exact binomial test on calibration trials, with 90 % confidence: "
    "decisions of contacts like the trained ones are wrong at most so often (learn-then-test).",
    "onset": "The first frame of a contact.",
    "window": "The time from onset that a decision looks at.",
    "wire": "On average half a frame's period until the next frame, and that frame's way over I2C.",
    "arithmetic": "Tracking the last frame, computing the features, and the decision.",
    "scaling": "none, or Methods I to V of the paper's Eqs. 1 to 5.",
    "components, k": "Coordinates that the projection keeps, and neighbours that vote.",
    "front": "The settings that no other beats in both time and accuracy.",
    "the paper": "Bhattacharjee, Rehg and Kemp, Haptic classification and recognition of objects "
    "using a tactile sensing forearm, IROS 2012. Its setting: all taxels, three features, no "
    "scaling, 1.2 s.",
    "breakaway": "mu_s m g / (k v): when the arm's spring, tightened at its speed v, overcomes "
    "static friction (or tips what is narrow and high).",
}


def glossary() -> Section:
    """Words that the report could not do without."""
    return Section("Words", terms=GLOSSARY)
