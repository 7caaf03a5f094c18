"""The sections on accuracy against time, with the command that exports each model."""

from typing import Any

from train.data.folds import finest
from train.report.figures import HATCHES, PHONE, STROKES, curve, legend, picture, spread
from train.report.score import majority, percent, points, shares
from train.report.section import Figure, Row, Section, Table
from train.tradeoff.choices import unseen
from train.tradeoff.early import FOLDS, StoppingComparison
from train.tradeoff.measured import Measured
from train.tradeoff.slider import slider
from train.tradeoff.uses import EARLY, cheapest, uses

TITLE_S = (0.6, 1.2)
"""Windows with their accuracy in a panel's title."""
ACROSS = 3
"""At most so many panels stand side by side."""


def answers(measured: Measured, task: str) -> list[Row]:
    """The rows of a task's table: fixed windows, early decisions, and guessing."""
    rows: list[Row] = []
    for use in uses(measured, task):
        row: Row = {"decision": use.name, "time s": round(use.seconds, 3)}
        row |= shares(use.result)
        window = use.window_s
        if window is not None:
            unseen_result = unseen(measured.points[window][task])
            row["unseen objects %"] = (
                "" if unseen_result is None else percent(unseen_result.accuracy)
            )
        row["command"] = ", then ".join(f"`{command}`" for command in use.commands)
        rows.append(row)
    guess = {"decision": "always the most frequent label", "time s": 0.0}
    return [*rows, guess | shares(majority(measured.y[task]))]


def section(measured: Measured) -> Section:
    """The accuracy of each task after each time, as tables, a picture and a slider."""
    return Section(
        "Accuracy after each time",
        tables=[
            Table(f"answer_{t}", t, answers(measured, t), narrow=6) for t in measured.y
        ],
        figures=[picture_of(measured)],
        widget=slider(measured),
    )


def early(measured: Measured) -> Section:
    """Early decisions of each task, compared with waiting for the full window."""
    board = measured.board
    count = len(measured.points)
    decision_us = sum(board.stages_us[stage][0] for stage in ("features", "decision"))
    rows: list[Row] = [
        {
            "task": task,
            "requested error %": percent(rule.error),
            "right %": percent(rule.result.accuracy),
            "mean time s": round(rule.mean_s, 3),
            "at most s": round(rule.latest_s, 3),
            "points over waiting": points(rule.gain),
            "no label %": percent(rule.unknown),
        }
        for task, compared in measured.comparisons.items()
        for rule in compared.certified
    ]
    gaps = [
        f"{task} {100 * compared.calibration_error:.1f}"
        for task, compared in measured.comparisons.items()
    ]
    return Section(
        "Early decisions",
        [
            "With a requested error rate, the model decides as soon as it is sure "
            f"enough. Each of {FOLDS} folds tests this once, with a model that was "
            "chosen, trained and calibrated on the other folds. Error rates that no "
            "fold certifies have no row; those that only some folds certify are "
            "tested on fewer contacts.",
            "A contact unlike all trained ones waits for the full window. It gets no "
            f"label of the task {finest(measured.y)}, which counts as wrong.",
            "The model runs once at each decision point, which takes "
            f"{decision_us:.0f} us of features and decision on {board.name}. All "
            f"{count} decision points together take {1e-3 * count * decision_us:.1f} "
            "ms for a contact, while the program waits for the contact to unfold.",
            "The confidence differs from the share of right decisions by this many "
            f"percentage points on average: {', '.join(gaps)}.",
        ],
        [Table("early", "Decisions with a requested error rate", rows, narrow=4)],
    )


def prices(measured: Measured) -> Section:
    """The cheapest use, by the price of a wrong decision and of waiting for a
    second."""
    rows: list[Row] = []
    for task in measured.y:
        best = cheapest(measured, task)
        low, high = best.result.interval
        mean = round(best.price(best.result.accuracy, measured), 2)
        lowest = round(best.price(high, measured), 2)
        highest = round(best.price(low, measured), 2)
        row: Row = {"task": task, "best use": best.name, "mean price": mean}
        row["95 % interval"] = f"{lowest:g} to {highest:g}"
        row["command"] = f"`{', then '.join(best.commands)}`"
        rows.append(row)
    command = measured.commands.tradeoff("--cost wrong=10,second=1")
    return Section(
        "The price of a wrong decision",
        [
            "Waiting makes errors rarer, and costs time. In this table a wrong "
            f"decision costs {measured.wrong:g}, and waiting for a second costs "
            f"{measured.second:g}. Give your own prices with `{command}`. The best of "
            "several uses looks a little better than it is, because chance helped to "
            "choose it."
        ],
        [Table("price", "The use with the lowest mean price of a decision", rows)],
    )


