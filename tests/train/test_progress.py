"""Progress on stderr: a bar on a terminal, few lines in a log."""

import logging
import re
import sys

from train import progress


def test_short_work_says_nothing_in_a_log(capsys):
    assert list(progress.bar(range(1000), desc="working")) == list(range(1000))
    assert capsys.readouterr().err == ""


def test_long_work_is_a_line_each_time_in_a_log_and_a_bar_on_a_terminal(
    capsys, monkeypatch
):
    monkeypatch.setattr(progress, "LOG_S", 0.0)
    monkeypatch.setattr(progress, "FIRST_S", 0.0)
    for is_terminal in (False, True):
        monkeypatch.setattr(sys.stderr, "isatty", lambda is_it=is_terminal: is_it)
        list(progress.bar(range(10), desc="working"))
        err = capsys.readouterr().err
        assert "working: 100%" in err
        assert ("\r" in err) is is_terminal


def test_stages_share_a_bar_and_are_lines_of_the_log(capsys, monkeypatch, caplog):
    monkeypatch.setattr(progress, "LOG_S", 0.0)
    monkeypatch.setattr(progress, "FIRST_S", 0.0)
    with (
        caplog.at_level(logging.DEBUG, "train"),
        progress.stages({"first": 3.0, "second": 1.0}, shown=True) as stage,
    ):
        for name in ("first", "second"):
            with stage(name):
                list(progress.bar(range(3), desc="within"))
    err = capsys.readouterr().err
    assert "\x1b" not in err  # a cursor goes nowhere in a log
    assert re.findall(r"(?m)^export\S* +([1-9]\d*%)", err)[:2] == ["75%", "100%"]
    assert [record.args[0] for record in caplog.records] == ["first", "second"]
