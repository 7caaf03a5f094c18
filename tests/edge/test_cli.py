"""The command line: one module a command, exit statuses, no traceback."""

import argparse
import subprocess
import sys
from pathlib import Path

import pytest

from edge import __version__, cli
from edge.errors import InputError

ROOT = Path(__file__).parents[2]


def top(run):
    """A command line with one command that does `run`."""
    parser = argparse.ArgumentParser(prog="edge-classify")
    parser.set_defaults(run=run)
    return parser


def raising(error):
    def run(arguments):
        raise error

    return run


def test_every_command_has_help_of_its_own(capsys):
    for name in cli.COMMANDS:
        with pytest.raises(SystemExit) as left:
            cli.main([name, "--help"])
        assert left.value.code == 0
        assert f"edge-classify {name} " in capsys.readouterr().out


def test_the_version_is_the_package_s(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--version"])
    assert capsys.readouterr().out == f"edge-classify {__version__}\n"


@pytest.mark.parametrize("words", [[], ["dance"], ["run", "--no-such-option"]])
def test_bad_usage_is_exit_2(words, capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(words)
    assert left.value.code == 2
    assert "usage: edge-classify" in capsys.readouterr().err


@pytest.mark.parametrize("status", [0, 1])
def test_a_command_s_own_status_is_the_exit_status(status):
    assert cli.dispatch(top(lambda arguments: status), []) == status


def test_bad_input_is_one_sentence_and_exit_2(capsys):
    assert cli.dispatch(top(raising(InputError("a.npz: no such file"))), []) == 2
    assert capsys.readouterr().err == "edge-classify: a.npz: no such file\n"


def test_ctrl_c_is_exit_130_and_quiet(capsys):
    assert cli.dispatch(top(raising(KeyboardInterrupt())), []) == 130
    assert capsys.readouterr().err == ""


def test_an_error_of_the_program_is_not_hidden():
    with pytest.raises(ZeroDivisionError):
        cli.dispatch(top(raising(ZeroDivisionError())), [])


def test_only_the_command_that_is_asked_for_is_loaded():
    code = (
        "import sys; from edge import cli; cli.parser(['check']); "
        "print(*sorted(m for m in sys.modules if m.startswith('edge.commands.')))"
    )
    said = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.split()
    assert "edge.commands.check" in said
    assert not {"edge.commands.run", "edge.commands.replay", "edge.commands.bench"} & set(said)
