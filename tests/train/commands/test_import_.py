"""Thresholds from the noise, of imported recordings."""

import numpy as np

from edge.record.recording import load
from tests.edge.test_writing import left_by_a_dead_run
from train.__main__ import main


def write_trial(folder, name, touch, frames):
    (folder / "csv").mkdir(exist_ok=True)
    np.savez(folder / "csv" / f"{name}.npz", t=touch.t, frames=frames)


def test_a_name_too_long_to_be_looked_up_is_one_sentence(tmp_path, refusal):
    file = tmp_path / f"{'n' * 300}.csv"
    message = refusal("import", "csv", file, "--out", tmp_path / "out")
    assert message == f"edge-classify: {file}: no such file or folder"


def test_data_without_thresholds_get_those_of_their_noise(make_touch, tmp_path, capsys):
    noise = np.random.default_rng(0).integers(0, 41, (20, 16, 24)).astype(np.uint16)
    for seed in range(2):
        touch = make_touch(seed=seed, seconds=0.1, lead_s=0.1, arm=False)
        write_trial(tmp_path, f"trial{seed}", touch, np.maximum(touch.frames, noise))
    words = ["import", "csv", str(tmp_path / "csv"), "--out"]
    assert main([*words, str(tmp_path / "out")]) == 0
    assert (
        "threshold 80 and onset 120 counts, from the noise before contact: 2 of 2 have "
        "a" in capsys.readouterr().out
    )
    layout = load(tmp_path / "out" / "trial0.npz").layout
    assert layout.threshold_counts == 80
    assert layout.onset == 120
    (tmp_path / "csv" / "skin.json").write_text('{"threshold_counts": 90}')
    assert main([*words, str(tmp_path / "own")]) == 0
    assert "noise" not in capsys.readouterr().out
    assert load(tmp_path / "own" / "trial0.npz").layout.threshold_counts == 90


def test_a_taxel_that_is_constant_in_the_whole_set_is_named(
    make_touch, tmp_path, capsys
):
    for seed in range(3):
        touch = make_touch(seed=seed, seconds=0.1, lead_s=0.1, arm=False)
        touch.frames[:, 0, 5] = 7
        write_trial(tmp_path, f"trial{seed}", touch, touch.frames)
    words = ["import", "csv", str(tmp_path / "csv"), "--out"]
    assert main([*words, str(tmp_path / "out")]) == 0
    assert "[0, 5]; `edge-classify export --dead 0,5`" in "".join(capsys.readouterr())


def test_warnings_that_are_alike_are_counted(make_touch, tmp_path, capsys):
    for name in "abc":
        touch = make_touch(seconds=0.05, lead_s=0.0, arm=False)
        write_trial(tmp_path, name, touch, touch.frames + 500)
    (tmp_path / "csv" / "skin.json").write_text('{"threshold_counts": 90}')
    out = tmp_path / "out"
    leftover = left_by_a_dead_run(out)
    words = ["import", "csv", str(tmp_path / "csv"), "--counts"]
    main([*words, "--out", str(out)])
    assert not leftover.exists()
    lines = capsys.readouterr().err.splitlines()
    (warning,) = [line for line in lines if "its first frame is above" in line]
    assert warning.startswith(f"edge-classify: {out / 'a.npz'}: ")
    assert "edge-classify: 2 more warnings like these" in lines
