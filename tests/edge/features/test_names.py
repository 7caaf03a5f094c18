"""Feature types by name: whole numbers against sums in plain Python, values against
fractions."""

import math
from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.decide.verify import integers_of
from edge.errors import InputError
from edge.features.cells import Cells
from edge.features.names import PAPER, feature_types, names
from edge.features.vector import feature_vector
from edge.features.zones import ZONES
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import active_of, followed, pressed, quantities, zones_of

FLAT = SkinLayout(5, 7, threshold_counts=10, onset_counts=10, counts_per_newton=100.0)
ROUND = replace(FLAT, wraps=True)
ALL = [name for name in names() if "shear" not in name]
TWO_FRAMES = [pressed(FLAT, t, {(1, 1): 50}) for t in (0.0, 0.5)]


def weighted_sums(counts, mask, turn: int | None) -> list[int]:
    """The measures of a zone, by plain sums; the best of all cuts of a turn."""
    rows, cols = mask.nonzero()
    forces = counts[mask].astype(int)
    candidates = []
    for cut in range(turn or 1):
        c = np.where(cols < cut, cols + (turn or 0), cols)
        weights = (1, rows, c, rows**2, rows * c, c**2)
        sums = [int((forces * weight).sum()) for weight in weights]
        variance = sums[0] * sums[5] - sums[2] ** 2
        largest = int(forces.max(initial=0))
        candidates.append((variance, cut, [largest, len(forces), *sums]))
    return min(candidates)[2]


def expected(layout: SkinLayout, frame: Frame) -> dict[str, list[int]]:
    active = active_of(layout, frame)
    contact = active.largest()
    if contact is None:
        return dict.fromkeys(ZONES, [0] * 8)
    left_half = np.arange(layout.cols) < layout.cols // 2
    turn = layout.cols if layout.wraps else None
    return {
        "contact": weighted_sums(frame.counts, contact.mask, turn),
        "skin": weighted_sums(frame.counts, active.mask, turn),
        "left": weighted_sums(frame.counts, active.mask & left_half, None),
        "right": weighted_sums(frame.counts, active.mask & ~left_half, None),
    }


def frame_of(seed: int, shape, density=0.4, high=65535) -> Frame:
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, high, shape, endpoint=True) * (rng.random(shape) < density)
    return Frame(0.0, counts.astype(np.uint16), valid=rng.random(shape) < 0.9)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 1 << 32),
    density=st.sampled_from([0.05, 0.6, 1.0]),
    high=st.sampled_from([12, 65535]),
    wraps=st.booleans(),
    shape=st.sampled_from([(5, 7), (1, 6), (6, 1)]),
)
def test_whole_numbers_of_every_place_are_those_of_plain_sums(
    seed,
    density,
    high,
    wraps,
    shape,
):
    layout = SkinLayout(*shape, wraps=wraps, threshold_counts=10)
    frame = frame_of(seed, shape, density, high)
    assert zones_of(layout, frame, ALL) == expected(layout, frame)


@pytest.mark.parametrize("wraps", [False, True])
def test_the_largest_skin_full_of_the_largest_counts_does_not_overflow(wraps):
    side = 1024
    layout = SkinLayout(side, side, wraps=wraps)
    frame = Frame(0.0, np.full((side, side), 65535, dtype=np.uint16))
    line = sum(range(side))
    row = side * line
    squares = side * sum(c * c for c in range(side))
    sums = (side * side, row, row, squares, line * line, squares)
    zones = zones_of(layout, frame, ["skin_length"])
    assert zones["skin"][2:] == [65535 * v for v in sums]
    values = quantities([zones["skin"]], layout)
    spread = np.sqrt((side**2 - 1) / 12)
    assert values["spread_along"] == pytest.approx(spread, rel=1e-15)
    assert values["slant"] == 0.0


def series_of(layout: SkinLayout, frames, features):
    return followed(layout, frames, features=features).series()


def vector_of(layout: SkinLayout, frames, features, samples: int):
    """The features of the first second."""
    return feature_vector(series_of(layout, frames, features), 1.0, samples, features)


