"""Text at a terminal, JSON lines elsewhere."""

import json

import pytest

from edge import demo
from edge.app.cli import main
from edge.app.output import Output
from edge.app.texts import event_text
from edge.decide.model import Model

TOUCH = str(demo.FOLDER / "pillow-movable.npz")
RUN = ["run", "--model", str(demo.MODEL), "--fake", TOUCH]


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setattr(
        Output,
        "of",
        classmethod(lambda cls, arguments: cls(arguments.json)),
    )


def test_a_person_reads_when_what_was_decided_and_how_sure(terminal, capsys):
    assert main(RUN) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == [lines[0].split()[0], "s", "contact"]
    (mobility,) = (line for line in lines if " mobility " in line)
    *words, share = mobility.split()[2:]
    assert words == ["mobility", "movable"]
    assert 95 <= int(share.removesuffix("%")) <= 100
    assert lines[-1].endswith(" 0 missed")


def test_json_at_a_terminal_is_what_a_pipe_gets(terminal, capsys):
    assert main([*RUN, "--json"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    tasks = len(Model(demo.MODEL).info.tasks)
    assert [e["event"] for e in events] == ["onset", *["decision"] * tasks, "end"]
    assert all(round(e["onset_s"], 6) == e["onset_s"] for e in events[:-1])


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (
            {
                "event": "decision",
                "onset_s": 0.2,
                "window_s": 1.2,
                "task": "object",
                "label": "box",
                "confidence": 0.6,
                "flags": ["tie"],
                "expected": "foam",
            },
            "   1.400 s  object     box               60%  (tie; labelled foam)",
        ),
        (
            {
                "event": "saved",
                "file": "a/box-001.npz",
                "labels": {"object": "box"},
                "frames": 150,
                "seconds": 1.5,
                "complete": False,
            },
            "a/box-001.npz: 1.5 s, 150 frames, object=box; incomplete: reading stopped "
            "before the contact's end",
        ),
    ],
)
def test_each_event_has_its_words(line, text):
    assert event_text(line) == text
