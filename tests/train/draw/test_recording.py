"""A recording as a picture, with or without a contact."""

from dataclasses import replace

import pytest

from edge import demo
from edge.record.recording import load
from edge.record.saving import save
from train.__main__ import main

TOUCH = demo.recordings()[0]


@pytest.mark.parametrize("beside", [[], [str(TOUCH)]])
def test_a_label_with_dollar_signs_is_no_formula(tmp_path, beside):
    touch = load(TOUCH)
    labels = {"object": r"a $\frac$ b"}
    save(tmp_path / "a.npz", replace(touch, meta={**touch.meta, "labels": labels}))
    assert main(["show", str(tmp_path / "a.npz"), *beside]) == 0


def test_a_recording_without_contact_is_drawn(make_touch, tmp_path):
    save(tmp_path / "quiet.npz", make_touch(seconds=0.0, arm=False))
    assert main(["show", str(tmp_path / "quiet.npz")]) == 0
    assert (tmp_path / "quiet.png").read_bytes().startswith(b"\x89PNG")
