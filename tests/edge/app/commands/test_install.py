"""A model takes the place of another, and gives it back."""

import shutil
from pathlib import Path

import onnx
import pytest

from edge import writing
from edge.app.commands import install
from edge.decide.model import Model
from edge.decide.verify import golden_of
from tests.conftest import sealed
from tests.edge.killed import dies
from tests.edge.test_writing import left_by_a_dead_run


@pytest.fixture
def new(exported, tmp_path):
    """A new model with its golden file."""
    folder = tmp_path / "new"
    folder.mkdir()
    for name in ("model.onnx", "golden.npz"):
        shutil.copy(exported / name, folder / name)
    return folder / "model.onnx"


@pytest.fixture
def running(tmp_path):
    """The place of the model that a robot runs, with another file in it."""
    folder = tmp_path / "robot"
    folder.mkdir()
    (folder / "model.onnx").write_bytes(b"former model")
    return folder / "model.onnx"


@pytest.fixture
def installed(edge, new, running):
    """Install the new model."""
    return lambda *options: edge("install", new, "--to", running, *options)


def test_a_verified_model_takes_the_place_of_the_former_one_which_is_kept(
    installed,
    new,
    running,
):
    leftover = left_by_a_dead_run(running.parent)
    status, (event,), _ = installed()
    assert status == 0
    assert not leftover.exists()
    assert event == {"event": "installed", "version": Model(new).version}
    assert running.read_bytes() == new.read_bytes()
    assert running.with_name("model.onnx.former").read_bytes() == b"former model"


def test_only_one_program_at_a_time_installs_into_a_folder(
    installed, running, monkeypatch
):
    monkeypatch.setattr(writing, "LOOKS", 1)
    with writing.alone(running.parent, "installs a model"):
        assert installed()[0] == 2
    assert running.read_bytes() == b"former model"
    assert installed()[0] == 0


def test_an_installed_model_is_verified_with_the_golden_file_beside_it(
    edge, installed, running
):
    installed()
    assert edge("verify", "--model", running)[0] == 0


@pytest.fixture
def old(new, running):
    """The place of a running model that is as good as the new one."""
    former = onnx.load(new)
    former.doc_string = "former"
    running.write_bytes(sealed(former))
    return running.read_bytes()


def test_the_former_model_comes_back_and_the_new_one_stays_at_hand(
    edge, installed, new, old, running
):
    installed()
    for data in (old, new.read_bytes(), old):
        assert edge("install", "--back", "--to", running)[0] == 0
        assert running.read_bytes() == data


def test_without_a_former_model_there_is_no_way_back(edge, running):
    status, _, err = edge("install", "--back", "--to", running)
    assert status == 2
    assert "has no former model to go back to" in err


def test_a_damaged_former_model_does_not_come_back(edge, new, running):
    shutil.copy(new, running)
    former = running.with_name("model.onnx.former")
    former.write_bytes(new.read_bytes()[:999])
    status, _, err = edge("install", "--back", "--to", running)
    assert status == 2
    assert f"{former}: not an ONNX model" in err
    assert running.read_bytes() == new.read_bytes()


def test_a_model_that_cannot_be_placed_leaves_no_golden_file(edge, new, tmp_path):
    folder = tmp_path / "model.onnx"
    folder.mkdir()
    status, _, err = edge("install", new, "--to", folder)
    assert status == 2
    assert f"{folder}: cannot be written: it is not a regular file" in err
    assert not list(tmp_path.glob("golden-*"))


STEPS = (install, "_write"), (Path, "replace")


@pytest.mark.slow
@pytest.mark.parametrize("action", ["install", "back"])
def test_a_kill_at_any_step_loses_no_model_and_mixes_none(
    edge, installed, new, old, running, monkeypatch, action
):
    """The model that runs has its golden file, and both models are there."""
    installed()
    first = running.read_bytes()
    third = onnx.load(new)
    third.doc_string = "third"
    new.write_bytes(sealed(third))
    back = ("install", "--back", "--to", running)
    monkeypatch.setattr(install, "prove", lambda *words: None)
    for step in range(4):
        running.write_bytes(first)
        running.with_name("model.onnx.former").write_bytes(old)
        change = installed if action == "install" else lambda: edge(*back)
        dies(change, STEPS, step)
        models = [running.read_bytes()]
        golden = golden_of(running, Model(running).version)
        assert golden.is_file() == (models[0] != old)
        assert edge(*back)[0] == 0
        models.append(running.read_bytes())
        assert first in models
        assert models[0] != models[1]
        assert edge(*back)[0] == 0
        assert running.read_bytes() == models[0]


def test_golden_files_of_models_that_are_gone_are_removed(installed, new, running):
    versions = []
    for name in "abc":
        model = onnx.load(new)
        model.doc_string = name
        new.write_bytes(sealed(model))
        installed()
        versions.append(Model(new).version)
    names = {path.name for path in running.parent.glob("golden-*.npz")}
    assert names == {f"golden-{version}.npz" for version in versions[1:]}


def test_a_model_that_is_installed_twice_is_not_its_own_way_back(installed, running):
    for _ in range(2):
        assert installed()[0] == 0
    assert running.with_name("model.onnx.former").read_bytes() == b"former model"


@pytest.mark.parametrize("damage", ["model", "golden", "missing"])
def test_a_model_that_does_not_verify_leaves_the_former_one(
    installed,
    new,
    running,
    damage,
):
    golden = new.with_name("golden.npz")
    if damage == "model":
        new.write_bytes(new.read_bytes()[:-100])
    elif damage == "golden":
        golden.write_bytes(b"PK")
    else:
        golden.unlink()
    status, _, err = installed()
    assert status == 2
    assert str(new.parent) in err
    assert running.read_bytes() == b"former model"
