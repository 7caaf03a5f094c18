"""The report's first section: how accurate a decision is after how long, and how to have it."""

from __future__ import annotations

from typing import Any

from train.evaluate import Result
from train.report.figures import HATCHES, PHONE, STROKES, curve, legend, picture, spread
from train.report.score import majority, percent, points, score
from train.report.section import Figure, Row, Section, Table
from train.stopping import finest
from train.tradeoff.choices import WINDOWS_S, unseen
from train.tradeoff.early import FOLDS, Certified, StoppingComparison
from train.tradeoff.measured import Measured
from train.tradeoff.slider import slider

SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the tables."""
TITLED_S = (0.4, 1.2)
"""Windows whose accuracy stands above a panel."""
ACROSS = 3
"""Most panels beside each other."""
EARLY = f"make export EXPORT='--quick --decision-points {WINDOWS_S[0]}:{WINDOWS_S[-1]}:0.1'"
"""The command that exports the model that decides early."""


def answers(measured: Measured, task: str) -> list[Row]:
    """The rows of a task's table: fixed windows, early decisions, and guessing."""

    def row(
        how: str, seconds: float, result: Result, unmet: Result | None = None, command: str = ""
    ) -> Row:
        cells = {"how": how, "time s": round(seconds, 3), "accuracy %": 0.0}
        cells["objects never met %"] = "" if unmet is None else percent(unmet.accuracy)
        cells |= {key: score(result)[key] for key in ("accuracy %", "from %", "to %")}
        return cells | {"command": command}

    after_s = measured.after_s
    rows = [
        row(f"after {window:g} s", window + after_s, tasks[task].by_trial, unseen(tasks[task]),
            f"`make export EXPORT='--quick --window {window:g}'`")
        for window, tasks in measured.points.items()
        if window in SHOWN_S
    ]  # fmt: skip
    for rule in distinct(measured.comparisons[task]):
        how = f"at most {100 * rule.asked:g} % wrong"
        command = f"`{EARLY}`, then `edge-classify run --error {rule.asked:g}`"
        rows.append(row(how, rule.mean_s + after_s, rule.result, command=command))
    return [*rows, row("most frequent label", 0.0, majority(measured.y[task]))]