def value(layout: SkinLayout, counts, name: str) -> float:
    """A feature of a contact whose frames are all the same."""
    frames = [Frame(t, np.asarray(counts, dtype=np.uint16)) for t in (0.0, 0.5, 1.0)]
    vector = vector_of(layout, frames, [name], 3)
    assert len(set(vector)) == 1
    return vector[0]


def moments(taxels):
    """{quantity: the true value} of taxels, each a row, a column and counts."""
    force = sum(f for _, _, f in taxels)

    def mean(of) -> Fraction:
        return Fraction(sum(f * of(r, c) for r, c, f in taxels), force)

    row = mean(lambda r, c: r)
    col = mean(lambda r, c: c)
    rr = mean(lambda r, c: (r - row) ** 2)
    cc = mean(lambda r, c: (c - col) ** 2)
    rc = mean(lambda r, c: (r - row) * (c - col))
    with mpmath.workdps(60):
        a, b, m = (mpmath.mpf(x.numerator) / x.denominator for x in (rr, cc, rc))
        root = mpmath.sqrt((a - b) ** 2 + 4 * m * m)
        # Of taxels in a line the difference is 0 but for its sixtieth digit.
        longer, shorter = (
            mpmath.sqrt(max(v, 0) / 2) for v in (a + b + root, a + b - root)
        )
        return {
            "along": row,
            "around": col,
            "slant": m,
            "spread_along": mpmath.sqrt(a),
            "spread_around": mpmath.sqrt(b),
            "length": longer,
            "width": shorter,
        }


@settings(max_examples=40)
@given(seed=st.integers(0, 1 << 32), density=st.sampled_from([0.1, 0.5, 1.0]))
def test_moments_are_those_of_exact_arithmetic(seed, density):
    counts = frame_of(seed, FLAT.shape, density).counts.astype(int)
    counts[2, 3] = 40000
    above = counts > 10
    exact = moments(np.c_[np.argwhere(above), counts[above]].tolist())
    exact["force"] = counts[above].sum() / 100
    # The determinant of a thin contact cancels: see `edge.features.vector`.
    width = pytest.approx(float(exact.pop("width")), abs=7 * 2.0**-25)
    assert value(FLAT, counts, "skin_width") == width
    for quantity, truth in exact.items():
        assert value(FLAT, counts, f"skin_{quantity}") == pytest.approx(
            float(truth),
            rel=4e-15,
            abs=1e-14,
        )


@pytest.mark.parametrize("far", [1000, 114_000, 2**18])
def test_moments_beyond_64_bits_are_exact(far):
    """A thousandth of the force in row 1024, the rest in row 0: the variance times
    force squared is up to 2^66."""
    near = 1024 * far
    sums = [near, 2, near + far, 1024 * far, 0, 2**20 * far, 0, 0]
    values = quantities([sums], SkinLayout(2000, 4, wraps=False))
    variance = Fraction(2**20 * near * far, (near + far) ** 2)
    assert values["spread_along"][0] == pytest.approx(math.sqrt(variance), rel=1e-15)


def test_a_contact_is_followed_across_the_seam_and_does_not_jump():
    frames = [pressed(ROUND, i / 4, {(2, (5 + i) % 7): 50}) for i in range(5)]
    vector = vector_of(ROUND, frames, ["contact_around"], 5)
    assert vector.tolist() == [5.0, 6.0, 7.0, 8.0, 9.0]


def test_where_nothing_lies_the_place_is_that_of_the_frames_that_know_it():
    """The right half is touched from the third of five frames on, and the contact
    ends."""
    right = [0, 0, 40, 80, 0, 0, 0, 0, 0, 0]
    frames = [
        pressed(FLAT, i / 4, {(1, 1): 60 if i < 4 else 0, (i % 4, 5): force})
        for i, force in enumerate(right)
    ]
    features = ["right_along", "right_force", "right_area"]
    vector = feature_vector(
        series_of(FLAT, frames, features),
        1.25,
        6,
        features,
    ).reshape(3, 6)
    assert vector[0].tolist() == [2.0, 2.0, 2.0, 3.0, 3.0, 3.0]
    assert vector[1].tolist() == [0.0, 0.0, 0.4, 0.8, 0.0, 0.0]
    assert vector[2].tolist() == [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]
    assert vector_of(FLAT, frames[:2], ["right_along"], 2).tolist() == [0.0, 0.0]


