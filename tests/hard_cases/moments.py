"""Second moments of a region, and p-values of a trial that was seen before."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from edge.model.model import Model
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.track import ContactTracker, TrackSettings
from export.graph import to_onnx
from tests.hard_cases.cases import Case
from tests.hard_cases.frames import FOREARM
from tests.hard_cases.models import describe, features, labels_for, usual_pipeline
from train.conformal import SequentialClassifier
from train.pipeline import Choice

MOMENTS = ("skin_length", "skin_width", "skin_spread_along", "skin_slant")
BAND = 12
"""Columns of the shapes: less than half of the cylinder, so that no seam cuts them."""


def shape(name: str, value: int, seed: int) -> NDArray[np.uint16]:
    """Counts near `value`; of "steep", taxels on a line that has no width."""
    rng = np.random.default_rng(seed)
    counts = np.zeros((16, 24), dtype=np.uint16)
    rows = np.arange(16)
    if name == "block":
        counts[:, :BAND] = value
    elif name == "line":
        counts[7, :BAND] = value
    elif name == "stairs":
        counts[rows[:BAND], rows[:BAND]] = value
        counts[rows[: BAND - 1], rows[1:BAND]] = value
    elif name == "one":
        counts[3, 5] = value
    elif name == "steep":
        steps = np.arange(4)
        counts[steps, 3 * steps] = rng.integers(max(value // 2, 60), value + 1, 4)
    else:
        counts[:, :BAND] = rng.integers(max(value // 2, 60), value + 1, (16, BAND))
    return counts


def moments(counts: NDArray[np.uint16]) -> list[mpmath.mpf]:
    """`MOMENTS` of a frame, from whole numbers and 50 digits."""
    places = [(int(counts[r, c]), int(r), int(c)) for r, c in np.argwhere(counts > 0)]
    force = sum(f for f, _, _ in places)
    row, col = (Fraction(sum(p[0] * p[i] for p in places), force) for i in (1, 2))
    along, around, slant = (
        sum(f * a(r, c) for f, r, c in places) / force
        for a in (
            lambda r, c: (r - row) ** 2,
            lambda r, c: (c - col) ** 2,
            lambda r, c: (r - row) * (c - col),
        )
    )
    with mpmath.workdps(50):
        xx, yy, xy = (mpmath.mpf(v.numerator) / v.denominator for v in (along, around, slant))
        split = mpmath.sqrt((xx - yy) ** 2 / 4 + xy**2)
        large, small = (xx + yy) / 2 + split, max((xx + yy) / 2 - split, mpmath.mpf(0))
        return [mpmath.sqrt(large), mpmath.sqrt(small), mpmath.sqrt(xx), xy]


def moment_error(name: str, value: int, seed: int) -> float:
    """Largest error of a moment, in the skin's larger side (its square for the slant)."""
    counts = shape(name, value, seed)
    tracker = ContactTracker(FOREARM, TrackSettings(debounce=1), features=MOMENTS)
    contact = None
    for i in range(3):
        (contact,) = tracker.push(Frame(0.01 * i, counts)) or [None]
    assert contact is not None
    seen = feature_vector(contact.series(), 0.02, 3, MOMENTS).reshape(len(MOMENTS), 3)
    side = max(FOREARM.shape)
    worst = 0.0
    for row, truth, scale in zip(seen, moments(counts), (side, side, side, side**2), strict=True):
        worst = max(worst, *(abs(float(mpmath.mpf(float(x)) - truth)) / scale for x in row))
    return worst


def moment_usual() -> str:
    """The textbook's E[x^2] - E[x]^2 in float32, along and around, on a full line."""
    counts = np.zeros((16, 24), np.float32)
    counts[7, 5 : 5 + BAND] = 65535
    rows, cols = np.indices(counts.shape).astype(np.float32)
    force = counts.sum()
    around = (counts * cols * cols).sum() / force - ((counts * cols).sum() / force) ** 2
    truth = (BAND**2 - 1) / 12
    ours = shape("rough", 65535, 0)
    spread = float(moments(ours)[2])
    weighed = ours.astype(np.float32)
    along = (weighed * rows * rows).sum() / weighed.sum()
    along -= ((weighed * rows).sum() / weighed.sum()) ** 2
    return (
        f"E[x^2] - E[x]^2 in float32: a line's variance is off by {abs(around - truth):.1e}, a "
        f"rough patch's spread by {abs(float(along) ** 0.5 - spread):.1e} taxels"
    )


TRIALS = 60


@cache
def sequential(seed: int, classes: int) -> tuple[SequentialClassifier, Model, NDArray[np.float64]]:
    X = features(TRIALS, seed)[None]
    fitted = SequentialClassifier({"t": Choice("none", 6, 1)}, (1.2,), seed=seed)
    fitted.fit(X, {"t": labels_for(X[0], classes, seed)})
    info = replace(
        describe(fitted.decision_points_[-1]), decision_points_s=(1.2,), folds=fitted.sizes_
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(to_onnx(fitted, info))
        return fitted, Model(path), X


def seen_before_error(seed: int, classes: int, nudge: int) -> float:
    """Trials of which a repetition gets a smaller p-value than the trial itself had.

    A p-value counts the calibration trials that are at least as strange; the trial's twin is,
    by being equal. The graph computes its rank anew, and must not lose it to a rounding: of its
    own, or one that another machine's features bring, `nudge` units in the last place.
    """
    fitted, model, X = sequential(seed, classes)
    calibration = fitted.calibrations_["t"]
    labels = fitted.decision_points_[-1].labels_["t"]
    lost = 0
    for k, size in enumerate(calibration.sizes):
        own = np.flatnonzero(_folds(seed) == k)
        queries = X[0, own] * (1.0 + nudge * 2.0**-52)
        given = model.run(queries, 0)["t_pvalues"][:, k]
        for i, (trial, strangeness) in enumerate(zip(own, calibration.maxima[0, k], strict=False)):
            at_least = int((calibration.maxima[0, k, :size] >= strangeness).sum())
            lost += bool(given[i, labels[trial]] < (1 + at_least) / (1 + int(size)))
    return float(lost)


def _folds(seed: int) -> NDArray[np.int64]:
    from train.conformal import FOLDS, deal

    return deal(TRIALS, FOLDS, seed)


def seen_before_usual() -> str:
    X = features(TRIALS)
    pipe = usual_pipeline(X, 6, 2, labels_for(X))
    shares = np.unique(pipe.predict_proba(features(200, 1)).max(axis=1)).tolist()
    return f"no p-values; scikit-learn's largest vote share with k = 2 is one of {shares}"


CASES = [
    Case(
        "features",
        "length, width, spread and slant of what touches, counts at full scale",
        "fractions, 50 digits",
        "parts of the skin's side",
        2.0**-25,
        moment_error,
        [
            {"name": name, "value": value, "seed": 0}
            for name in ("block", "line", "stairs", "one", "steep", "rough")
            for value in (60, 4095, 65535)
        ],
        {
            "name": st.sampled_from(["rough", "steep"]),
            "value": st.integers(60, 65535),
            "seed": st.integers(0, 999),
        },
        usual=moment_usual,
    ),
    Case(
        "early stopping",
        "p-values of a trial that repeats one of the calibration",
        "counted by rank",
        "repetitions with a smaller p-value",
        0,
        seen_before_error,
        [
            {"seed": seed, "classes": classes, "nudge": nudge}
            for seed in range(3)
            for classes in (2, 5)
            for nudge in (0, 1, -1, 64, -64)
        ],
        usual=seen_before_usual,
    ),
]
