"""The first screen: one line a task, and a slider that moves the time of the decision."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping

from train.choose import Chosen
from train.evaluate import Result
from train.report.score import interval
from train.tradeoff.choices import Points, unseen

FIRST_S = 1.0
"""The time that is shown first, and without a script."""
STYLE = """<style>
.slider { max-width: 52rem; } .slider input { width: 100%; } .slider td { white-space: nowrap; }
.slider table { font-size: 15px; width: 100%; } .slider svg { width: 100%; height: 3rem;
  overflow: visible; }
.slider td:last-child { width: 55%; } .slider .share { font-weight: 600; }
.slider polyline { fill: none; stroke: #1f5fa8; stroke-width: 2;
  vector-effect: non-scaling-stroke; }
.slider polygon { fill: #1f5fa8; opacity: .18; } .slider line { stroke: var(--ink);
  stroke-width: 2; vector-effect: non-scaling-stroke; }
@media (prefers-color-scheme: dark) { .slider polyline { stroke: #8ab8f0; }
  .slider polygon { fill: #8ab8f0; } }
</style>"""
HEADINGS = ("task", "right", "95 %", "never met", "against time")
SCRIPT = """<script>
const box = document.querySelector('.slider'), data = JSON.parse(box.dataset.answers);
const input = box.querySelector('input');
function show() {
  const at = +input.value, wait = data.windows[at];
  box.querySelectorAll('.wait').forEach(e => e.textContent = wait);
  data.tasks.forEach((rows, i) => {
    const row = box.querySelectorAll('tbody tr')[i], x = 100 * wait / data.windows.at(-1);
    row.querySelector('.share').textContent = rows[at][0];
    row.querySelector('.interval').textContent = rows[at][1];
    row.querySelector('.unseen').textContent = rows[at][2];
    row.querySelector('line').setAttribute('x1', x);
    row.querySelector('line').setAttribute('x2', x);
  });
}
input.addEventListener('input', () => { show(); copy.textContent = 'copy'; });
const copy = box.querySelector('button');
copy.addEventListener('click', () => {
  const range = document.createRange();
  range.selectNodeContents(box.querySelector('code'));
  getSelection().removeAllRanges();
  getSelection().addRange(range);
  copy.textContent = document.execCommand('copy') ? 'copied' : 'selected';
});
copy.hidden = false;
input.parentElement.hidden = false;
show();
</script>"""


def slider(points: Points) -> str:
    """The HTML of the first screen.

    Without a script the curves stand still, and the lines show the accuracy after `FIRST_S`.
    """
    windows = list(points)
    first = min(range(len(windows)), key=lambda i: abs(windows[i] - FIRST_S))
    shown = {
        task: [_texts(tasks[task]) for tasks in points.values()] for task in points[windows[0]]
    }
    lines = "".join(
        f'<tr><td>{html.escape(task)}</td><td class="share">{texts[first][0]}</td>'
        f'<td class="interval">{texts[first][1]}</td><td class="unseen">{texts[first][2]}</td>'
        f"<td>{_curve({w: tasks[task].by_trial for w, tasks in points.items()}, first)}</td></tr>"
        for task, texts in shown.items()
    )
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    data = json.dumps({"windows": windows, "tasks": list(shown.values())})
    wait = f'<span class="wait">{windows[first]:g}</span>'
    return (
        f'{STYLE}<div class="slider" data-answers="{html.escape(data)}">'
        f"<p>Wait <b>{wait} s</b> from first contact, and this share of the decisions is right:</p>"
        f'<label hidden><input type="range" min="0" max="{len(windows) - 1}" value="{first}" '
        f'aria-label="seconds to wait"></label>'
        f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table>"
        f"<p><code>make export EXPORT='--quick --window {wait}'</code> "
        f'<button hidden type="button">copy</button></p></div>{SCRIPT}'
    )


def _texts(choice: Chosen) -> tuple[str, str, str]:
    """Accuracy, interval, and accuracy on objects never met."""
    met, result = unseen(choice), choice.by_trial
    never = "" if met is None else f"{100 * met.accuracy:.0f} %"
    return f"{100 * result.accuracy:.0f} %", f"({interval(result)})", never


def _curve(results: Mapping[float, Result], first: int) -> str:
    """A task's accuracy against time, with its band and a line at the time that is shown."""
    x = [100 * window / max(results) for window in results]

    def points(heights: list[float], x: list[float] = x) -> str:
        return " ".join(f"{a:.1f},{100 - 100 * b:.1f}" for a, b in zip(x, heights, strict=True))

    low, high = (list(ends) for ends in zip(*(r.interval for r in results.values()), strict=True))
    return (
        '<svg viewBox="0 0 100 100" preserveAspectRatio="none" role="img" '
        'aria-label="accuracy, 0 to 100 %, against time">'
        f'<polygon points="{points(low)} {points(high[::-1], x[::-1])}"/>'
        f'<polyline points="{points([r.accuracy for r in results.values()])}"/>'
        f'<line x1="{x[first]:.1f}" x2="{x[first]:.1f}" y1="0" y2="100"/></svg>'
    )
