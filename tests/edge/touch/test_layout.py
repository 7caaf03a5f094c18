"""Geometry of a skin against the real one's taxel positions."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.layout import SkinLayout, differences, for_device
from edge.wire.skin import file as skinfile

CODY = skinfile.load(skinfile.shipped("cody")).layout


def test_taxels_lie_where_those_of_the_real_forearm_lie(real):
    centres = np.load(real / "meka_forearm_taxel_array_16x24.npz")["centers"]
    positions = np.array([[CODY.position(r, c) for c in range(24)] for r in range(16)])
    assert np.abs(positions - centres).max() < 4e-6  # the digits of the skin's file


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


def test_metadata_round_trip():
    layout = replace(CODY, dead=(3, 7), release_s=0.25, axes=3)
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


@pytest.mark.parametrize(
    ("scales", "threshold", "onset"),
    [((1000.0, 2000.0), 200, 300), ((1e-5, 1e308), 65535, 65535)],
)
def test_the_models_thresholds_become_counts_of_the_device(scales, threshold, onset):
    model, device = (
        SkinLayout(4, 6, counts_per_newton=scale, threshold_counts=n, dead=(n,))
        for scale, n in zip(scales, (10, 7), strict=True)
    )
    model = replace(model, threshold_counts=100, onset_counts=150, release_s=1.0)
    matched = replace(model, threshold_counts=threshold, onset_counts=onset)
    matched = replace(matched, counts_per_newton=device.counts_per_newton)
    assert for_device(model, device) == matched


@pytest.mark.parametrize(
    ("device", "word"),
    [
        (SkinLayout(5, 6), "5 x 6 taxels, flat.* made for 4 x 6"),
        (SkinLayout(4, 6, wraps=True), "closed around"),
        (SkinLayout(4, 6, counts_per_newton=1.0), "forces in newtons"),
        (SkinLayout(4, 6, pitch_m=0.1), "lengths in metres"),
    ],
)
def test_another_skin_is_refused(device, word):
    with pytest.raises(InputError, match=word):
        for_device(SkinLayout(4, 6), device)


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
