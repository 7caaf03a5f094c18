"""The first screen: a line for each task, and a slider that sets the time of the
decision."""

import html
import json
from collections.abc import Mapping
from pathlib import Path
from string import Template

from train.choose import Chosen
from train.evaluate import Result
from train.report.score import interval
from train.tradeoff.choices import Points, unseen

FIRST_S = 1.0
"""The time shown at first; without a script, it stays."""
PAGE = Template(Path(__file__).with_suffix(".html").read_text(encoding="utf-8"))
LINE = Template(
    '<tr><td>$task</td><td class="share">$share</td><td class="interval">$interval</td>'
    '<td class="unseen">$unseen</td><td>$curve</td></tr>'
)


def slider(points: Points) -> str:
    """The HTML of the first screen.

    In a browser without scripts, it shows the accuracy after `FIRST_S`.
    """
    windows = list(points)
    first = min(range(len(windows)), key=lambda i: abs(windows[i] - FIRST_S))
    shown = {
        task: [_texts(tasks[task]) for tasks in points.values()]
        for task in points[windows[0]]
    }
    lines = [
        LINE.substitute(
            task=html.escape(task),
            curve=_curve(
                {w: tasks[task].by_trial for w, tasks in points.items()}, first
            ),
            **texts[first],
        )
        for task, texts in shown.items()
    ]
    data = json.dumps({"windows": windows, "tasks": list(shown.values())})
    return PAGE.substitute(
        answers=html.escape(data),
        first=first,
        last=len(windows) - 1,
        lines="".join(lines),
        wait=f"{windows[first]:g}",
    )


def _texts(choice: Chosen) -> dict[str, str]:
    """{class in the page: accuracy, its interval, or accuracy on objects never met, as
    text}."""
    unmet, result = unseen(choice), choice.by_trial
    return {
        "share": f"{100 * result.accuracy:.0f} %",
        "interval": f"({interval(result)})",
        "unseen": "" if unmet is None else f"{100 * unmet.accuracy:.0f} %",
    }


def _curve(results: Mapping[float, Result], first: int) -> str:
    """An SVG of a task's accuracy against time, with its interval and a line at the
    time shown."""
    x = [100 * window / max(results) for window in results]

    def points(heights: list[float], x: list[float] = x) -> str:
        return " ".join(
            f"{a:.1f},{100 - 100 * b:.1f}" for a, b in zip(x, heights, strict=True)
        )

    low, high = (
        list(ends) for ends in zip(*(r.interval for r in results.values()), strict=True)
    )
    return (
        '<svg viewBox="0 0 100 100" preserveAspectRatio="none" role="img" '
        'aria-label="accuracy, 0 to 100 %, against time">'
        f'<polygon points="{points(low)} {points(high[::-1], x[::-1])}"/>'
        f'<polyline points="{points([r.accuracy for r in results.values()])}"/>'
        f'<line x1="{x[first]:.1f}" x2="{x[first]:.1f}" y1="0" y2="100"/></svg>'
    )
