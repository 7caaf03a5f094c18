"""Why a touch was decided so, as a picture: its curves over those of the nearest
trials."""

import numpy as np

from edge.saving import save
from train.__main__ import main


def test_a_touch_is_drawn_over_the_trials_that_a_model_finds_nearest(
    exported, recordings, tmp_path, make_touch, drawn
):
    save(tmp_path / "new.npz", make_touch(kind="soft", seed=9))
    model = ["--model", str(exported / "model.onnx"), "--data", str(recordings)]
    assert main(["show", str(tmp_path / "new.npz"), *model]) == 0
    assert (tmp_path / "new.png").read_bytes()[:4] == b"\x89PNG"
    (figure,) = drawn
    category, thing = figure.subfigs
    assert category.get_suptitle() == "category: soft-fixed"
    assert thing.get_suptitle().startswith("object: soft ")
    texts = [text.get_text() for text in category.legends[0].get_texts()]
    assert [text[:5] for text in (*texts[:2], texts[-1])] == ["this ", "soft_", "hard_"]
    force, *_, pulls = category.axes
    touch, *nearest = force.lines
    assert len(nearest) == len(texts) - 1
    assert all(len(line.get_xdata()) == len(touch.get_xdata()) for line in nearest)
    assert max(touch.get_xdata()) <= 1.2
    assert len(
        {(line.get_marker(), line.get_linestyle()) for line in force.lines}
    ) == len(texts)
    widths = [bar.get_width() for bar in pulls.patches]
    assert np.all(np.diff(np.abs(widths)) <= 0)


def test_a_folder_without_the_trials_is_one_sentence(
    exported, tmp_path, make_touch, refusal
):
    save(tmp_path / "new.npz", make_touch(kind="soft", seed=9))
    said = refusal("show", tmp_path / "new.npz", "--model", exported / "model.onnx")
    assert "holds none of the nearest trials, such as soft_" in said
    assert said.endswith("name their folder by --data")