def test_a_rate_is_the_change_a_second_of_the_sampled_values():
    frames = [pressed(FLAT, i / 10, {(1, 1): 100 + 20 * i}) for i in range(11)]
    features = ["max_force", "max_force_rate", "contact_area_rate"]
    vector = vector_of(FLAT, frames, features, 5).reshape(3, 5)
    assert vector[0] == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.0])
    assert vector[1] == pytest.approx([2.0] * 5)
    assert vector[2].tolist() == [0.0] * 5


def test_force_motion_follows_the_force_where_the_area_stays():
    layout = replace(FLAT, pitch_m=0.01)
    frames = [
        pressed(layout, t, {(1, 1): 50, (1, 2): f})
        for t, f in ((0, 50), (0.5, 150), (1, 50))
    ]
    vector = vector_of(layout, frames, ["contact_motion", "force_motion"], 3)
    assert vector == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.0025, 0.0], abs=1e-17)


def test_of_two_readings_of_one_instant_the_later_counts_for_every_feature():
    readings = (0.0, {(1, 1): 50}), (0.1, {(1, 1): 50}), (0.1, {(1, (1, 2)): 70})
    frames = [pressed(FLAT, *reading) for reading in readings]
    features = [*ALL[:3], "skin_force", "force_motion"]
    series = series_of(FLAT, frames, features)
    assert integers_of(series).shape == (2, 4 + 8 * 2)
    assert series.zones["skin"][:, 2].tolist() == [50, 140]
    assert series.force_motion.shape == series.motion.shape == (2,)


def test_zones_that_no_feature_calls_for_are_not_measured():
    assert list(series_of(FLAT, TWO_FRAMES, ["skin_force"]).zones) == ["skin"]
    assert series_of(FLAT, TWO_FRAMES, ["max_force", "contact_area"]).zones == {}


@pytest.mark.parametrize(
    ("features", "sentence"),
    [
        (["skin_forse"], "no feature 'skin_forse'; the nearest are skin_force"),
        (["max_force@1"], "must be taken at 2 to 10000 times"),
        (["zone_kernels_mean"], "takes no transform, summary or number of times"),
        (["log_sqrt_log_max_force"], "applies one transform twice"),
        (
            ["sqrt_log_joint_change"],
            "may be negative and has no logarithm; take sqrt_joint_change",
        ),
        ([], "no feature named"),
        (["max_force", "skin_area", "max_force"], "max_force is named twice"),
    ],
)
def test_a_wrong_name_is_one_sentence(features, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        feature_types(tuple(features))
    assert "\n" not in str(caught.value)


def test_a_feature_that_was_not_measured_is_one_sentence():
    series = series_of(FLAT, TWO_FRAMES, ["max_force"])
    with pytest.raises(InputError, match="stiffness was not measured"):
        feature_vector(series, 1.0, 2, ["stiffness"])


@pytest.mark.parametrize("shape", [(3, 5), (17, 31), (1, 700)])
def test_a_cell_is_the_sum_of_its_readable_taxels_and_dead_cells_are_left_out(shape):
    rows, cols = shape
    rng = np.random.default_rng(cols)
    dead = rng.permutation(rows * cols)[: rows * cols // 2]
    layout = SkinLayout(rows, cols, dead=tuple(sorted(dead.tolist())))
    counts = rng.integers(0, 65536, shape).astype(np.uint16)
    valid = rng.random(shape) < 0.8
    cells = Cells(layout)
    readable = counts.astype(int) * valid
    squares = [
        np.s_[row : row + cells.side, col : col + cells.side]
        for row in range(0, rows, cells.side)
        for col in range(0, cols, cells.side)
    ]
    expected = [int(readable[s].sum()) for s in squares if layout.alive[s].any()]
    assert cells.read(Frame(0.0, counts, valid=valid)).tolist() == expected
    assert len(expected) == cells.count


def test_the_papers_three_come_first():
    assert PAPER == ("max_force", "contact_area", "contact_motion") == tuple(ALL[:3])
