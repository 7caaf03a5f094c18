"""Progress on stderr: a bar on a terminal, few lines in a log."""

import sys

from train import progress


def test_short_work_says_nothing_in_a_log(capsys):
    assert list(progress.bar(range(1000), desc="working")) == list(range(1000))

    assert capsys.readouterr().err == ""


def test_long_work_is_a_line_each_time_in_a_log(capsys, monkeypatch):
    monkeypatch.setattr(progress, "LOG_S", 0.0)
    monkeypatch.setattr(progress, "FIRST_S", 0.0)

    list(progress.bar(range(10), desc="working"))

    err = capsys.readouterr().err
    assert all(line.startswith("working: ") for line in err.splitlines())
    assert "working: 100%" in err
    assert "\r" not in err


def test_a_terminal_has_a_bar(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)

    list(progress.bar(range(10), desc="working"))

    assert "working: 100%" in capsys.readouterr().err
