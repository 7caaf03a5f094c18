"""A model of other features: the board measures those that its metadata names."""

import json

import numpy as np
import pytest

from edge.decide.metadata import to_json
from edge.decide.model import Model
from edge.decide.verify import verify
from edge.errors import InputError
from tests.conftest import export
from train.data.dataset import Measurement, load_trials

SIX = "skin_force right_length left_width skin_slant skin_area contact_area_rate@10".split()


@pytest.fixture(scope="module")
def six(recordings, tmp_path_factory):
    words = "--scaling IV --projection pca --features".split()
    return export(tmp_path_factory.mktemp("six"), "--data", recordings, *words, *SIX)


def test_the_model_says_what_it_measures_and_in_which_units(six):
    info = Model(six / "model.onnx").info
    assert info.features == tuple(SIX)
    assert info.width == 5 * 40 + 10
    assert info.units["skin_force"] == "newton"
    assert info.units["contact_area_rate@10"] == "taxel/s"
    assert info.chain is None
    assert info.motion_frame == "skin"


def test_a_value_that_is_not_finite_is_named_by_its_feature_and_place(six):
    vector = np.zeros(210)
    vector[205] = -np.inf
    with pytest.raises(InputError, match="value 205 .*, of contact_area_rate@10"):
        Model(six / "model.onnx").decide(vector)


def test_its_golden_file_holds(six):
    checks = {c.name: c for c in verify(Model(six / "model.onnx"), six / "golden.npz")}
    assert all(check.passed for check in checks.values())
    assert checks["series counts"].rows > 1000


def test_kernels_ride_in_the_model_and_give_the_board_the_same_bits(
    recordings, tmp_path
):
    words = ("--quick", "--features", "kernels", "zone_kernels", "--tasks", "object")
    export(tmp_path, "--data", recordings, *words)
    model = Model(tmp_path / "model.onnx")
    biases = [len(table.biases) for table in model.info.kernels.values()]
    assert sum(biases) == model.info.width
    assert len(json.dumps(to_json(model.info))) < 20_000
    assert all(check.passed for check in verify(model, tmp_path / "golden.npz"))
    dataset = load_trials([recordings], Measurement(model.info.features)).with_kernels(
        1.2
    )
    vectors = [model.info.vector(trial.series) for trial in dataset.trials]
    assert (np.stack(vectors) == dataset.features(1.2)).all()
