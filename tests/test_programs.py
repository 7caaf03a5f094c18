"""Measuring programs refuse options that would measure nothing, before they begin; and
a table names the command that made it."""

import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from edge.errors import EdgeError
from tests.checks import __main__ as checks
from tests.checks import mutants
from tests.checks.bench import tables
from tests.checks.hard_cases import __main__ as hard_cases
from tests.checks.hard_cases import elsewhere
from tests.conftest import ROOT


@pytest.mark.parametrize(
    ("measure", "words", "sentence"),
    [
        (hard_cases.measure, ["tyes"], "no case's name holds 'tyes'"),
        (elsewhere.measure, ["none", "python"], "no golden files are in none"),
        (mutants.measure, [["train"], 1, 1], "the rooms are skin, bus, "),
    ],
)
def test_options_that_would_measure_nothing_are_refused(measure, words, sentence):
    with pytest.raises(EdgeError, match=sentence):
        measure(*words)


def test_a_word_is_exchanged_where_it_is_code(monkeypatch, tmp_path):
    code = (
        'def f(a):  # < is "not" code\n    """1 < 2"""\n    return a < 1e-6 and "<"\n'
    )
    (tmp_path / "a.py").write_text(code)
    (tmp_path / "a.c").write_text("#if 1\nint a = i++ < 0; /* not < 9 */ // 9\n")
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    lines = [change.changed().splitlines() for change in mutants.changes("a.*")]
    assert [line[1] for line in lines[:2]] == [
        "int a = i++ <= 0; /* not < 9 */ // 9",
        "int a = i++ < 1; /* not < 9 */ // 9",
    ]
    assert [line[2].strip() for line in lines[2:]] == [
        'return a <= 1e-6 and "<"',
        'return a < 1e+6 and "<"',
        'return a < 1e-6 or "<"',
    ]


def test_a_table_has_its_command_as_it_can_be_run_and_no_empty_part(
    monkeypatch, tmp_path
):
    program = tables.ROOT / "tests" / "checks" / "bench" / "soak.py"
    monkeypatch.setattr(tables, "FOLDER", tmp_path)
    monkeypatch.setattr("sys.argv", [str(program), "--data", "two words"])
    tables.write("soak", [[], [{"a": 1, "b": "x"}, {"a": 2, "b": "y"}], []])
    head, *lines = (tmp_path / "soak.md").read_text().splitlines()
    assert head.startswith(
        "*`python -m tests.checks.bench.soak --data 'two words'`, commit "
    )
    assert lines == ["", "| a | b |", "| --- | --- |", "| 1 | x |", "| 2 | y |"]


STEP = """
from tests.checks import __main__ as checks
words = ("import time; print(1, flush=True); time.sleep(600)",)
checks.CHECKS = {"x": checks.Program((checks.PYTHON, "-c", *words), "")}
checks.main(["x"])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_no_step_outlives_its_check(number):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "cwd": ROOT}
    with subprocess.Popen([sys.executable, "-c", STEP], **pipes) as program:
        assert program.stdout.readline() == b"1\n"
        program.send_signal(number)
        # All that could write have ended.
        assert program.communicate(timeout=60) == (b"", None)


def test_options_of_a_check_reach_its_last_step_and_a_failed_step_ends_it(monkeypatch):
    steps = []

    def run(step, **options):
        steps.append(step[2:])
        return SimpleNamespace(returncode=len(steps) // 3)

    monkeypatch.setattr(checks.subprocess, "run", run)
    assert checks.main(["--out", "o", "shifts", "--model", "m", "--help"]) == 1
    assert [step[0] for step in steps[:2]] == ["train", "export"]
    assert steps[2][-3:] == ("--model", "m", "--help")
    assert checks.main(["--data", "a", "b", "--", "remount"]) == 1
    assert steps[3:] == [("tests.checks.remount", "--recordings", "a", "b")]
