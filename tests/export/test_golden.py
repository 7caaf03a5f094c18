"""What a golden file is made of."""

import numpy as np
import pytest

from edge.model.model import Model
from edge.model.verify import _told_apart, twins
from export.golden import paired, trials_of, trimmed
from train.dataset import load_trials


@pytest.fixture(scope="module")
def data(recordings):
    return load_trials(sorted(recordings.iterdir()))


@pytest.mark.parametrize("count", [1, 4, 16, 100])
def test_the_trials_spread_over_the_labels_of_the_finest_task(data, count):
    chosen = trials_of(data, count)
    assert chosen == sorted(set(chosen))
    assert len(chosen) == min(count, 16)
    if count >= 4:
        assert {data.labels("object")[i] for i in chosen} == set(data.labels("object"))


def test_trimming_keeps_every_frame_that_the_window_uses(exported, data):
    model = Model(exported / "model.onnx")
    for trial in data.trials[::5]:
        part = trimmed(trial.recording, trial.onset_s, model)
        end = trial.onset_s + model.info.window_s
        assert trial.onset_s - 0.26 <= part.t[0] <= trial.onset_s
        assert part.t[-1] > end or len(part.t) == len(trial.recording.t)
        assert part.valid.shape == part.frames.shape


def test_the_vectors_are_trials_training_rows_mixtures_and_two_that_are_not_finite(exported):
    golden = np.load(exported / "golden.npz")
    trials, vectors = len(golden["onset_s"]), golden["vectors"]
    finite = np.isfinite(vectors).all(axis=1)
    assert finite[:-2].all()
    assert not finite[-2:].any()
    for task in ("category", "object"):
        assert (golden[f"{task}_label"] == np.where(finite, golden[f"{task}_label"], -1)).all()
    assert (golden["object_distances"][: trials + 16, 0] == 0.0).all()


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 1.0, 1e9, 1e300])
def test_twins_are_vectors_that_only_float64_tells_apart(scale):
    vectors = scale * np.random.default_rng(0).normal(size=(5, 12))
    pairs = np.concatenate([vectors, paired(vectors), [[np.nan] * 12] * 2, [[np.inf] * 12] * 2])
    assert twins(pairs).tolist() == [5, 7, 9, 11, 13]
    assert (pairs[5] / vectors[0]).tolist() == pytest.approx([1.0] * 12, abs=2.0**-24)


@pytest.mark.parametrize("scale", [1e-18, 1.0, 1e6, 1e40])
def test_distances_in_float32_are_found_out_at_any_scale(exported, scale):
    model = Model(exported / "model.onnx")
    vectors = paired(scale * np.arange(1.0, 13.0).reshape(4, 3))
    expected = np.linalg.norm(vectors, axis=1, keepdims=True)
    arrays = {f"{task}_distances": expected for task in model.info.tasks}
    with np.errstate(over="ignore"):
        single = expected.astype(np.float32).astype(np.float64)  # of 1e40 it makes infinity
    (right,) = _told_apart(model, vectors, arrays, arrays)
    (wrong,) = _told_apart(model, vectors, dict.fromkeys(arrays, single), arrays)
    assert (right.passed, right.rows, wrong.passed) == (True, 4, False)
