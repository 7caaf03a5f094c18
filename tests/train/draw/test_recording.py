"""A recording as a picture, with or without a contact."""

from dataclasses import replace

import pytest
from matplotlib.image import imread

from edge import demo
from edge.recording import load
from edge.saving import save
from tests.edge.test_recording import sheared
from train.__main__ import main
from train.draw.recording import draw

TOUCH = demo.recordings()[0]


@pytest.mark.parametrize("beside", [[], [str(TOUCH)]])
def test_a_label_with_dollar_signs_is_no_formula(tmp_path, beside):
    touch = load(TOUCH)
    labels = {"object": r"a $\frac$ b"}
    save(tmp_path / "a.npz", replace(touch, meta={**touch.meta, "labels": labels}))
    assert main(["show", str(tmp_path / "a.npz"), *beside]) == 0


def test_shear_adds_arrows(tmp_path):
    plain = tmp_path / "plain.png"
    assert main(["show", str(TOUCH), "--out", str(plain)]) == 0
    draw(sheared(load(TOUCH)), tmp_path / "arrows.png")
    without, arrows = (imread(path) for path in (plain, tmp_path / "arrows.png"))
    assert without.shape == arrows.shape
    white = (arrows == 1.0).all(axis=2).sum() - (without == 1.0).all(axis=2).sum()
    assert white > 100


def test_a_recording_without_contact_is_drawn(make_touch, tmp_path):
    save(tmp_path / "quiet.npz", make_touch(seconds=0.0, arm=False))
    assert main(["show", str(tmp_path / "quiet.npz")]) == 0
    assert (tmp_path / "quiet.png").read_bytes().startswith(b"\x89PNG")
