"""`view`, as a user runs it over the fake: a picture at a bounded rate."""

from edge.commands import view


def test_view_draws_the_skin_at_a_bounded_rate(edge, exported, recordings):
    path = recordings / "hard_0.npz"
    status, text, err = edge("view", "--fake", path, "--model", exported / "model.onnx", "--rate",
                             5, text=True)  # fmt: skip
    assert (status, err) == (0, "")
    pictures = text.split("\x1b[H")[1:]
    # 1.8 s at five a second; while nothing changes nothing is sent.
    assert 5 <= len(pictures) <= 10
    assert "category: rigid-fixed (100%)" in pictures[-1]
    assert "object: hard " in pictures[-1]
    assert "taxels at row" in pictures[-1]
    assert pictures[-1].count("▀") == 8 * 24 * 2
    assert max(map(len, pictures)) < 4000
    assert text.endswith("\x1b[0m\x1b[?25h")


def test_view_draws_a_picture_each_time_one_is_due(edge, recordings, monkeypatch):
    """Half a frame early or late, so that a clock that shifts by less does not skip one."""
    drawn = []
    monkeypatch.setattr(view, "draw", lambda frame, *rest: drawn.append(frame.t) or ["."])
    assert edge("view", "--fake", recordings / "hard_0.npz", "--rate", 5, text=True)[0] == 0
    assert [round(t - drawn[0], 2) for t in drawn] == [round(0.2 * i, 2) for i in range(9)]
