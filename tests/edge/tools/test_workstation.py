"""The workstation's commands from the board's command line."""

import pytest

from edge.tools import workstation


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["simulate", "--help"], "usage: train simulate"),
        (["export", "--help"], "usage: export"),
    ],
)
def test_a_command_of_the_workstation_runs_in_the_checkout(words, said, capfd):
    assert workstation.run(words) == 0
    assert said in capfd.readouterr().out


def test_the_exit_status_is_that_of_the_command(capfd):
    assert workstation.run(["simulate", "none.toml", "--explain"]) == 2
    assert "none.toml" in capfd.readouterr().err


def test_where_there_is_no_checkout_it_says_where_the_command_runs(
    monkeypatch,
    tmp_path,
    capsys,
):
    monkeypatch.setattr("edge.__file__", str(tmp_path / "edge" / "__init__.py"))
    assert workstation.run(["export"]) == 2
    assert "runs on the workstation, in a checkout" in capsys.readouterr().err
