"""The first screen: the time and the accuracy of each task, each by a slider of the
other."""

import html
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

from train.choose.evaluate import Result
from train.choose.settings import Chosen
from train.report.score import interval
from train.tradeoff.choices import unseen
from train.tradeoff.early import soonest
from train.tradeoff.front import NAMES, ParetoFront
from train.tradeoff.measured import Measured
from train.tradeoff.uses import Use, cheapest, early, fixed

FIRST_S = 1.0
"""The time shown at first; without a script, it stays."""
LEVELS = (60, 70, 75, 80, 85, 90, 92, 95, 97, 99)
"""Accuracies in percent of the second slider."""
FIRST_LEVEL = 90
PAGE = Template(Path(__file__).with_suffix(".html").read_text(encoding="utf-8"))
LINE = Template(
    '<tr><td>$task</td><td class="share">$share</td><td class="interval">$interval</td>'
    '<td class="unseen">$unseen</td><td>$curve</td></tr>'
)


def slider(measured: Measured) -> str:
    """The HTML of the first screen.

    In a browser without scripts, it shows the accuracy after `FIRST_S` and the times of
    `FIRST_LEVEL`.
    """
    points = measured.points
    windows = list(points)
    first = min(range(len(windows)), key=lambda i: abs(windows[i] - FIRST_S))
    content = {
        task: [_texts(tasks[task]) for tasks in points.values()]
        for task in points[windows[0]]
    }
    lines = [
        LINE.substitute(
            task=html.escape(task),
            curve=_curve(measured.results(task), first),
            **texts[first],
        )
        for task, texts in content.items()
    ]
    levels = [reached(measured, level / 100.0) for level in LEVELS]
    commands = [measured.commands.export(f"--window {window:g}") for window in windows]
    data = json.dumps(
        {
            "windows": windows,
            "tasks": list(content.values()),
            "names": list(content),
            "commands": commands,
            "levels": LEVELS,
            "reached": levels,
        }
    )
    at = LEVELS.index(FIRST_LEVEL)
    return PAGE.substitute(
        answers=html.escape(data),
        first=first,
        last=len(windows) - 1,
        lines="".join(lines),
        wait=f"{windows[first]:g}",
        longest=f"{windows[-1]:g}",
        command=html.escape(commands[first]),
        first_level=at,
        last_level=len(LEVELS) - 1,
        level=FIRST_LEVEL,
        reached=levels[at],
        fronts=fronts(measured),
    )


def reached(measured: Measured, level: float) -> str:
    """Rows of a table: the soonest decisions of each task that reach an accuracy,
    early and after a fixed time, with their commands."""
    rows = ""
    for task in measured.y:
        rule = soonest(measured.certified[task], level)
        if rule is not None:
            use = early(measured, rule)
            time = f"after {use.seconds:.2f} s on average, early"
            rows += _row(task, f"{time}: {_accuracy(use)}", use.commands)
        results = measured.results(task)
        able = [window for window in results if results[window].accuracy >= level]
        if able:
            use = fixed(measured, task, min(able))
            answer = f"after {min(able):g} s, fixed: {_accuracy(use)}"
            rows += _row(task, answer, use.commands)
        elif rule is None:
            rows += _row(task, "never", ())
    return rows


def _row(name: str, answer: str, commands: Sequence[str]) -> str:
    """A row of a table, whose last cell has the commands that make the answer."""
    codes = [f"<code>{html.escape(command)}</code>" for command in commands]
    cells = (html.escape(name), html.escape(answer), ", then ".join(codes))
    return f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _accuracy(use: Use) -> str:
    """An accuracy with its interval, and that on unseen objects, in whole percent."""
    text = f"{100 * use.result.accuracy:.0f} % ({interval(use.result)})"
    if use.unseen is not None:
        text += f", {100 * use.unseen:.0f} % of unseen objects"
    return text


def fronts(measured: Measured) -> str:
    """Rows of a table for the main task: what the names of `FRONT=` give, and the
    cheapest use."""
    task = next(iter(measured.y))
    front = ParetoFront.of(measured.points, task)
    rows = ""
    for name in NAMES:
        use = fixed(measured, task, front.pick(name).window_s)
        text = f"{task}: {use.name}: {_accuracy(use)}"
        rows += _row(name, text, (measured.commands.front(name),))
    best = cheapest(measured, task)
    text = (
        f"{task}: after {best.seconds:.2f} s: {_accuracy(best)}, where a wrong "
        f"decision costs {measured.wrong:g} and a second of waiting {measured.second:g}"
    )
    return rows + _row("cheapest", text, best.commands)


def _texts(choice: Chosen) -> dict[str, str]:
    """{class in the page: accuracy, its interval, or accuracy on unseen objects, as
    text}."""
    share = unseen(choice)
    result = choice.by_trial
    return {
        "share": f"{100 * result.accuracy:.0f} %",
        "interval": f"({interval(result)})",
        "unseen": "" if share is None else f"{100 * share:.0f} %",
    }


def _curve(results: Mapping[float, Result], first: int) -> str:
    """An SVG of a task's accuracy against time, with its interval, lines at every
    quarter and one at the time shown."""
    x = [100 * window / max(results) for window in results]

    def points(heights: list[float], x: list[float] = x) -> str:
        return " ".join(
            f"{a:.1f},{100 - 100 * b:.1f}" for a, b in zip(x, heights, strict=True)
        )

    low, high = (
        list(ends) for ends in zip(*(r.interval for r in results.values()), strict=True)
    )
    scale = "".join(
        f'<path class="scale" d="M0 {height}H100"/>' for height in (0, 25, 50, 75, 100)
    )
    return (
        '<svg viewBox="0 0 100 100" preserveAspectRatio="none" role="img" '
        'aria-label="accuracy, 0 to 100 %, against time">'
        f"{scale}"
        f'<polygon points="{points(low)} {points(high[::-1], x[::-1])}"/>'
        f'<polyline points="{points([r.accuracy for r in results.values()])}"/>'
        f'<line x1="{x[first]:.1f}" x2="{x[first]:.1f}" y1="0" y2="100"/></svg>'
    )
