"""Draw the reasons for a model's answers: a touch's curves over those of the nearest
trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from edge.errors import InputError
from edge.model.model import Model
from edge.recording import Recording, load
from edge.tools.explain import explanations
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
    canvas: Any, case: Case, layout: SkinLayout, window_s: float, phone: bool
) -> None:
    """Draw the three features of a case beside those of its nearest trials, and the
    pulls."""
    axes = canvas.subplots(*(4, 1) if phone else (2, 2)).ravel()
    legend = {}
    for axis, (name, unit) in zip(axes, units(layout).items(), strict=False):
        stroke = {"color": TOUCH[0], "lw": 2.4, "zorder": 3}
        legend["this touch"] = axis.plot(
            *_within(case.touch, name, window_s), **stroke
        )[0]
        for place, (text, series, same) in enumerate(case.near, start=1):
            colour, _, dashes = SAME if same else OTHER
            curve = ([], []) if series is None else _within(series, name, window_s)
            style = {"color": colour, "ls": dashes, "lw": 1.0, "ms": 4}
            marks = {"marker": STROKES[place][1], "markevery": (0.04 * place, 0.25)}
            legend[text] = axis.plot(*curve, **style, **marks)[0]
        axis.set(
            title=name,
            xlabel="seconds from onset",
            ylabel=unit,
            xlim=(0.0, 1.06 * window_s),
        )
        axis.set_ylim(bottom=0.0)
    strongest = list(case.pulls.items())[:MOST_PULLS]
    signs = [SAME[0] if pull > 0.0 else OTHER[0] for _, pull in strongest]
    axes[3].barh(range(len(strongest)), [pull for _, pull in strongest], color=signs)
    axes[3].set_yticks(
        range(len(strongest)), [name for name, _ in strongest], fontsize=8
    )
    axes[3].invert_yaxis()
    axes[3].axvline(0.0, color="0.3", lw=0.8)
    axes[3].set(
        title="pulls to the answer", xlabel=f"squared distance,\nagainst {case.rival}"
    )
    canvas.legend(
        legend.values(), legend, loc="outside lower left", fontsize=8, frameon=False
    )


def _within(series: FeatureSeries, name: str, window_s: float) -> tuple[Any, Any]:
    inside = series.t <= window_s
    return series.t[inside], curves(series)[name][inside]


def draw(
    recording: Recording, out: Path, model: Model, folder: Path, where: str
) -> None:
    """Draw a recording over the trials of a folder that a model finds nearest, into a
    PNG.

    Raises:
        InputError: the recording does not suit the model or holds no contact, or the
            folder holds none of the trials.
    """
    touch = contact_of(where, recording)[1]
    series_of: dict[str, FeatureSeries | None] = {}
    cases = []
    for line in explanations(model, recording, where):
        rival = line["rival"] or {"label": "others"}
        neighbours = []
        for trial in [*line["nearest"][:MOST_NEAR], *filter(None, [line["rival"]])]:
            name = trial["trial"]
            if name not in series_of:
                series_of[name] = _trial(folder, name)
            text = f"{name}: {trial['label']}, {trial['distance']:.3g} away"
            missing = "" if series_of[name] is not None else " (recording not found)"
            neighbours.append(
                (text + missing, series_of[name], trial["label"] == line["label"])
            )
        title = f"{line['task']}: {line['label']}"
        cases.append(Case(title, touch, neighbours, line["pulls"], rival["label"]))
    if not any(series_of.values()):
        raise InputError(
            f"{folder}: holds none of the nearest trials, such as {next(iter(series_of))}; "
            "name their "
            "folder by --data"
        )
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 5.0 * len(cases)), layout="constrained")
        canvases = figure.subfigures(len(cases), squeeze=False)[:, 0]
        for canvas, case in zip(canvases, cases, strict=True):
            canvas.suptitle(case.title, fontsize=10, weight="bold")
            draw_case(canvas, case, recording.layout, model.info.window_s, False)
        with write_whole(out) as file:
            figure.savefig(file, format="png", dpi=110)


def _trial(folder: Path, name: str) -> FeatureSeries | None:
    """A trial's contact by its name, if its recording is in the folder."""
    path = folder / f"{name}.npz"
    number = 1
    if not path.is_file() and name.rpartition(" ")[2].isdecimal():
        path = folder / f"{name.rpartition(' ')[0]}.npz"
        number = int(name.rpartition(" ")[2])
    return contact_of(str(path), load(path), number)[1] if path.is_file() else None
