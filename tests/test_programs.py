"""Measuring programs refuse options that would measure nothing, before they begin."""

import pytest

from edge.errors import InputError
from tests import faults, kills, mutants
from tests.bench import program, soak, tables
from tests.hard_cases import __main__ as hard_cases
from tests.hard_cases import elsewhere


@pytest.fixture
def refused(capsys):
    """The sentence by which a program refuses its options."""

    def run(main, *words):
        with pytest.raises(SystemExit) as ended:
            main(list(words))
        assert ended.value.code == 2
        return capsys.readouterr().err.splitlines()[-1]

    return run


def test_kills_of_no_command_are_refused(refused):
    assert "no command's name holds 'tech'" in refused(kills.main, "--only", "tech")


def test_hard_cases_of_no_name_are_refused(refused):
    sentence = refused(hard_cases.main, "--only", "tyes")
    assert "no case's name holds 'tyes'" in sentence


def test_mutants_of_no_name_are_refused(refused, monkeypatch):
    """Without a name mutmut would try all of them."""
    monkeypatch.setattr(mutants, "generate", lambda: None)
    monkeypatch.setattr(mutants, "statuses", lambda: {"edge.x": "not checked"})
    sentence = refused(mutants.main, "--only", "train")
    assert "no mutant's name contains 'train'" in sentence


@pytest.mark.parametrize("every", ["0", "-1"])
def test_faults_at_no_position_are_refused(refused, every):
    sentence = refused(faults.main, "--every", every)
    assert "--every: must be a whole number from 1" in sentence


def test_golden_files_that_are_not_there_are_named(refused, tmp_path):
    sentence = refused(elsewhere.main, "--golden", str(tmp_path), "python")
    assert f"no golden files are in {tmp_path}" in sentence


def test_a_soak_shorter_than_its_first_row_is_refused():
    with pytest.raises(InputError, match="--every 1 is longer than --minutes 0.5"):
        soak.measure(0.5, 1.0, 100.0)


def test_a_soak_has_a_rate(refused, monkeypatch):
    def main(words):
        monkeypatch.setattr("sys.argv", ["soak", *words])
        program.start(soak.measure, "Soak.", ("--rate", 100.0, "frames a second"))

    assert "--rate: must be a number from 0.001" in refused(main, "--rate", "nan")


@pytest.fixture
def written(monkeypatch, tmp_path):
    """Writes tables as a program that was called with some words; gives the file."""
    monkeypatch.setattr(tables, "FOLDER", tmp_path)

    def write(of, *words):
        program = tables.ROOT / "tests" / "bench" / "soak.py"
        monkeypatch.setattr("sys.argv", [str(program), *words])
        tables.write("soak", of)
        return (tmp_path / "soak.md").read_text().splitlines()

    return write


def test_a_table_without_a_row_is_left_out(written):
    lines = written([[], [{"a": 1, "b": "x"}, {"a": 2, "b": "y"}], []])
    assert lines[1:] == ["", "| a | b |", "| --- | --- |", "| 1 | x |", "| 2 | y |"]


def test_the_command_of_a_table_can_be_run_as_it_is_written(written):
    head, *_ = written([[{"a": 1}]], "--data", "two words")
    assert head.startswith("*`python -m tests.bench.soak --data 'two words'`, commit ")
