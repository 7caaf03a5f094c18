"""`view`, as a user runs it over the fake: a picture at a bounded rate."""

import os
import pty

import numpy as np

from edge.tools import view
from tests.conftest import started


def test_view_draws_the_skin_at_a_bounded_rate(edge, exported, recordings):
    options = ("--fake", recordings / "hard_0.npz", "--model", exported / "model.onnx")
    status, text, err = edge("view", *options, text=True)
    assert status == 0
    assert err == ""
    pictures = text.split("\x1b[H")[1:]
    assert len(pictures) == 18  # 1.8 s at ten a second
    assert " 1.400 s  category   rigid-fixed " in pictures[-1]
    assert "taxels at row" in pictures[-1]
    assert pictures[-1].count("▀") == 8 * 24 * 2
    assert max(map(len, pictures)) < 4000
    assert text.endswith("\x1b[0m\x1b[?25h")


def test_view_draws_a_picture_each_time_one_is_due(edge, recordings, monkeypatch):
    """Half a frame early or late, so that a clock that shifts by less does not skip
    one."""
    times = []
    monkeypatch.setattr(view, "draw", lambda frame, *rest: times.append(frame.t) or ".")
    options = ("--fake", recordings / "hard_0.npz", "--seconds", 0.6)
    assert edge("view", *options, text=True)[0] == 0
    assert np.round(np.diff(times), 2).tolist() == [0.1] * 5


def test_a_terminal_that_goes_away_ends_view_with_a_sentence(recordings):
    terminal, own_side = pty.openpty()
    options = ("--loop", "--fake", recordings / "hard_0.npz")
    process = started("view", *options, stdin=own_side, stdout=own_side)
    os.close(own_side)
    os.read(terminal, 100)
    os.close(terminal)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert err.startswith(
        "edge-classify: standard output cannot be written: Input/output error"
    )
    assert err.count("\n") == 1
