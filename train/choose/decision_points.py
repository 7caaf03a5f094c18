"""The usual decision points of a model: as many as calibration and its size allow."""

from collections.abc import Mapping

import numpy as np

from edge.features.vector import WINDOW_S
from train.choose.options import FitOptions
from train.choose.settings import Settings
from train.data.dataset import DataSet
from train.data.vectors import MOST_ROWS
from train.model.outlier_score import MOST_CENTRES, MOST_COMPONENTS
from train.model.pipeline import Choices
from train.model.stopping import FEWEST

STEPS_S = (0.1, 0.2, 0.3, 0.4, 0.6)
"""Steps between decision points. The first one that keeps the weights below
`LARGEST_BYTES` is taken."""
FIRST_S = 0.2
"""The first decision point."""
LARGEST_BYTES = 1_850_000
"""Bytes of constants with which a model stays below 2 MB."""


def decision_points(
    measured: DataSet, settings: Settings, options: FitOptions
) -> tuple[tuple[float, ...], list[str]]:
    """The decision points asked for, or the usual ones, and sentences on them."""
    asked_s = options.decision_points_s
    if asked_s is None:
        return usual_points(measured, settings, options.samples)
    if asked_s:
        return tuple(asked_s), []
    return (), ["decisions carry no confidence, as the model has no decision points"]


def has_early_points(settings: Settings, options: FitOptions) -> bool:
    """Whether decision points before the full window are asked for, or usual."""
    if options.decision_points_s is not None:
        return len(options.decision_points_s) > 1
    return settings.tested >= FEWEST


def usual_points(
    dataset: DataSet, settings: Settings, samples: int
) -> tuple[tuple[float, ...], list[str]]:
    """The decision points of a model, where none are asked for, and a sentence where
    there are fewer: none without calibration, fewer where the model would be too large.

    Args:
        dataset: measured for every candidate.
        settings: of the model.
        samples: values of a feature.
    """
    tested = settings.tested
    if tested < FEWEST:
        return (), [
            "decisions carry no confidence and none is early: calibration needs at "
            f"least {FEWEST} trials, not {tested}"
        ]
    dataset = dataset.of(sorted(settings.features()))
    for every_s in STEPS_S:
        # A long window has as many decision points as the usual one.
        step_s = every_s * max(settings.window_s / WINDOW_S, 1.0)
        points = _rising(step_s, settings.window_s)
        size = _size(len(points), dataset, settings, samples)
        if size <= LARGEST_BYTES:
            fewer = (
                f"{len(points)} decision points, one every {step_s:g} s, so that the "
                "model stays below 2 MB; --decision-points asks for more"
            )
            return tuple(points), [fewer] * (every_s > STEPS_S[0])
    return (settings.window_s,), [
        "no decision points before the full window: they would make the model about "
        f"{size / 1e6:.1f} MB; --decision-points asks for them"
    ]


def _size(points: int, dataset: DataSet, settings: Settings, samples: int) -> int:
    """Bytes of the constants of a model with so many decision points."""
    columns = sum(dataset.widths(samples))
    trials = len(dataset.trials)
    compared = trials if trials <= MOST_ROWS else MOST_CENTRES
    shared = 2 * MOST_COMPONENTS * columns
    outlier_score = MOST_COMPONENTS * (2 * compared + 4 * MOST_COMPONENTS)
    outlier_score += 8 * columns + 24 * compared
    full = settings.choices
    early = full if settings.early is None else {**full, **settings.early.choices}
    # Tasks share what is the same at all decision points.
    spaces = {task: (early[task].space(task), full[task].space(task)) for task in full}
    rows = settings.rows(dataset)
    at_end, before = (
        _bytes_of(choices, spaces, dataset, samples, rows) for choices in (full, early)
    )
    return shared + points * outlier_score + (points - 1) * before + at_end


def _bytes_of(
    choices: Choices,
    spaces: Mapping[str, object],
    dataset: DataSet,
    samples: int,
    rows: int,
) -> int:
    """Bytes of the constants that project and compare at a decision point.

    A column has a number, a mean, a gain, and a weight for each coordinate; a row its
    coordinates and their length. Tasks that share a space share these.
    """
    widths = dict(zip(dataset.names, dataset.widths(samples), strict=True))
    sizes: dict[object, int] = {}
    for task, choice in choices.items():
        columns = sum(widths[name] for name in choice.features)
        components = choice.components
        if choice.projection == "lda":
            targets = choice.targets or (task,)
            components = sum(len(set(dataset.labels(t).tolist())) - 1 for t in targets)
        components = min(components, len(dataset.trials))
        size = columns * (24 + 4 * components) + rows * (8 + 4 * components)
        space = spaces[task]
        sizes[space] = max(sizes.get(space, 0), size)
    return sum(sizes.values())


def _rising(step_s: float, window_s: float) -> list[float]:
    """Decision points one every `step_s`, up to the window."""
    before = np.arange(max(FIRST_S, step_s), window_s - 1e-6, step_s)
    return [*before.round(6).tolist(), window_s]
