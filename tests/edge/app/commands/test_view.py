"""`view`, as a user runs it over the fake: a picture at a bounded rate."""

import numpy as np
import pytest

from edge.app.commands import view
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout


@pytest.fixture
def person(monkeypatch):
    """Output is for a person, though no terminal plays the recording in real time."""
    monkeypatch.setattr(view.Output, "of", lambda _: view.Output(as_json=False))


@pytest.mark.usefixtures("person")
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


def test_a_pipe_is_refused(refused, recordings):
    err = refused("view", "--fake", recordings / "hard_0.npz")
    assert "give it a terminal or --web; `edge-classify run` prints JSON lines" in err


LAYOUT = SkinLayout(rows=4, cols=4, threshold_counts=100, wraps=False)


def frame(*places, value=1000, valid=None):
    counts = np.zeros((4, 4), dtype=np.uint16)
    for row, col in places:
        counts[row, col] = value
    return Frame(t=1.25, counts=counts, valid=valid)


def drawn(f):
    colours, regions = view.skin_colours(f, LAYOUT, 5000)
    return regions, colours


def test_a_region_is_red_to_white_by_force_and_the_rest_grey():
    colours = [drawn(frame((1, 1), value=v))[1] for v in (101, 500, 1500, 5000, 65535)]
    touched = [int(c[1, 1]) for c in colours]
    assert touched == sorted(touched, key=view.TOUCH.index)
    assert len(set(touched)) == 4
    assert touched[0] == view.TOUCH[0]
    assert touched[-1] == view.TOUCH[-1]
    assert (colours[0][0] == view.REST[0]).all()
    assert drawn(frame((1, 1), value=100))[1][1, 1] == view.REST[-1]


def test_a_taxel_that_cannot_be_read_is_blue():
    valid = np.ones((4, 4), dtype=bool)
    valid[2, 3] = False
    colour = drawn(frame((1, 1), valid=valid))[1]
    assert np.argwhere(colour == view.LOST).tolist() == [[2, 3]]


def test_no_color_draws_digits_by_force(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    colours = np.array([[view.REST[0], view.TOUCH[0]], [view.LOST, view.TOUCH[-1]]])
    assert view.picture(colours) == "..11\n??BB"
    text = view.draw(frame((1, 1)), LAYOUT, [])
    assert "\x1b" not in text
    assert "1 to B: in contact" in text


def test_the_caption_is_for_a_person():
    f = frame((1, 1), (1, 2), (3, 0))
    regions = drawn(f)[0]
    assert view.caption(f, regions, LAYOUT) == (
        "     1.25 s  |  1000 counts on 2 taxels at row 1.0, column 1.5  |  1 more"
    )
    valid = np.ones((4, 4), dtype=bool)
    valid[0] = False
    assert view.caption(frame(valid=valid), [], LAYOUT).endswith(
        "no contact  |  4 of 16 taxels cannot be read"
    )
