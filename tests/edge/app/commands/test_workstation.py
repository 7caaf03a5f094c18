"""The workstation's commands from the board's command line."""

import os

import pytest

import edge
from edge.app.commands import workstation
from tests.conftest import ROOT, python


@pytest.fixture
def root(monkeypatch, tmp_path):
    """The working directory, which seems to hold the package `edge`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("edge.__file__", str(tmp_path / "edge" / "__init__.py"))
    return tmp_path


@pytest.mark.parametrize(
    ("package", "words", "output"),
    [
        ("train", ["simulate", "a b.toml"], "['simulate', 'a b.toml']\n"),
        ("export", ["export", "--k", "3"], "['--k', '3']\n"),
    ],
)
def test_a_command_of_the_workstation_runs_in_the_checkout(
    root, package, words, output
):
    """The command takes the program's place, as a test in the same process cannot."""
    (root / package).mkdir()
    (root / package / "__main__.py").write_text("import sys\nprint(sys.argv[1:])\n")
    program = f"""
import edge
from edge.app.commands import workstation
edge.__file__ = {edge.__file__!r}
workstation.run({words})
"""
    assert python("-c", program).stdout == output


def test_a_folder_of_the_users_does_not_run_in_the_checkouts_place(tmp_path):
    (tmp_path / "train").mkdir()
    (tmp_path / "train" / "__main__.py").write_text("print('another train')\n")
    words = ["simulate", "none.toml", "--explain"]
    path = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = python("-m", "edge", *words, cwd=tmp_path, env=path)
    assert ran.returncode == 2
    assert ran.stdout == ""


def test_where_there_is_no_checkout_it_says_where_the_command_runs(root, capsys):
    assert workstation.run(["export"]) == 2
    assert "runs on the workstation, in a checkout" in capsys.readouterr().err
