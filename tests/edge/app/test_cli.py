"""The command line: one module a command, exit statuses, no traceback."""

import argparse
import logging
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from edge.__main__ import main as start
from edge.app import cli
from edge.demo import MODEL
from edge.errors import InputError
from edge.wire.bus.protocol import BusMissing
from edge.wire.skin import file as skinfile
from tests.conftest import ROOT, python


def top(run):
    """A command line with one command that does `run`."""
    parser = argparse.ArgumentParser(prog="edge-classify")
    parser.set_defaults(run=run)
    return parser


def raising(error):
    def run(*arguments):
        raise error

    return run


def test_every_command_has_help_of_its_own(capsys):
    for name in cli.COMMANDS:
        with pytest.raises(SystemExit) as ended:
            cli.main([name, "--help"])
        assert ended.value.code == 0
        assert f"edge-classify {name} " in capsys.readouterr().out


def test_without_a_command_the_commands_are_listed(capsys):
    assert cli.main([]) == 2
    text = capsys.readouterr().out
    assert all(re.search(rf"^    {name}\s", text, re.M) for name in cli.COMMANDS)


@pytest.mark.parametrize(
    ("typed", "sentence"),
    [
        ("reply", "there is no command 'reply'; did you mean 'replay'?"),
        ("dance!", "the commands are check, scan,"),
        ("predict", "there is no command 'predict'; did you mean 'replay' or 'run'?"),
    ],
)
def test_a_typing_error_is_answered_by_the_nearest_command(typed, sentence, capsys):
    assert cli.main([typed]) == 2
    err = capsys.readouterr().err
    assert sentence in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("flag", "letters"), [("-q", ["e"]), ("--json", ["i", "w", "e"])]
)
def test_quiet_leaves_errors(flag, letters, capsys, monkeypatch):
    def run(arguments):
        log = logging.getLogger("edge.somewhere")
        for level in (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR):
            log.log(level, logging.getLevelName(level)[0].lower())
        return 0

    monkeypatch.setattr("edge.app.commands.check.run", run)
    top = cli.parser(["check"])
    assert cli.dispatch(top, ["check", flag, "skin.toml"]) == 0
    assert capsys.readouterr().err == "".join(
        f"edge-classify: {letter}\n" for letter in letters
    )
    assert logging.getLogger("edge").handlers == []


def test_a_shell_is_told_the_commands_that_a_word_begins():
    """As bash with argcomplete asks for them."""
    pytest.importorskip("argcomplete")
    line = "edge-classify rec"
    environment = {
        **os.environ,
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_STDOUT_FILENAME": "/dev/stdout",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
    }
    assert python("-m", "edge", env=environment).stdout.split() == ["record"]


@pytest.mark.parametrize(("error", "status"), [(InputError, 2), (BusMissing, 3)])
def test_bad_input_is_one_sentence_and_exit_2_and_a_device_exit_3(
    capsys,
    error,
    status,
):
    assert cli.dispatch(top(raising(error("a: not there"))), []) == status
    assert capsys.readouterr().err == "edge-classify: a: not there\n"


def test_a_file_that_cannot_even_be_asked_for_is_named(tmp_path, capsys):
    """Its name is too long, as one in a folder that is closed to the user."""
    golden = tmp_path / ("g" * 300)
    assert cli.main(["install", str(MODEL), "--golden", str(golden)]) == 2
    sentence = f"edge-classify: {golden}: cannot be used: File name too long\n"
    assert capsys.readouterr().err == sentence


def test_ctrl_c_is_exit_130_and_quiet_also_while_the_program_is_loaded(
    capsys, monkeypatch
):
    assert cli.dispatch(top(raising(KeyboardInterrupt())), []) == 130
    monkeypatch.setattr(cli, "import_module", raising(KeyboardInterrupt()))
    monkeypatch.setattr("sys.argv", ["edge-classify", "check", "skin.toml"])
    assert start() == 130
    assert capsys.readouterr().err == ""


def test_an_error_of_the_program_is_not_hidden():
    with pytest.raises(ZeroDivisionError):
        cli.dispatch(top(raising(ZeroDivisionError())), [])


@pytest.mark.parametrize("closed", [">&-", "<&- >&- 2>&-"])
def test_a_stream_that_was_closed_before_the_start_is_no_traceback(closed, tmp_path):
    """Nor does a file that is opened later take its descriptor, and get what is
    printed."""
    log = tmp_path / "log"
    command = f"{sys.executable} -m edge check {skinfile.shipped()} {closed}"
    redirected = f"({command}) > {log}.out 2> {log}.err; echo $? > {log}.status"
    subprocess.run(["sh", "-c", redirected], cwd=ROOT, timeout=60)
    assert Path(f"{log}.status").read_text() == "0\n"
    assert "Traceback" not in Path(f"{log}.err").read_text()


EMPTY = [
    *([name, ""] for name in cli.COMMANDS),
    ["install", str(MODEL), "--to", ""],
    ["label", "--set", "a=b", "--yes", ".", ""],
    ["replay", "--model=", "."],
]


@pytest.mark.parametrize("words", EMPTY, ids=" ".join)
def test_an_empty_argument_is_refused(words, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(words)
    assert ended.value.code == 2
    assert "an argument is empty" in capsys.readouterr().err


TOUCH = MODEL.parent / "pillow-movable.npz"
SKIN = skinfile.shipped("cody")
GOLDEN = ROOT / "tests" / "golden"


@pytest.mark.parametrize(
    "words",
    [
        ["info", "--model", MODEL],
        ["replay", "--model", MODEL, TOUCH],
        ["explain", "--model", MODEL, TOUCH],
        ["verify", "--model", GOLDEN / "model.onnx", "--golden", GOLDEN / "golden.npz"],
        ["check", "--skin", SKIN],
        ["scan", "--skin", SKIN, "--fake", TOUCH],
    ],
    ids=lambda words: words[0],
)
def test_a_model_and_a_skin_may_stand_without_their_option(words, edge):
    bare = [word for word in words if word not in ("--model", "--skin")]
    answers = []
    for line in (words, bare):
        status, out, _ = edge(*line, text=True)
        answers.append((status, re.sub(r'"latency_ms": [\d.]+', "", out)))
    assert answers[0] == answers[1]
    assert answers[0][0] < 2
