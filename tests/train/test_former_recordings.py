"""Recordings that stand beside those just written are named."""

from train.former_recordings import warnings


def test_recordings_that_were_not_written_now_are_counted_and_one_is_named(tmp_path):
    for name in ("a.npz", "b.npz", "within/c.npz", "golden.txt", ".deleted/d.npz"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    (sentence,) = warnings(tmp_path, [tmp_path / "a.npz"])
    assert "holds other recordings too: 2, such as b.npz" in sentence


def test_a_table_that_labels_what_was_written_is_named(tmp_path):
    (tmp_path / "a.npz").touch()
    assert list(warnings(tmp_path, [tmp_path / "a.npz"])) == []
    (tmp_path / "labels.csv").write_text("file,object\na.npz,cup\nb.npz,cup\n")
    (sentence,) = warnings(tmp_path, [tmp_path / "a.npz"])
    assert "labels.csv has rows for 1 of them" in sentence
