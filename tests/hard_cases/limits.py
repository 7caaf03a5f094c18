"""The ends of the ranges: large skins, late clocks, forces of zero, long vectors."""

import statistics
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from edge import demo
from edge.classifier import Classifier
from edge.events import Decided, Onset
from edge.recording import load
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.region import largest_region
from tests.hard_cases.cases import Case, Ladder, decades, powers_of_ten
from tests.hard_cases.frames import FOREARM, contact_of
from tests.hard_cases.models import shipped


def skin_error(side, across, full=False):
    """Error of area, peak and centroid of a block at full scale, over a quarter of the
    columns.

    Args:
        side: rows and columns.
        across: the block lies across the seam.
        full: it is every taxel instead.
    """
    side = int(side)
    counts = np.zeros((side, side), np.uint16)
    width = side if full else side // 4
    first = 0 if full else -(width // 2) if across else width
    counts[:, np.arange(first, first + width) % side] = 65535
    region = largest_region(counts, 50, wraps=True)
    row, col = region.centroid
    gap = abs(col - (first + (width - 1) / 2)) % side
    errors = (region.area - side * width, region.peak - 65535, row - (side - 1) / 2)
    return max(*map(abs, errors), min(gap, side - gap))


def clock_error(start):
    """Largest error of a sample of force, area or motion, over the course's size.

    Steps of 2^-7 s from a whole number of seconds are exact to 2^45 s; beyond, frames
    are to be refused or their times kept, never merged without a word.
    """
    begin = float(np.floor(start))
    frames = [
        Frame(begin + i / 128.0, np.zeros((16, 24), np.uint16)) for i in range(200)
    ]
    courses = [[], [], []]
    pitch = Fraction(FOREARM.pitch_m[0])
    for i in range(11, 200):
        rows = 2 + i // 50
        force = 200 + 7 * i
        frames[i].counts[4 : 4 + rows, 5:8] = force
        # Each row below moves the centroid by half a row.
        moved = Fraction(rows - 2, 2) * pitch
        for course, value in zip(courses, (force, 3 * rows, moved), strict=True):
            course.append(Fraction(value))
    series = contact_of(frames, horizon_s=1.2).series()
    vector = feature_vector(series, 1.2).reshape(3, -1)
    worst = Fraction(0)
    for samples, course in zip(vector.tolist(), courses, strict=True):
        for sample, time in zip(
            samples,
            np.linspace(0.0, 1.2, 40).tolist(),
            strict=True,
        ):
            place = Fraction(time) * 128
            whole = place.numerator // place.denominator
            before = course[whole]
            after = course[whole + 1]
            true = before + (place - whole) * (after - before)
            worst = max(worst, abs(Fraction(sample) - true) / max(course))
    return float(worst)


@cache
def touches():
    """The touches that come with the program."""
    return tuple(map(load, demo.recordings()))


def paused(recording, pause_s, frames, unit):
    """The same with a pause so many frames after the touch, and with times in another
    unit."""
    touched = recording.frames.max(axis=(1, 2)) > recording.layout.onset
    t = recording.t.copy()
    t[int(touched.argmax()) + frames :] += pause_s
    return replace(recording, t=unit * t)


def decisions(recording):
    """When the contact began, and the decisions about it."""
    events = list(Classifier(shipped()).classify(recording))
    (onset,) = (event.onset_s for event in events if isinstance(event, Onset))
    return onset, [event for event in events if isinstance(event, Decided)]


def gap_error(pause_s, frames, unit):
    """Decisions whose flag `gap` is wrong.

    One step covers more than a twelfth of the window, more than 0.1 s and more than two
    and a half usual steps, which four frames or more can tell.
    """
    window = Fraction(shipped().info.window_s)
    wrong = 0
    for touch in touches():
        recording = paused(touch, pause_s, frames, unit)
        onset, decided = decisions(recording)
        ages = [
            Fraction(t) - Fraction(onset)
            for t in recording.t[recording.t >= onset].tolist()
        ]
        steps = [min(b, window) - min(a, window) for a, b in pairwise(ages)]
        within = [step for step in steps if step]
        usual = statistics.median(within) if len(within) >= 4 else 0
        longest = max(window / 12, Fraction(0.1), Fraction(5, 2) * usual)
        gap = max(steps) > longest
        wrong += sum(("gap" in event.flags) != gap for event in decided)
    return float(wrong)


def gap_usual():
    """The labels that interpolation across the pause alone gives the touches."""
    changed = []
    sure = []
    for touch in touches():
        (_, right), (_, blind) = decisions(touch), decisions(paused(touch, 5.0, 3, 1.0))
        changed += [a.label != b.label for a, b in zip(right, blind, strict=True)]
        sure += [event.confidence for event in blind]
    return (
        f"interpolation alone, after a pause of 5 s: {sum(changed)} of {len(changed)} "
        f"labels are others, with a mean confidence of {np.mean(sure):.2g}"
    )


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
    contact = contact_of(frames, layout, horizon_s=1.2, features=COURSES)
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
        "limits: skins to 256 x 256 at full scale, across the seam",
        "whole numbers",
        "taxels, counts",
        skin_error,
        [
            *(
                {"side": side, "across": a}
                for side in (16, 64, 256)
                for a in (True, False)
            ),
            {"side": 256, "across": False, "full": True},
        ],
        {"side": st.integers(4, 64).map(lambda n: 4 * n), "across": st.booleans()},
        Ladder(
            "rows and columns",
            [16, 64, 128, 256, 512],
            "side",
            "13 x 13 and 16 x 24",
        ),
    ),
    Case(
        "limits: contacts that begin late on the clock",
        "interpolation in fractions",
        "error over the largest of a course",
        clock_error,
        [{"start": start} for start in (1.0, 1e5, 1.7e9)],
        {"start": powers_of_ten(0.0, 9.2)},
        Ladder(
            "seconds",
            decades(3, 18, 1),
            "start",
            "7.3 and 2.6 s, or the time since the board's start",
        ),
        guard="features",
        examples=5,
        bound=1e-15,
    ),
    Case(
        "limits: times in milliseconds, pauses of 5 s",
        "the rule for a pause, in fractions",
        "decisions with a wrong flag",
        gap_error,
        [
            {"pause_s": 0.0, "frames": 3, "unit": 1.0},
            {"pause_s": 0.0, "frames": 3, "unit": 1e3},
            {"pause_s": 5.0, "frames": 3, "unit": 1.0},
        ],
        {
            "pause_s": st.floats(0.0, 0.3) | st.floats(0.0, 10.0),
            "frames": st.integers(1, 100),
            "unit": st.sampled_from([1.0, 1e3, 1e6]),
        },
        Ladder(
            "seconds between two frames",
            [0.05, 0.08, 0.09, 0.1, 0.3, 1.0, 1e3, 1e6, 1e9],
            "pause_s",
            "0.046 and 0.010 s",
        ),
        gap_usual,
        guard="clock",
        examples=5,
    ),
    Case(
        "limits: logarithms at their floor, square roots",
        "mpmath, 50 digits",
        "error over the larger of the value and 1",
        transform_error,
        [{"counts": 51, "scale": 1.0}, {"counts": 65535, "scale": 2250.0}],
        {"counts": st.integers(51, 65535), "scale": powers_of_ten(-12.0, 12.0)},
        Ladder("counts in a newton", decades(3, -300, 0.1), "scale"),
        guard="features",
        bound=1e-15,
    ),
]
