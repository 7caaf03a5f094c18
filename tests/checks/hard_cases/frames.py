"""Features of hard frames, times and forces."""

from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from edge.features.names import measures
from edge.features.vector import feature_vector
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten

FOREARM = SkinLayout(
    16,
    24,
    True,
    (0.0108, 0.01205),
    0.046,
    threshold_counts=50,
    onset_counts=50,
)


def contact_of(frames, layout=FOREARM, **options):
    """The first contact of some frames."""
    tracker = ContactTracker(layout, 1, **options)
    contact, *_ = [contact for frame in frames for contact in tracker.push(frame)]
    return contact


def flicker_error(seed):
    """Metres that the followed centroid moves though nothing does: the peaks of two
    pairs of taxels take turns at being the higher one."""
    rng = np.random.default_rng(seed)
    frames = []
    for i in range(40):
        first, second = (101, 100) if i == 0 or rng.random() < 0.5 else (100, 101)
        counts = np.zeros(FOREARM.shape, np.uint16)
        counts[3, 5:7] = first
        counts[12, 17:19] = second
        frames.append(Frame(0.01 * i, counts))
    return float(np.abs(contact_of(frames).series().motion).max())


def clock_error(start):
    """Largest error of a sample of force, area or motion, over the time series's size.

    Steps of 2^-7 s from a whole number of seconds are exact to 2^45 s; beyond, frames
    are to be refused or their times kept, never merged without a word.
    """
    begin = float(np.floor(start))
    frames = [
        Frame(begin + i / 128.0, np.zeros((16, 24), np.uint16)) for i in range(200)
    ]
    all_time_series = [[], [], []]
    pitch = Fraction(FOREARM.pitch_m[0])
    for i in range(11, 200):
        rows = 2 + i // 50
        force = 200 + 7 * i
        frames[i].counts[4 : 4 + rows, 5:8] = force
        # Each row below moves the centroid by half a row.
        moved = Fraction(rows - 2, 2) * pitch
        for time_series, value in zip(
            all_time_series, (force, 3 * rows, moved), strict=True
        ):
            time_series.append(Fraction(value))
    series = contact_of(frames, horizon_s=1.2).series()
    vector = feature_vector(series, 1.2).reshape(3, -1)
    worst = Fraction(0)
    times = np.linspace(0.0, 1.2, 40).tolist()
    for samples, time_series in zip(vector.tolist(), all_time_series, strict=True):
        for sample, time in zip(samples, times, strict=True):
            place = Fraction(time) * 128
            whole = place.numerator // place.denominator
            before = time_series[whole]
            after = time_series[whole + 1]
            true = before + (place - whole) * (after - before)
            worst = max(worst, abs(Fraction(sample) - true) / max(time_series))
    return float(worst)


COURSES = ("log_max_force", "sqrt_max_force", "log_right_force", "sqrt_right_force")
"""Of the contact, and of the untouched right half, whose logarithm is that of the
floor."""


def transform_error(counts, scale):
    """Largest error of a logarithm or root of a constant force, over the larger of it
    and 1."""
    layout = replace(FOREARM, counts_per_newton=scale)
    frame = np.zeros((16, 24), np.uint16)
    frame[4:6, 5:8] = counts
    frames = (Frame(i / 100.0, frame) for i in range(130))
    contact = contact_of(
        frames, layout, horizon_s=1.2, measures=measures(layout, COURSES)
    )
    vector = feature_vector(contact.series(), 1.2, 8, COURSES).reshape(4, 8)
    with mpmath.workdps(50):
        force = mpf(int(counts)) / mpf(scale)
        floor = mpf(layout.threshold_counts + 1) / mpf(scale)
        true = [
            mpmath.log(force + floor),
            mpmath.sqrt(force),
            mpmath.log(floor),
            mpf(0),
        ]
        errors = [
            abs(mpf(value) - want) / max(1, abs(want))
            for row, want in zip(vector.tolist(), true, strict=True)
            for value in row
        ]
        return float(max(errors))


CASES = [
    Case(
        "features: two regions of equal area that flicker",
        "nothing moves",
        "metres of motion",
        flicker_error,
        [{"seed": 0}],
        {"seed": SEEDS},
    ),
    Case(
        "features: contacts that begin late on the clock",
        "interpolation in fractions",
        "error over the largest of a time series",
        clock_error,
        [{"start": start} for start in (1.0, 1e5, 1.7e9)],
        {"start": powers_of_ten(0.0, 9.2)},
        Ladder(
            "seconds",
            decades(3, 18, 1),
            "start",
            "7.3 and 2.6 s, or the time since the board's start",
        ),
        examples=5,
        bound=1e-15,
    ),
    Case(
        "features: logarithms at their floor, square roots",
        "mpmath, 50 digits",
        "error over the larger of the value and 1",
        transform_error,
        [{"counts": 51, "scale": 1.0}, {"counts": 65535, "scale": 2250.0}],
        {"counts": st.integers(51, 65535), "scale": powers_of_ten(-12.0, 12.0)},
        Ladder("counts in a newton", decades(3, -300, 0.1), "scale"),
        bound=1e-15,
    ),
]
