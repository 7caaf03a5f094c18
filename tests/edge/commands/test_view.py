"""`view`, as a user runs it over the fake: a picture at a bounded rate."""

import io
import os

from edge.commands import view
from edge.skin.loop import Stop


def test_view_gives_a_picture_up_where_nobody_reads_once_it_is_told_to_end():
    reading, writing = os.pipe()
    with open(reading, "rb") as reader, open(writing, "w") as out:
        stop = Stop()
        send = view.sender(out, stop)
        send("▀" * 10)
        assert reader.read(30).decode() == "▀" * 10
        stop.asked = True
        send("a" * 10**6)
        out.close()
        assert 0 < len(reader.read()) < 10**6


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


def test_view_sends_each_picture_at_once_where_no_file_is_behind_its_output():
    class Shown(io.StringIO):
        shown = ""

        def flush(self):
            self.shown = self.getvalue()

    out = Shown()
    view.sender(out, Stop())("a picture")
    assert out.shown == "a picture"
