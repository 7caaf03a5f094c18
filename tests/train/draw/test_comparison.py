"""Touches side by side: a column each, with its decision."""

import pytest
from matplotlib import image

from edge import demo
from edge.errors import InputError
from edge.model.model import Model
from edge.recording import load
from train.__main__ import main
from train.draw import comparison

TOUCHES = [str(path) for path in demo.recordings()]


def test_the_command_draws_several_with_the_decisions_of_a_model(tmp_path, drawn):
    out = tmp_path / "four.png"
    assert main(["show", *TOUCHES, "--model", str(demo.MODEL), "--out", str(out)]) == 0
    assert out.read_bytes()[:4] == b"\x89PNG"
    (figure,) = drawn
    said = [text.get_text() for axis in figure.axes for text in axis.texts]
    assert [text.split("\n")[0] for text in said] == [
        f"decided: {load(path).labels['category']}" for path in TOUCHES
    ]
    titles = [axis.get_title() for axis in figure.axes if axis.get_title()]
    assert titles[0] == "rigid, fixed\ncardboard box"
    # The curves of a row share their scale, and each is inside it.
    for axis in figure.axes[4:16]:
        (line,) = (curve for curve in axis.lines if len(curve.get_xdata()) > 2)
        assert axis.get_ylim()[0] == 0.0
        assert max(line.get_ydata()) <= axis.get_ylim()[1]


def test_a_dark_page_gets_light_lines_on_a_dark_background(tmp_path):
    for name, words in (("light", []), ("dark", ["--dark"])):
        out = tmp_path / f"{name}.png"
        assert main(["show", *TOUCHES[:2], *words, "--out", str(out)]) == 0
        corner = image.imread(out)[0, 0, :3]
        assert (corner.mean() < 0.1) == (name == "dark")


def test_too_many_or_an_empty_one_are_refused(make_touch, tmp_path):
    with pytest.raises(InputError, match="give 6"):
        comparison.draw([("a", make_touch())] * 7, tmp_path / "a.png")
    quiet = make_touch(seconds=0.0, arm=False)
    with pytest.raises(InputError, match=r"quiet.npz: holds no contact"):
        comparison.draw(
            [("quiet.npz", quiet)], tmp_path / "a.png", model=Model(demo.MODEL)
        )


@pytest.mark.parametrize(
    "words",
    [
        [*TOUCHES, "--scene"],
        [TOUCHES[0], "--scene", "--model", str(demo.MODEL)],
        [TOUCHES[0], "--dark"],
    ],
)
def test_options_that_do_not_go_together_are_one_sentence(words, capsys, tmp_path):
    assert main(["show", *words, "--out", str(tmp_path / "a.png")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