def reasons(measured: Measured) -> Section:
    """What the time is spent on, and the commands that export the models."""
    wire = "The recordings do not name the skin's wires, whose time is ignored. The"
    if measured.wire_s is not None:
        wire = f"The last frame takes {1e3 * measured.wire_s:.1f} ms over the wire. The"
    notes = [
        "Nearly all of the time is spent waiting for the contact to unfold. "
        f"{wire} arithmetic of a decision takes "
        f"{1e3 * measured.board.arithmetic_s:.2f} ms on {measured.board.name}."
    ]
    commands = measured.commands
    windows = ", ".join(f"{window:g}" for window in measured.points)
    kind = "quick choice" if commands.quick else "choice of `make export`"
    notes += [
        *measured.notes,
        f"All accuracies belong to the {kind}, made at windows of "
        f"{windows} s. Windows between two of these were not measured, as the accuracies "
        f"of {next(iter(measured.y))} there do not differ by more than chance. "
        "To export one of "
        f"the measured models, use `{commands.front('fast')}`, or `balanced` (a window "
        "of at most 0.9 s) or `accurate` in place of `fast`; `500` is the most accurate "
        "one within 500 ms, and `0.8` the fastest one that reaches 80 %.",
        f"For early decisions, export a model with `{commands.export(*EARLY)}`. With "
        "this model, `edge-classify run --error 0.1` decides as soon as it may while at "
        "most one decision in ten is wrong. It refuses an error rate that the trials "
        "cannot certify, and names the smallest rate that they can. Leave a margin "
        "above that rate. Early decisions were not measured on unseen objects.",
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
        "often it holds. Early decisions and fixed windows have the same contacts. A "
        "mean time has the normal interval's upper end, as the exported model is sure "
        "sooner than those that were tested."
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
        "The calibrated probability that the label is right, if the thing is one of "
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


def picture_of(measured: Measured) -> Figure:
    """Accuracy against time in a panel for each task, and the parts of the time."""
    compared = measured.comparisons
    m = len(compared)
    wide = m if m <= ACROSS else -(-m // 2)
    heights = 3.0 * -(-m // wide) + 2.2, 2.6 * m + 2.2

    def draw(canvas: Any, phone: bool) -> None:
        across = 1 if phone else wide
        upper, lower = canvas.subfigures(
            2,
            1,
            height_ratios=[heights[phone] - 1.8, 1.8],
        )
        grid = upper.subplots(-(-m // across), across, squeeze=False, sharey=True)
        for axes, (task, comparison) in zip(grid.flat, compared.items(), strict=False):
            _panel(axes, task, comparison, measured)
        for axes in grid.flat[m:]:
            axes.set_visible(False)
        for axes in grid[:, 0]:
            axes.set_ylabel("decisions that are right, %")
        fullest = max(
            grid.flat, key=lambda axes: len(axes.get_legend_handles_labels()[0])
        )
        legend(upper, fullest, 2 if phone else 3)
        _split(lower, measured)

    title = (
        "Accuracy against the time of the decision, for each task; below, the parts of "
        "the time"
    )
    return picture("tradeoff", title, draw, heights, max(PHONE * wide, PHONE + 2.0))


def _panel(
    axes: Any,
    task: str,
    compared: StoppingComparison,
    measured: Measured,
) -> None:
    """Draw a task's accuracy after fixed windows and with early decisions."""
    results = measured.results(task)
    after_s = measured.after_s
    chance = 100 * majority(measured.y[task]).accuracy
    axes.axhline(
        chance,
        color="0.45",
        lw=1,
        ls=(0, (1, 2)),
        label="most frequent label",
    )
    times = [window + after_s for window in results]
    curve(axes, 0, "after a fixed time", times, list(results.values()))
    colour, marker, dashes = STROKES[1]
    rules = compared.certified
    if rules:
        share, arms = spread([rule.result for rule in rules])
        axes.errorbar(
            [rule.mean_s + after_s for rule in rules],
            share,
            arms,
            color=colour,
            marker=marker,
            ls=dashes,
            ms=4,
            elinewidth=0.8,
            label="early decision, mean time",
        )
    named = [
        f"{100 * results[w].accuracy:.0f} % after {w:g} s"
        for w in TITLE_S
        if w in results
    ]
    axes.set(xlim=(0, compared.decision_points_s[-1] + 0.08), ylim=(0, 103))
    axes.set(yticks=range(0, 101, 20), xlabel="seconds from first contact")
    axes.set_title(f"{task}: {', '.join(named)}", fontsize="medium")


def _split(figure: Any, measured: Measured) -> None:
    """Draw the parts of the time until a decision after the full window, and the end
    magnified."""
    window = max(measured.points)
    after_ms = 1e3 * measured.after_s
    arithmetic_ms = 1e3 * measured.board.arithmetic_s
    stages = [(f"wait {window:g} s", 1e3 * window)]
    if measured.wire_s is not None:
        wire_ms = 1e3 * measured.wire_s
        stages.append((f"wire {wire_ms:.0f} ms", wire_ms))
    stages.append((f"arithmetic {arithmetic_ms:.1f} ms", arithmetic_ms))
    whole, magnified = figure.subplots(2, 1)
    for axes in (whole, magnified):
        offset = 0.0
        for i, (name, length) in enumerate(stages):
            style = {
                "color": STROKES[i][0],
                "hatch": HATCHES[i],
                "ec": "white",
                "lw": 0,
            }
            axes.barh(0, length, left=offset, **style, label=name)
            offset += length
        axes.set_yticks([])
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
        axes.locator_params("x", nbins=5)
    start = 1e3 * window - 0.25 * after_ms
    end = 1e3 * window + 1.02 * after_ms
    whole.set_xlim(0.0, 1e3 * window + after_ms)
    whole.axvline(start, color="0.2", lw=0.8)
    magnified.set_xlim(start, end)
    magnified.set_xlabel(f"milliseconds; below, the last {end - start:.0f} magnified")
    legend(figure, whole, 3)
