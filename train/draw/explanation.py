"""Draw the reasons for a model's answers: a touch's curves over those of the nearest
trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from edge.app.commands.explain import explanations
from edge.decide.model import Model
from edge.errors import InputError
from edge.record.recording import Recording, load
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.writing import write_whole
from train.draw.comparison import contact_of
from train.draw.recording import curves, units
from train.report.figures import STROKES, STYLE

TOUCH = STROKES[0]
SAME = STROKES[2]
OTHER = STROKES[1]
"""Colour, marker and dashes of the touch, of trials with its answer, and of those with
another."""
MOST_NEAR = 4
MOST_PULLS = 5


@dataclass(frozen=True)
class Case:
    """An answer that is to be drawn.

    Attributes:
        title: the task and the answer.
        touch: the contact.
        near: text of the legend, contact (None if it is not at hand), and whether the
            label is that of the answer, for each of the nearest trials.
        pulls: {feature: how much more it pulls towards the answer}.
        rival: the other label, with which the pulls compare the answer.
    """

    title: str
    touch: FeatureSeries
    near: Sequence[tuple[str, FeatureSeries | None, bool]]
    pulls: Mapping[str, float]
    rival: str


def draw_case(
    canvas: Any,
    case: Case,
    layout: SkinLayout,
    window_s: float,
) -> None:
    """Draw the three features of a case beside those of its nearest trials, and the
    pulls."""
    *axes, below = canvas.subplots(2, 2).ravel()
    legend: dict[str, Any] = {}
    for axis, (name, unit) in zip(axes, units(layout).items(), strict=True):
        legend |= _draw_curves(axis, case, name, window_s)
        axis.set(title=name, xlabel="seconds from onset", ylabel=unit)
        axis.set(xlim=(0.0, 1.06 * window_s), ylim=(0.0, None))
    _draw_pulls(below, case)
    canvas.legend(
        legend.values(),
        legend,
        loc="outside lower left",
        fontsize=8,
        frameon=False,
    )


def _draw_curves(axis: Any, case: Case, name: str, window_s: float) -> dict[str, Any]:
    """Draw a feature of the touch and of the nearest trials; {text: line} of the
    legend."""

    def curve(series: FeatureSeries | None) -> tuple[Any, Any]:
        if series is None:
            return [], []
        inside = series.t <= window_s
        return series.t[inside], curves(series)[name][inside]

    (line,) = axis.plot(*curve(case.touch), color=TOUCH[0], lw=2.4, zorder=3)
    legend = {"this touch": line}
    for place, (text, series, same) in enumerate(case.near, start=1):
        colour, _, dashes = SAME if same else OTHER
        style = {"color": colour, "ls": dashes, "lw": 1.0, "ms": 4}
        marks = {"marker": STROKES[place][1], "markevery": (0.04 * place, 0.25)}
        (legend[text],) = axis.plot(*curve(series), **style, **marks)
    return legend


def _draw_pulls(axis: Any, case: Case) -> None:
    """Draw the strongest pulls of a case as bars, the strongest at the top."""
    names = list(case.pulls)[:MOST_PULLS]
    pulls = list(case.pulls.values())[:MOST_PULLS]
    places = range(len(names))
    colours = np.where(np.array(pulls) > 0.0, SAME[0], OTHER[0])
    axis.barh(places, pulls, color=colours)
    axis.set_yticks(places, names, fontsize=8)
    axis.invert_yaxis()
    axis.axvline(0.0, color="0.3", lw=0.8)
    xlabel = f"squared distance,\nagainst {case.rival}"
    axis.set(title="pulls to the answer", xlabel=xlabel)


def draw(
    recording: Recording,
    out: Path,
    model: Model,
    folder: Path,
    where: str,
) -> None:
    """Draw a recording over the trials of a folder that a model finds nearest, into a
    PNG.

    Raises:
        InputError: the recording does not suit the model or holds no contact, or the
            folder holds none of the trials.
    """
    touch = contact_of(where, recording)[1]
    answers = list(explanations(model, recording, where))
    names = [trial["trial"] for answer in answers for trial in _trials_drawn(answer)]
    series_of = {name: _trial(folder, name) for name in dict.fromkeys(names)}
    if not any(series_of.values()):
        raise InputError(
            f"{folder}: holds none of the nearest trials, such as {names[0]}; name "
            "their folder by --data"
        )
    cases = [_case(answer, touch, series_of) for answer in answers]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 5.0 * len(cases)), layout="constrained")
        canvases = figure.subfigures(len(cases), squeeze=False)[:, 0]
        for canvas, case in zip(canvases, cases, strict=True):
            canvas.suptitle(case.title, fontsize=10, weight="bold")
            draw_case(canvas, case, recording.layout, model.info.window_s)
        with write_whole(out) as file:
            figure.savefig(file, format="png", dpi=110)


def _trials_drawn(answer: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The nearest trials of an explanation, and last the nearest of its rival."""
    return [*answer["nearest"][:MOST_NEAR], *filter(None, [answer["rival"]])]


def _case(
    answer: Mapping[str, Any],
    touch: FeatureSeries,
    series_of: Mapping[str, FeatureSeries | None],
) -> Case:
    """The picture of an explanation, with the contact and {trial: its contact}."""
    near = []
    for trial in _trials_drawn(answer):
        series = series_of[trial["trial"]]
        text = f"{trial['trial']}: {trial['label']}, {trial['distance']:.3g} away"
        if series is None:
            text += " (recording not found)"
        near.append((text, series, trial["label"] == answer["label"]))
    rival = answer["rival"] or {"label": "others"}
    title = f"{answer['task']}: {answer['label']}"
    return Case(title, touch, near, answer["pulls"], rival["label"])


def _trial(folder: Path, name: str) -> FeatureSeries | None:
    """A trial's contact by its name, if its recording is in the folder."""
    path = folder / f"{name}.npz"
    number = 1
    stem, _, digits = name.rpartition(" ")
    if not path.is_file() and digits.isdecimal():
        path = folder / f"{stem}.npz"
        number = int(digits)
    return contact_of(str(path), load(path), number)[1] if path.is_file() else None
