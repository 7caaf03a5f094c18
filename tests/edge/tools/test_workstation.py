"""The workstation's commands from the board's command line."""

import pytest

from edge.tools import workstation


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
    root,
    package,
    words,
    output,
    capfd,
):
    (root / package).mkdir()
    (root / package / "__main__.py").write_text("import sys\nprint(sys.argv[1:])\n")
    assert workstation.run(words) == 0
    assert capfd.readouterr().out == output


def test_a_folder_of_the_users_does_not_run_in_the_checkouts_place(
    monkeypatch,
    tmp_path,
    capfd,
):
    (tmp_path / "train").mkdir()
    (tmp_path / "train" / "__main__.py").write_text("print('another train')\n")
    monkeypatch.chdir(tmp_path)
    assert workstation.run(["simulate", "none.toml", "--explain"]) == 2
    assert capfd.readouterr().out == ""


def test_where_there_is_no_checkout_it_says_where_the_command_runs(root, capsys):
    assert workstation.run(["export"]) == 2
    assert "runs on the workstation, in a checkout" in capsys.readouterr().err
