"""The contents of a golden file."""

import numpy as np
import pytest

from edge.decide.model import Model
from export.golden import trials_of, trimmed
from tests.conftest import export
from train.data.dataset import load_trials


@pytest.fixture(scope="module")
def data(recordings):
    return load_trials(sorted(recordings.glob("*.npz")))


@pytest.mark.parametrize("count", [1, 4, 16, 100])
def test_the_trials_spread_over_the_labels_of_the_finest_task(data, count):
    trials = trials_of(data, count)
    assert trials == sorted(set(trials))
    assert len(trials) == min(count, 16)
    if count >= 4:
        assert {data.labels("object")[i] for i in trials} == set(data.labels("object"))


def test_trimming_keeps_every_frame_that_the_window_uses(exported, data):
    model = Model(exported / "model.onnx")
    for trial in data.trials[::5]:
        part = trimmed(trial.recording, trial.onset_s, model)
        end = trial.onset_s + model.info.window_s
        assert trial.onset_s - 0.26 <= part.t[0] <= trial.onset_s
        assert part.t[-1] > end or len(part.t) == len(trial.recording.t)
        assert part.valid.shape == part.frames.shape


def test_a_model_of_a_single_value_has_a_golden_file(recordings, tmp_path):
    words = "--features max_force_mean --projection pca --decision-points none".split()
    export(tmp_path, "--data", recordings, *words)
    vectors = np.load(tmp_path / "golden.npz")["vectors"]
    assert np.isnan(vectors[-2]).any()
    assert np.isinf(vectors[-1]).any()


def test_the_vectors_are_trials_training_rows_mixtures_and_two_that_are_not_finite(
    exported,
):
    golden = np.load(exported / "golden.npz")
    trials = len(golden["onset_s"])
    vectors = golden["vectors"]
    assert len(golden["start"]) == trials + 1 == 17
    finite = np.isfinite(vectors).all(axis=1)
    assert finite[:-2].all()
    assert not finite[-2:].any()
    for task in ("category", "object"):
        assert ((golden[f"{task}_label"] == -1) == ~finite).all()
        assert not golden[f"{task}_scores"][~finite].any()
    assert (golden["object_distances"][: trials + 16, 0] == 0.0).all()
    assert golden["frames"].dtype == np.uint16
