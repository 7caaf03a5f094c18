"""Recordings as one long table, and back."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import edge
from train.__main__ import main

pytest.importorskip("pyarrow", reason="needs pyarrow")


@pytest.fixture
def folder(make_touch, tmp_path):
    """Two recordings with labels, joints, and a taxel that could not be read."""
    for number in range(2):
        touch = make_touch()
        valid = np.ones(touch.frames.shape, dtype=bool)
        valid[3, 4, 5] = number == 0
        labels = {"object": f"thing {number}", "softness": "soft"}
        touch = replace(touch, valid=valid, meta={**touch.meta, "labels": labels})
        edge.save(tmp_path / "in" / f"touch_{number}.npz", touch)
    return tmp_path / "in"


def loaded(folder):
    return [edge.load(path) for path in sorted(folder.glob("*.npz"))]


def saved(folder, form, *options):
    out = folder.parent / f"all.{form}"
    words = ["save", str(folder), "--as", form, "--out", str(out), *options]
    assert main(words) == 0
    return out


def test_a_table_has_a_row_for_each_frame(folder, capsys):
    table = pd.read_parquet(saved(folder, "parquet"))
    recordings = loaded(folder)
    assert len(table) == sum(len(r.t) for r in recordings)
    second = table[table["trial"] == "touch_1"]
    assert set(second["object"]) == {"thing 1"}
    assert second["t_s"].tolist() == recordings[1].t.tolist()
    counts = second["taxel_4_6"].to_numpy(dtype=int)
    assert counts.tolist() == recordings[1].frames[:, 4, 6].tolist()
    assert second["taxel_4_5"].isna().tolist() == [i == 3 for i in range(len(second))]
    assert "frames of 2 recordings" in capsys.readouterr().out


def test_import_reads_the_table_back(folder, tmp_path):
    recordings = loaded(folder)
    names = [f"joint_{name}" for name in recordings[0].joint_names or range(1, 6)]
    out = str(tmp_path / "back")
    table = str(saved(folder, "parquet"))
    joints = ("--joints", ",".join(names))
    assert main(["import", "csv", table, "--out", out, *joints]) == 0
    for recording, back in zip(recordings, loaded(tmp_path / "back"), strict=True):
        valid = recording.valid
        assert (back.frames * valid == recording.frames * valid).all()
        assert back.t == pytest.approx(recording.t - recording.t[0])
        assert back.joints == pytest.approx(recording.joints)
        assert back.labels == recording.labels


def test_hdf5_holds_an_array_for_each_quantity(folder):
    h5py = pytest.importorskip("h5py")
    recordings = loaded(folder)
    with h5py.File(saved(folder, "hdf5")) as file:
        frames = np.concatenate([r.frames for r in recordings])
        assert file["frames"][()].tobytes() == frames.tobytes()
        assert file["joints"].shape == (len(frames), 5)
        assert not file["valid"][len(recordings[0].t) + 3, 4, 5]
        objects = file["labels/object"].asstr()[()]
        assert sorted(set(objects)) == ["thing 0", "thing 1"]
        assert file["trial"].asstr()[0] == "touch_0"


def test_shear_has_columns_of_its_own(folder):
    for path in folder.glob("*.npz"):
        touch = edge.load(path)
        quarter = (touch.frames // 4).astype(np.int16)
        shear = np.stack([quarter, -quarter], axis=3)
        edge.save(path, replace(touch, shear=shear))
    table = pd.read_parquet(saved(folder, "parquet"))
    names = [name for name in table.columns if name.endswith("_along")]
    along = table[names].to_numpy()
    around = table[[name.replace("along", "around") for name in names]].to_numpy()
    assert along.max() > 0
    assert (around == -along).all()


def changed(folder, **meta):
    """Change metadata of the second recording."""
    path = folder / "touch_1.npz"
    touch = edge.load(path)
    edge.save(path, replace(touch, meta={**touch.meta, **meta}))


def refused(refusal, folder):
    """The sentence by which recordings are not saved."""
    out = folder.parent / "all.parquet"
    message = refusal("save", folder, "--as", "parquet", "--out", out)
    assert not out.exists()
    return message


def test_recordings_that_do_not_fit_together_are_named(folder, make_touch, refusal):
    edge.save(folder / "z.npz", make_touch(arm=False))
    message = refused(refusal, folder)
    assert "z.npz: its skin or joints are not those of" in message


def test_joints_of_other_names_are_not_saved_under_the_firsts(folder, refusal):
    changed(folder, joint_names=[f"other {i}" for i in range(5)])
    message = refused(refusal, folder)
    assert "touch_1.npz: its skin or joints are not" in message


@pytest.mark.parametrize("task", ["trial", "t_s", "taxel_0_0", "joint_1"])
def test_a_task_with_the_name_of_a_column_is_refused(folder, task, refusal):
    changed(folder, labels={task: "a"})
    message = refused(refusal, folder)
    assert "has the name of another column; save as hdf5" in message
