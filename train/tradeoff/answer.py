"""The sections on accuracy against time, with the command that exports each model."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from edge.arrays import Floats
from train.choose.evaluate import Result
from train.report.figures import picture
from train.report.score import majority, percent, shares
from train.report.section import Figure, ReportTable, Row, Section
from train.tradeoff.choices import WINDOWS_S, unseen
from train.tradeoff.measured import Measurements

TITLE_S = (0.6, 1.2)
"""Windows with their accuracy in a panel's title."""
PANEL = 3.6
"""Inches of a panel."""
ACROSS = 3
"""At most so many panels stand side by side."""
EARLY = (
    "--leave-out trial",
    f"--decision-points {WINDOWS_S[0]}:{WINDOWS_S[-1]}:0.1",
)
"""Options that export the model whose early decisions were measured."""


def answers(measurements: Measurements, task: str) -> list[Row]:
    """The rows of a task's table: fixed windows, early decisions, and guessing."""
    make = measurements.commands
    rows: list[Row] = []
    for window_s, choices in measurements.points.items():
        choice = choices[task]
        row: Row = {"decision": f"after {window_s:g} s", "time s": window_s}
        row |= shares(choice.by_trial) | _unseen(unseen(choice))
        row["command"] = f"`{make.export(f'--window {window_s:g}')}`"
        rows.append(row)
    for rule in measurements.certified[task]:
        row = {"decision": f"early, at most {rule.error:.0%} wrong"}
        row["time s"] = round(rule.mean_s, 3)
        mean = None if rule.unseen is None else float(rule.unseen.mean())
        row |= shares(rule.result) | _unseen(mean)
        row["command"] = f"`{make.export(*EARLY)}`, then `{make.run(rule.error)}`"
        rows.append(row)
    guess = {"decision": "always the most frequent label", "time s": 0.0}
    return [*rows, guess | shares(majority(measurements.y[task]))]


def _unseen(share: float | None) -> Row:
    """The column of the accuracy on unseen objects."""
    return {"unseen objects %": "" if share is None else percent(share)}


def section(measurements: Measurements) -> Section:
    """The accuracy of each task after each time, as tables and a picture."""
    return Section(
        "Accuracy after each time",
        tables=[
            ReportTable(f"answer_{t}", t, answers(measurements, t))
            for t in measurements.y
        ],
        figures=[picture_of(measurements)],
    )


def reasons(measurements: Measurements) -> Section:
    """What comes on top of the times, and the commands that export the models."""
    wire = "the time on the skin's wires, which the recordings do not name,"
    if measurements.wire_s is not None:
        wire = f"{1e3 * measurements.wire_s:.1f} ms on the wire"
    notes = [
        "The time of a decision is that of the touch itself, from first contact. On top "
        f"come {wire} and {1e3 * measurements.board.arithmetic_s:.2f} ms of arithmetic on "
        f"{measurements.board.name}."
    ]
    commands = measurements.commands
    windows = ", ".join(f"{window:g}" for window in measurements.points)
    kind = "quick choice" if commands.quick else "choice of `make export`"
    notes += [
        *measurements.notes,
        f"The accuracies after each time belong to the {kind}, made at windows of "
        f"{windows} s. To export one of the measured models, use `{commands.front('fast')}`, or "
        "`balanced` (a window of at most 0.9 s) or `accurate` in place of `fast`; `500` is "
        "the most accurate one within 500 ms, and `0.8` the fastest one that reaches "
        "80 %.",
        "Early decisions are made as soon as the model is sure enough for a requested "
        "error rate. Their mean times are those that the export of all contacts promises; "
        "rates that it does not certify have no row. Exports without a fifth of the "
        "contacts, or of the objects, decide these by its rules. A contact unlike all "
        "trained ones waits for the full window. An object that is unknown gets no name, "
        "which counts as wrong.",
        "The commands of early decisions play a recording; give `run` your `--skin` in "
        "place of `--fake` to decide live. `--error` refuses a rate that the trials "
        "cannot certify, and names the smallest that they can. Leave a margin above it.",
    ]
    return Section("Reasons and commands", notes)


