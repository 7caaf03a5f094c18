"""Why a touch was decided so, as a picture: its curves over those of the nearest
trials."""

import numpy as np
import pytest

from edge.record.saving import save
from train.__main__ import main


@pytest.fixture(scope="module")
def figure(exported, recordings, tmp_path_factory, make_touch, drawn):
    """The picture of a soft touch, category above and object below."""
    path = tmp_path_factory.mktemp("touch") / "new.npz"
    save(path, make_touch(kind="soft", seed=9))
    model = ["--model", str(exported / "model.onnx"), "--data", str(recordings)]
    assert main(["show", str(path), *model]) == 0
    assert path.with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    (figure,) = drawn
    return figure


def legend(figure):
    return [text.get_text() for text in figure.subfigs[0].legends[0].get_texts()]


def test_each_task_has_its_answer_as_title(figure):
    category, thing = figure.subfigs
    assert category.get_suptitle() == "category: soft-fixed"
    assert thing.get_suptitle().startswith("object: soft ")


def test_the_nearest_trials_stand_between_the_touch_and_the_nearest_rival(figure):
    first, second, *_, last = legend(figure)
    assert first == "this touch"
    assert second.startswith("soft_")
    assert last.startswith("hard_")


def test_each_trial_of_the_legend_has_a_curve_of_its_own_style(figure):
    lines = figure.subfigs[0].axes[0].lines
    styles = {(line.get_marker(), line.get_linestyle()) for line in lines}
    assert len(styles) == len(lines) == len(legend(figure))


def test_the_curves_end_with_the_window(figure):
    touch, *nearest = (line.get_xdata() for line in figure.subfigs[0].axes[0].lines)
    assert max(touch) <= 1.2
    assert set(map(len, nearest)) == {len(touch)}


def test_the_strongest_pull_comes_first(figure):
    widths = [bar.get_width() for bar in figure.subfigs[0].axes[-1].patches]
    assert np.all(np.diff(np.abs(widths)) <= 0)


def test_a_folder_without_the_trials_is_one_sentence(
    exported,
    tmp_path,
    make_touch,
    refusal,
):
    save(tmp_path / "new.npz", make_touch(kind="soft", seed=9))
    message = refusal("show", tmp_path / "new.npz", "--model", exported / "model.onnx")
    assert "holds none of the nearest trials, such as soft_" in message
    assert message.endswith("name their folder by --data")
