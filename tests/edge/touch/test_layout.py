"""Geometry of a skin against the real one's taxel positions."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.layout import SkinLayout, differences, for_device
from tests.conftest import FOREARM

ANGLES = [
    -82.05,
    -67.25,
    -52.44,
    -37.22,
    -22.42,
    -7.61,
    7.61,
    22.42,
    37.22,
    52.44,
    67.25,
    82.05,
]
ANGLES += [97.95, 112.75, 127.56, 142.78, 157.58, 172.39]
ANGLES += [-172.39, -157.58, -142.78, -127.56, -112.75, -97.95]

CODY = replace(FOREARM, radius_m=0.0460375, column_angles_deg=tuple(ANGLES))


def test_taxels_lie_where_those_of_the_real_forearm_lie(real):
    centres = np.load(real / "meka_forearm_taxel_array_16x24.npz")["centers"]
    ours = np.array([[CODY.position(r, c) for c in range(24)] for r in range(16)])
    assert np.abs(ours - centres).max() < 1e-6  # the file's own digits


def test_between_columns_the_shorter_way_round_is_taken():
    x, y, _ = CODY.position(0, 17.5)  # between 172.39 and -172.39 degrees
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(180.0)
    x, y, _ = CODY.position(0, 23.5)  # across the seam, between -97.95 and -82.05
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(-90.0)
    assert CODY.position(0, 24.0) == pytest.approx(CODY.position(0, 0.0))


def test_a_flat_skin_lies_in_the_plane():
    flat = SkinLayout(3, 5, pitch_m=(0.002, 0.003))
    assert flat.position(2, 4) == (0.012, 0.004, 0.0)
    assert SkinLayout(3, 5).position(2, 4) == (4.0, 2.0, 0.0)


def test_units_say_what_is_known():
    assert SkinLayout(1, 1).force_unit == "count"
    assert SkinLayout(1, 1).length_unit == "taxel"
    scaled = SkinLayout(1, 1, pitch_m=0.01, counts_per_newton=1000.0)
    assert scaled.force_unit == "newton"
    assert scaled.length_unit == "metre"


def test_metadata_round_trip():
    layout = SkinLayout(
        16,
        24,
        True,
        (0.0108, 0.01205),
        0.046,
        0.18,
        tuple(ANGLES),
        1000.0,
        100,
        150,
        (3, 7),
        0.25,
    )
    assert SkinLayout.from_dict(layout.to_dict()) == layout
    assert not SkinLayout.from_dict({"rows": 3, "cols": 4}).wraps
    assert not layout.alive[0, 3]
    assert layout.alive.sum() == 382


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"rows": None}, "rows is missing"),
        ({"cols": 1025}, "1 to 1024"),
        ({"pitch_m": [0.1]}, "a list of 2 numbers"),
        ({"radius_m": 0.05}, "needs pitch_m"),
        ({"release_s": 61.0}, "1e-09 to 60, not 61.0"),
        ({"threshold_counts": 50, "onset_counts": 40}, "below"),
        ({"column_angles_deg": [0.0]}, "a list of 4 numbers"),
        ({"dead": [12]}, "dead has a taxel"),
    ],
)
def test_what_makes_no_sense_names_its_key_and_the_file(change, word):
    skin = {"rows": 3, "cols": 4, **change}
    with pytest.raises(InputError, match=word) as caught:
        SkinLayout.from_dict(skin, where="skin.toml")
    assert "skin.toml" in str(caught.value)


def test_thresholds_stay_counts_however_far_the_scales_differ():
    device = replace(FOREARM, counts_per_newton=1e308)
    matched = for_device(replace(FOREARM, counts_per_newton=1e-5), device)
    assert matched.threshold_counts == 65535
    assert matched.onset == 65535


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"dead": (3, 4)}, "2 taxels are dead that were alive in training"),
        ({"counts_per_newton": 900.0}, "a newton is 900 counts, and 1000 in training"),
        ({"pitch_m": 0.02}, "taxels are 20 x 20 mm apart, and 10 x 10 mm in training"),
    ],
)
def test_what_differs_from_the_models_skin_is_said(changes, sentence):
    model = SkinLayout(4, 4, counts_per_newton=1000.0, pitch_m=0.01)
    (difference, *_) = differences(model, replace(model, **changes))
    assert sentence in difference
    assert differences(model, model) == []
