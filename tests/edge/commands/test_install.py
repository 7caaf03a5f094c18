"""A model takes the place of another, and gives it back."""

import shutil

import pytest

from edge.commands import install
from edge.model.model import Model


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
    (folder / "golden.npz").write_bytes(b"former golden")
    return folder / "model.onnx"


def test_a_verified_model_takes_the_place_of_the_former_one_which_is_kept(
    edge, new, running
):
    status, (event,), _ = edge("install", new, "--to", running)
    assert status == 0
    assert event == {"event": "installed", "version": Model(new).version}
    assert running.read_bytes() == new.read_bytes()
    assert running.with_name("model.onnx.former").read_bytes() == b"former model"
    assert running.with_name("golden.npz.former").read_bytes() == b"former golden"


def test_the_former_model_comes_back_once(edge, new, running):
    shutil.copy(new, running)
    shutil.copy(new.with_name("golden.npz"), running.with_name("golden.npz"))
    edge("install", new, "--to", running)
    assert edge("install", "--back", "--to", running)[0] == 0
    assert sorted(path.name for path in running.parent.iterdir()) == [
        "golden.npz",
        "model.onnx",
    ]
    status, _, err = edge("install", "--back", "--to", running)
    assert status == 2
    assert "has no former model to go back to" in err


@pytest.mark.parametrize("damage", ["model", "golden", "missing"])
def test_a_model_that_does_not_verify_leaves_the_former_one(
    edge, new, running, damage, exported
):
    golden = new.with_name("golden.npz")
    if damage == "model":
        new.write_bytes(new.read_bytes()[:-100])
    elif damage == "golden":
        golden.write_bytes(b"PK")
    else:
        golden.unlink()
    status, _, err = edge("install", new, "--to", running)
    assert status == 2
    assert str(new.parent) in err
    assert running.read_bytes() == b"former model"


def test_a_service_that_does_not_run_with_the_new_model_gets_the_former_one(
    edge, new, running, monkeypatch
):
    restarted = []
    monkeypatch.setattr(install, "restart", restarted.append)
    monkeypatch.setattr(install, "runs_on", lambda is_active: False)
    status, _, err = edge("install", new, "--to", running, "--service", "robot")
    assert status == 1
    assert "the former model is back" in err
    assert running.read_bytes() == b"former model"
    assert restarted == ["robot", "robot"]


def test_a_machine_without_systemd_is_told_so(edge, new, running, monkeypatch):
    monkeypatch.setenv("PATH", "")
    status, _, err = edge("install", new, "--to", running, "--service", "robot")
    assert status == 2
    assert "robot cannot be restarted with systemctl: No such file or directory" in err


def test_a_service_is_watched_for_a_minute():
    looks = iter([True] * 29 + [False])
    slept = []
    assert not install.runs_on(lambda: next(looks), sleep=slept.append)
    assert sum(slept) == install.PROVE_S
    assert install.runs_on(lambda: True, sleep=slept.append)