def distinct(compared: StoppingComparison) -> list[Certified]:
    """The errors that most folds certify; a rule that serves two errors stands at the smaller."""
    able = [certified for certified in compared.certified if certified.folds > FOLDS // 2]
    return list({(rule.mean_s, rule.wrong): rule for rule in reversed(able)}.values())[::-1]


def section(measured: Measured) -> Section:
    """The answer for each task, and the picture."""
    return Section(
        "The answer",
        tables=[Table(f"answer_{t}", t, answers(measured, t), narrow=6) for t in measured.y],
        figures=[drawn(measured)],
        widget=slider(measured.points),
    )


def early(measured: Measured) -> Section:
    """Deciding early in every task, beside waiting for the full window."""
    board, count = measured.board, len(measured.points)
    decision_us = sum(board.stages_us[stage][0] for stage in ("features", "decision"))
    rows: list[Row] = [
        {
            "task": task,
            "asked error %": percent(rule.asked),
            "right %": percent(1.0 - rule.wrong),
            "mean time s": round(rule.mean_s, 3),
            "points beside waiting": points(rule.gain),
            "names nothing %": percent(rule.unknown),
            "decided early %": percent(rule.early),
            "certified in folds": f"{rule.folds} of {FOLDS}",
            "contacts": len(rule.right),
        }
        for task, compared in measured.comparisons.items()
        for rule in compared.certified
        if rule.folds
    ]
    off = (f"{t} {100 * c.calibration_error:.1f}" for t, c in measured.comparisons.items())
    return Section(
        "As soon as it is sure",
        [
            f"Each of {FOLDS} folds is held out once; the others choose, train and calibrate. An "
            "error rate is certified where the calibration trials show, with 90 % confidence, that "
            "decisions are wrong at most this often. A contact unlike all trained ones waits for "
            f"the full window. No {finest(measured.y)} is named for it, which counts as wrong. "
            "Rates that no fold certifies have no row. Some rates are certified in some folds "
            "only, so their rows are of fewer contacts.",
            f"Each decision point is one run of the same graph, {decision_us:.0f} us of features "
            f"and decision on {board.name}. All {count} together take "
            f"{1e-3 * count * decision_us:.1f} ms of arithmetic for a contact, while the program "
            "waits anyway.",
            f"Confidences differ from the share that is right by so many points on average: "
            f"{', '.join(off)}.",
        ],
        [Table("early", "Asked for an error rate", rows, narrow=4)],
    )


def prices(measured: Measured) -> Section:
    """The window that costs least, by the price of a wrong decision and of a second's wait."""
    rows: list[Row] = []
    for task in measured.y:
        paid = {
            window: measured.wrong * (1.0 - result.accuracy)
            + measured.second * (window + measured.after_s)
            for window, result in measured.results(task).items()
        }
        best = min(paid, key=paid.__getitem__)
        rows.append(
            {"task": task, "best window s": best, "mean price": round(paid[best], 2)}
            | {"command": f"`make export EXPORT='--quick --window {best:g}'`"}
        )
    return Section(
        "The price of a wrong decision",
        [
            f"A wrong decision costs {measured.wrong:g} here, and a second {measured.second:g}. "
            'Your own prices give other windows: `make tradeoff TRADEOFF="--cost '
            'wrong=10,second=1"`. The best of several windows looks a little better than it is.'
        ],
        [Table("price", "The window at which a decision costs least on average", rows)],
    )


def reasons(measured: Measured) -> Section:
    """Where the time goes, the physics behind it, and the commands."""
    notes = [
        f"Nearly all of the time is waiting. The last frame takes {1e3 * measured.wire_s:.1f} ms "
        f"over the wire, and the arithmetic of a decision {1e3 * measured.board.arithmetic_s:.2f} "
        f"ms on {measured.board.name}."
    ]
    slow = sorted(measured.breakaways.items(), key=lambda item: -item[1])
    if slow:
        notes.append(
            "Physics sets the wait: until the arm pushes harder than friction holds, an object "
            "that can move stands still and looks like one that cannot. The table gives that time, "
            "mu_s m g / (k v), at the middle of each object's friction and mass."
        )
    notes += [
        "Every accuracy is that of the quick choice, `make export EXPORT=--quick`, made again at "
        "each window. `make export FRONT=fast`, `FRONT=balanced` (a window of at most 0.9 s) or "
        "`FRONT=accurate` exports the very model whose accuracy stands here, `FRONT=500` the most "
        "accurate one within 500 ms, and `FRONT=0.8` the fastest one that reaches 80 %.",
        f"Early decisions are those of `{EARLY}`. With it `edge-classify run --error 0.1` decides "
        "as soon as it is sure that at most one decision in ten is wrong. It refuses an error rate "
        "that the trials cannot certify, and names the smallest one that they can. Leave a margin "
        "above that. Early decisions were not measured on objects never met.",
    ]
    rows: list[Row] = [{"object": name, "time until it moves s": round(at, 2)} for name, at in slow]
    table = Table("breakaway", "When each object that can move does", rows)
    return Section("Why, and how to have it", notes, [table])


def glossary(measured: Measured) -> Section:
    """The words of the report."""
    return Section("Words", terms=GLOSSARY)


GLOSSARY = {
    "accuracy": "The share of held-out contacts whose label is right. A held-out contact took no "
    "part in fitting the model, nor in choosing its features, projection or number of neighbours "
    "(nested cross-validation).",
    "from, to": "The 95 % interval of the exported model's accuracy on other contacts: Wilson's "
    "binomial interval of half as many contacts, as that model differs from those of the folds. "
    "`make risk` counts how often it holds. For early decisions it counts the contacts of those "
    "folds alone that certified the error rate.",
    "points": "Percents of the decisions that become right, less those that become wrong, on the "
    "same held-out contacts. In brackets stands the 95 % interval of this paired difference.",
    "objects never met": "Accuracy where all trials of an object are held out together.",
    "confidence": "The calibrated probability that the label is right.",
    "certified": "Shown by the exact binomial test on calibration trials, with 90 % confidence: "
    "decisions on contacts like the trained ones are wrong at most this often (learn-then-test).",
    "onset": "The first frame of a contact.",
    "window": "The time from onset that a decision looks at.",
    "wire": "On average half a frame's period until the next frame, and that frame's time on I2C.",
    "arithmetic": "Tracking the last frame, computing the features, and deciding.",
}


def drawn(measured: Measured) -> Figure:
    """Accuracy against time, a panel a task; below, where the time goes."""
    compared, m = measured.comparisons, len(measured.comparisons)
    wide = m if m <= ACROSS else -(-m // 2)
    heights = 3.0 * -(-m // wide) + 2.2, 2.6 * m + 2.2

    def draw(canvas: Any, phone: bool) -> None:
        across = 1 if phone else wide
        upper, lower = canvas.subfigures(2, 1, height_ratios=[heights[phone] - 1.8, 1.8])
        grid = upper.subplots(-(-m // across), across, squeeze=False, sharey=True)
        for axes, (task, comparison) in zip(grid.flat, compared.items(), strict=False):
            _panel(axes, task, comparison, measured)
        for axes in grid.flat[m:]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("decisions that are right, %")
        fullest = max(grid.flat, key=lambda axes: len(axes.get_legend_handles_labels()[0]))
        legend(upper, fullest, 2 if phone else 3)
        _split(lower, measured)

    title = "Accuracy against time to decision, a panel a task; below, where the time goes"
    return picture("tradeoff", title, draw, heights, max(PHONE * wide, PHONE + 2.0))


def _panel(axes: Any, task: str, compared: StoppingComparison, measured: Measured) -> None:
    """Draw a task's accuracy after fixed windows, and as soon as it is sure."""
    results, after_s = measured.results(task), measured.after_s
    chance = 100 * majority(measured.y[task]).accuracy
    axes.axhline(chance, color="0.45", lw=1, ls=(0, (1, 2)), label="most frequent label")
    curve(axes, 0, "after a fixed time", [w + after_s for w in results], list(results.values()))
    colour, marker, dashes = STROKES[1]
    rules = distinct(compared)
    if rules:
        share, arms = spread([rule.result for rule in rules])
        axes.errorbar(
            [rule.mean_s + after_s for rule in rules], share, arms, color=colour, marker=marker,
            ls=dashes, ms=4, elinewidth=0.8, label="as soon as sure (mean time)",
        )  # fmt: skip
    named = [f"{100 * results[w].accuracy:.0f} % after {w:g} s" for w in TITLED_S if w in results]
    axes.set(xlim=(0, compared.decision_points_s[-1] + 0.08), ylim=(0, 103))
    axes.set(yticks=range(0, 101, 20), xlabel="seconds from first contact")
    axes.set_title(f"{task}: {', '.join(named)}", fontsize="medium")


def _split(figure: Any, measured: Measured) -> None:
    """Draw the time of a decision after the full window, and its end magnified."""
    window, after_ms = max(measured.points), 1e3 * measured.after_s
    wire_ms, arithmetic_ms = 1e3 * measured.wire_s, 1e3 * measured.board.arithmetic_s
    stages = [
        (f"wait {window:g} s", 1e3 * window),
        (f"wire {wire_ms:.0f} ms", wire_ms),
        (f"arithmetic {arithmetic_ms:.1f} ms", arithmetic_ms),
    ]
    rows = figure.subplots(2, 1)
    start = 1e3 * window - 0.25 * after_ms
    ends = (0.0, 1e3 * window + after_ms), (start, 1e3 * window + 1.02 * after_ms)
    for axes, limits in zip(rows, ends, strict=True):
        left = 0.0
        for (name, length), (colour, *_), hatch in zip(stages, STROKES, HATCHES, strict=False):
            axes.barh(0, length, left=left, color=colour, hatch=hatch, ec="white", lw=0, label=name)
            left += length
        axes.set(xlim=limits, yticks=[])
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
        axes.locator_params("x", nbins=7)
    rows[0].axvline(start, color="0.2", lw=0.8)
    rows[1].set_xlabel(f"milliseconds; below, the last {ends[1][1] - start:.0f} magnified")
    legend(figure, rows[0], 3)
