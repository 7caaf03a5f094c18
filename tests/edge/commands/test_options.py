"""Options that several commands share: numbers with limits, and the arm that carries
the skin."""

from dataclasses import replace

import numpy as np
import pytest

from edge import recording, saving
from edge.cli import main
from edge.touch.arm import Chain


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["fake", "--trials", "0"],
            "--trials: must be a whole number from 1 to 1000, not '0'",
        ),
        (["fake", "--seed", "1.5"], "--seed: must be a whole number from 0 to 9.2"),
        (
            ["record", "--length", "nan"],
            "--length: must be a number from 0.1 to 600, not 'nan'",
        ),
        (
            ["label", "a.npz", "--set", "object=a\nb"],
            "--set: must be TASK=LABEL, such as",
        ),
        (
            ["run", "--seconds", "soon"],
            "--seconds: must be a number from 0.001 to 1e+09",
        ),
    ],
)
def test_a_value_that_an_option_does_not_take_is_refused(options, said, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(options)
    assert said in capsys.readouterr().err


@pytest.fixture
def files(tmp_path, make_touch, urdf):
    """A URDF of two joints, and a recording of as many angles that names no arm."""
    (tmp_path / "still.toml").write_text('[[joint]]\nname="a"\naxis=[0,0,0]\n')
    trial = make_touch()
    swing = np.linspace(0.0, 0.2, len(trial.t))
    trial = replace(trial, joints=np.column_stack([swing, 0.5 + swing]))
    saving.save(tmp_path / "two.npz", trial)
    return tmp_path


@pytest.fixture
def record(edge, files):
    """Record the fake touch as a user does; returns status, stdout's lines and
    stderr."""
    given = (
        "--label",
        "object=a",
        "--fake",
        files / "two.npz",
        "--out",
        files / "out.npz",
    )
    return lambda *options: edge("record", *given, *options)


def test_a_trial_keeps_the_chain_of_a_urdf_or_of_a_toml_file(files, record):
    given = ("--arm", files / "arm.urdf", "--base", "base", "--tip", "lower")
    status, (event,), _ = record(*given)
    assert status == 0
    assert event["joints"]
    kept = Chain.from_dict(recording.load(files / "out.npz").meta["arm"])
    assert kept.names == ("shoulder", "elbow")
    assert kept.pose([0.0, 0.0])[0, 3] == 0.3
    (files / "out.npz").unlink()
    (files / "arm.toml").write_text(
        '[[joint]]\nname="a"\naxis=[0,0,1]\n[[joint]]\nname="b"\naxis=[0,1,0]\n'
    )
    assert record("--arm", files / "arm.toml")[0] == 0
    assert Chain.from_dict(recording.load(files / "out.npz").meta["arm"]).names == (
        "a",
        "b",
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--arm", "arm.urdf"], "a URDF needs --base and --tip"),
        (["--arm", "arm.urdf", "--base", "base", "--tip", "hand"], "no link 'hand'"),
        (
            ["--arm", "arm.urdf", "--base", "base", "--tip", "upper"],
            "gives 2 joint angles",
        ),
        (
            ["--arm", "arm.toml", "--tip", "skin"],
            "--base and --tip are for a .urdf file",
        ),
        (["--arm", "none.toml"], "none.toml: cannot be read"),
        (["--arm", "still.toml"], "still.toml: joint a: its axis is zero"),
        (["--tip", "skin"], "--base and --tip need --arm arm.urdf"),
    ],
)
def test_an_arm_that_cannot_be_used_is_refused(
    files, record, options, said, monkeypatch
):
    monkeypatch.chdir(files)
    status, _, err = record(*options)
    assert status == 2
    assert said in err
    assert not (files / "out.npz").exists()
