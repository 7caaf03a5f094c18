"""Touches as a picture: a column each, with its decision."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure

from edge import demo
from edge.decide.model import Model
from edge.errors import InputError
from edge.record.recording import load
from edge.record.saving import save
from train.__main__ import main
from train.draw import draw

TOUCHES = [str(path) for path in demo.recordings()]


@pytest.fixture(scope="module")
def axes(tmp_path_factory):
    """(4, 4) axes of four touches with a model's decisions, a column each."""
    out = tmp_path_factory.mktemp("picture") / "four.png"
    words = [*TOUCHES, "--model", str(demo.MODEL), "--out", str(out)]
    figures = []
    save_figure = Figure.savefig

    def spy(figure, *arguments, **options):
        figures.append(figure)
        save_figure(figure, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", spy)
        assert main(["show", *words]) == 0
    assert out.read_bytes()[:4] == b"\x89PNG"
    return np.reshape(figures[0].axes[:16], (4, 4))


def test_each_decision_stands_below_its_touch(axes):
    for axis, path in zip(axes[3], TOUCHES, strict=True):
        (text,) = axis.texts
        label = load(path).labels["category"]
        assert text.get_text().startswith(f"decided: {label}\n")


def test_a_column_has_kind_and_object_as_title(axes):
    assert axes[0, 0].get_title() == "rigid, fixed\ncardboard box"


def test_the_curves_of_a_row_share_a_scale_that_holds_each_of_them(axes):
    for axis in axes[1:].flat:
        assert axis.get_ylim()[0] == 0.0
        assert max(axis.lines[0].get_ydata()) <= axis.get_ylim()[1]


def test_a_dark_page_gets_light_lines_on_a_dark_background(tmp_path):
    out = tmp_path / "a.png"
    for dark in ([], ["--dark"]):
        assert main(["show", TOUCHES[0], *dark, "--out", str(out)]) == 0
        corner = image.imread(out)[0, 0, :3]
        assert (corner.mean() < 0.1) == bool(dark)


def test_too_many_or_an_empty_one_are_refused(make_touch, tmp_path):
    with pytest.raises(InputError, match="give 6"):
        draw([("a", make_touch())] * 7, tmp_path / "a.png")
    quiet = make_touch(seconds=0.0, arm=False)
    with pytest.raises(InputError, match=r"quiet.npz: holds no contact"):
        draw(
            [("quiet.npz", quiet)],
            tmp_path / "a.png",
            model=Model(demo.MODEL),
        )


def test_touches_in_other_units_do_not_share_an_axis(make_touch, tmp_path):
    touch = make_touch()
    counts = {**touch.meta["skin"], "counts_per_newton": None}
    in_counts = replace(touch, meta={**touch.meta, "skin": counts})
    with pytest.raises(InputError, match="b: has other units than the first"):
        draw([("a", touch), ("b", in_counts)], tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()


def test_a_label_with_dollar_signs_is_no_formula(tmp_path):
    touch = load(TOUCHES[0])
    labels = {"object": r"a $\frac$ b"}
    save(tmp_path / "a.npz", replace(touch, meta={**touch.meta, "labels": labels}))
    assert main(["show", str(tmp_path / "a.npz")]) == 0
    assert (tmp_path / "a.png").exists()
