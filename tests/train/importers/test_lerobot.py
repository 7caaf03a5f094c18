"""LeRobot data sets of both layouts, made here and imported through the command."""

import json

import numpy as np
import pandas as pd
import pytest

import edge
from train.__main__ import main

pytest.importorskip("pyarrow", reason="needs pyarrow")

N = 30
TAXELS = 6
TASKS = ("grasp the cup", "grasp the box")


def episode(number, *, axes=1):
    """The columns of an episode; counts tell their episode, frame and taxel."""
    counts = 100 * number + np.arange(N)[:, None] + 10 * np.arange(TAXELS)
    values = counts.astype(float)
    if axes == 3:
        values = np.stack([counts // 2, -(counts // 4), counts], axis=2)
    return pd.DataFrame(
        {
            "observation.tactile": list(values.tolist()),
            "observation.state": [[0.1 * i, -0.2 * i] for i in range(N)],
            "observation.temperature": np.full(N, 22.0),
            "timestamp": 0.02 * np.arange(N),
            "frame_index": np.arange(N),
            "episode_index": number,
            "task_index": number % 2,
        }
    )


def data_set(folder, version, **options):
    """A data set of four episodes."""
    meta = folder / "meta"
    meta.mkdir(parents=True)
    names = {"motors": ["shoulder", "elbow"]}
    features = {"observation.state": {"dtype": "float32", "names": names}}
    info = {"codebase_version": version, "features": features}
    (meta / "info.json").write_text(json.dumps(info))
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    episodes = [episode(number, **options) for number in range(4)]
    if version == "v2.1":
        lines = [
            json.dumps({"task_index": i, "task": task}) for i, task in enumerate(TASKS)
        ]
        (meta / "tasks.jsonl").write_text("\n".join(lines))
        for number, data in enumerate(episodes):
            data.to_parquet(chunk / f"episode_{number:06}.parquet")
    else:
        tasks = pd.DataFrame({"task_index": [0, 1]}, index=list(TASKS))
        tasks.to_parquet(meta / "tasks.parquet")
        pd.concat(episodes).to_parquet(chunk / "file-000.parquet")
    return folder


def imported(folder, out, *options):
    words = ["--taxels", "observation.tactile", "--out", str(out)]
    assert main(["import", "lerobot", str(folder), *words, *options]) == 0
    return [edge.load(path) for path in sorted(out.glob("*.npz"))]


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_an_episode_is_a_trial_and_its_task_the_label(tmp_path, version, capsys):
    folder = data_set(tmp_path / "set", version)
    recordings = imported(folder, tmp_path / "out", "--shape", "2x3")
    assert [r.labels["object"] for r in recordings] == [*TASKS, *TASKS]
    for number, recording in enumerate(recordings):
        expected = np.stack(episode(number)["observation.tactile"]).reshape(N, 2, 3)
        assert recording.frames.tolist() == expected.tolist()
        assert recording.t == pytest.approx(0.02 * np.arange(N))
        assert recording.joints is None
    output = capsys.readouterr().out
    assert 'taxels: "observation.tactile" (6, as 2 x 3), label: the episode' in output


def test_joints_come_with_their_names(tmp_path):
    folder = data_set(tmp_path / "set", "v2.1")
    joints = ("--joints", "observation.state")
    first = imported(folder, tmp_path / "out", *joints)[0]
    assert first.joint_names == ("shoulder", "elbow")
    assert first.joints[3] == pytest.approx([0.3, -0.6])
    assert first.frames.shape[1:] == (1, TAXELS)


def test_three_axes_are_shear(tmp_path, capsys):
    folder = data_set(tmp_path / "set", "v3.0", axes=3)
    options = ("--axes", "xyz", "--flip", "y", "--shape", "2x3")
    second = imported(folder, tmp_path / "out", *options)[1]
    sentence = "shear: x along the rows, y around the columns, y turned round"
    assert sentence in capsys.readouterr().out
    counts = second.frames.astype(int)
    assert counts[0].ravel().tolist() == [100, 110, 120, 130, 140, 150]
    assert (second.shear[..., 0] == counts // 2).all()
    assert (second.shear[..., 1] == counts // 4).all()


def rewritten(**columns):
    """The function that changes columns of the third episode of a data set."""

    def write(chunk):
        data = episode(2).assign(**columns)
        data.to_parquet(chunk / "episode_000002.parquet")

    return write


RAGGED = [[1.0] * TAXELS] * (N - 1) + [[1.0, 2.0]]


@pytest.mark.parametrize(
    ("change", "options", "sentence"),
    [
        (None, ("--taxels", "observation.skin"), "has no column observation.skin; it"),
        (None, ("--joints", "q"), "has no column q; it has"),
        (None, ("--axes", "xyz"), "needs values of x, y and z, not (6,)"),
        (
            rewritten(**{"observation.tactile": RAGGED}),
            (),
            "episode 2: observation.tactile does not hold numbers of one shape",
        ),
        (
            rewritten(**{"observation.tactile": [[1.0, 2.0]] * N}),
            (),
            "episode 2 has values (2,) a frame, but episode 0 (6,)",
        ),
        (
            lambda chunk: episode(2).to_parquet(chunk / "again.parquet"),
            (),
            "episode 2 stands in two files",
        ),
        (
            rewritten(episode_index=[2.0] * (N - 1) + [np.nan]),
            (),
            f"episode_000002.parquet: row {N} has no episode_index, which is a whole",
        ),
        (
            rewritten(episode_index=2.5),
            (),
            "episode_000002.parquet: row 1 has no episode_index",
        ),
        (
            rewritten(task_index=np.nan),
            (),
            "episode_000002.parquet: row 1 has no task_index",
        ),
        (
            rewritten(timestamp="noon"),
            (),
            "episode_000002.parquet: 'noon' in column timestamp is no number",
        ),
    ],
)
def test_what_does_not_suit_is_one_sentence(
    tmp_path,
    refusal,
    change,
    options,
    sentence,
):
    folder = data_set(tmp_path / "set", "v2.1")
    if change is not None:
        change(folder / "data" / "chunk-000")
    words = ("import", "lerobot", folder, "--out", tmp_path / "out")
    taxels = ("--taxels", "observation.tactile")
    assert sentence in refusal(*words, *taxels, *options)


def test_a_folder_that_is_no_data_set_is_refused(tmp_path, refusal):
    words = ("import", "lerobot", tmp_path, "--out", tmp_path / "out")
    assert "holds no meta/info.json" in refusal(*words, "--taxels", "x")