GLOSSARY = {
    "accuracy": (
        "The share of held-out contacts that get the right label. A held-out contact "
        "takes no part in fitting the model, nor in choosing its features, projection "
        "and number of neighbours (nested cross-validation)."
    ),
    "from, to": (
        "The 95 % interval for the exported model's accuracy on other contacts. It is "
        "Wilson's binomial interval for two fifths of the contacts, because the "
        "exported model differs from those that were tested. `make risk` counts how "
        "often it holds."
    ),
    "points": (
        "The percentage of decisions that become right less the percentage that become "
        "wrong, on the same held-out contacts. The brackets hold the 95 % interval of "
        "this paired difference."
    ),
    "unseen objects": (
        "The accuracy if all trials of an object are held out together."
    ),
    "confidence": (
        "The calibrated probability that the label is right, if the object is one of "
        "those in training."
    ),
    "certified": (
        "An error rate is certified if an exact binomial test on calibration trials "
        "shows, with 90 % confidence, that decisions on contacts like the trained ones "
        "are wrong at most this often (learn-then-test)."
    ),
    "onset": "The first frame of a contact.",
    "window": "The time from onset that a decision is based on.",
    "wire": (
        "The time until the last frame has been read: on average half a frame's period "
        "until it begins, and its time on I2C."
    ),
    "arithmetic": (
        "The time to track the last frame, compute the features, and decide."
    ),
}


def picture_of(measurements: Measurements) -> Figure:
    """Accuracy against time in a panel for each task."""
    m = len(measurements.y)
    across = m if m <= ACROSS else -(-m // 2)
    down = -(-m // across)

    def draw(canvas: Any) -> None:
        grid = canvas.subplots(down, across, squeeze=False, sharey=True)
        for axes, task in zip(grid.flat, measurements.y, strict=False):
            _panel(axes, task, measurements)
        for axes in grid.flat[m:]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("decisions that are right, %")
        # Above the panels the legend hides nothing.
        series = [axes.get_legend_handles_labels() for axes in grid.flat]
        fullest = max(series, key=lambda handles: len(handles[0]))
        canvas.legend(*fullest, loc="outside upper center", ncols=3, frameon=False)

    title = "Accuracy against the time of the decision, for each task"
    width = max(PANEL * across, PANEL + 2.0)
    return picture("tradeoff", title, draw, 3.0 * down + 0.4, width)


def _panel(axes: Any, task: str, measurements: Measurements) -> None:
    """Draw a task's accuracy after fixed windows and with early decisions, which differ
    not by hue alone."""
    results = measurements.results(task)
    windows = list(results)
    chance = 100 * majority(measurements.y[task]).accuracy
    axes.axhline(
        chance, color="0.45", lw=1, ls=(0, (1, 2)), label="most frequent label"
    )
    share, (below, above) = _spread(list(results.values()))
    axes.fill_between(windows, share - below, share + above, alpha=0.12, lw=0)
    axes.plot(windows, share, "o-", ms=4, label="after a fixed time")
    rules = measurements.certified[task]
    if rules:
        times = [rule.mean_s for rule in rules]
        share, arms = _spread([rule.result for rule in rules])
        label = "early decision, mean time"
        axes.errorbar(times, share, arms, fmt="s--", ms=4, elinewidth=0.8, label=label)
    titles = [
        f"{100 * results[w].accuracy:.0f} % after {w:g} s"
        for w in TITLE_S
        if w in results
    ]
    axes.set(xlim=(0, max(results) + 0.08), ylim=(0, 103))
    axes.set(yticks=range(0, 101, 20), xlabel="seconds from first contact")
    axes.set_title(f"{task}: {', '.join(titles)}", fontsize="medium")


def _spread(results: Sequence[Result]) -> tuple[Floats, Floats]:
    """(n,) accuracies in percent, and (2, n) their distances to the ends of the
    intervals."""
    values = np.array([100 * result.accuracy for result in results])
    low, high = 100 * np.array([result.interval for result in results]).T
    return values, np.maximum([values - low, high - values], 0.0)
