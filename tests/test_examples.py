"""Each program in examples/ runs: the ROS node over a stand-in for rclpy, others as they are."""

import json
import runpy
import socket
import sys
import threading
import types
from pathlib import Path

import pytest

import edge
from edge import demo
from edge.cli import main
from edge.fake.player import play, skin_file

EXAMPLES = Path(__file__).parents[1] / "examples"
NODE = EXAMPLES / "ros2_node.py"
PILLOW = demo.FOLDER / "pillow-movable.npz"


def run(monkeypatch, capsys, program, *arguments):
    """What an example prints, line by line."""
    path = EXAMPLES / program
    assert len(path.read_text().splitlines()) <= 10
    monkeypatch.setattr(sys, "argv", [program, *map(str, arguments)])
    runpy.run_path(str(path))
    return capsys.readouterr().out.splitlines()


def test_a_recording_is_classified(monkeypatch, capsys):
    onset, *decided = run(monkeypatch, capsys, "classify_recording.py", demo.MODEL, PILLOW)
    assert onset.startswith("Onset(onset_s=")
    assert [line.split(",")[:2] for line in decided] == [
        ["Decided(task='category'", " label='soft-movable'"],
        ["Decided(task='mobility'", " label='movable'"],
        ["Decided(task='object'", " label='pillow'"],
    ]


def test_a_skin_is_watched(monkeypatch, capsys):
    """A fake skin feels a touch, and then the owner presses Ctrl-C."""
    recording = edge.load(PILLOW)
    skin, playback = play(skin_file(recording.layout), recording)
    read = skin.read

    def until_the_end():
        if skin.clock.now() - playback.start > playback.ends:
            raise KeyboardInterrupt
        return read()

    monkeypatch.setattr(skin, "read", until_the_end)
    monkeypatch.setattr(edge.Skin, "open", lambda file: skin)
    printed = []
    monkeypatch.setattr("builtins.print", printed.append)
    with pytest.raises(KeyboardInterrupt):
        run(monkeypatch, capsys, "watch_skin.py", demo.MODEL, "skin.toml")
    onset, *decided = printed
    assert isinstance(onset, edge.Onset)
    assert {event.task for event in decided} == {"category", "mobility", "object"}


class Ros:
    """As much of rclpy as the node uses; it is ok until `enough` messages are published."""

    def __init__(self, enough):
        self.published, self.enough = {}, enough

    def init(self):
        pass

    def ok(self):
        return sum(map(len, self.published.values())) < self.enough

    def create_node(self, name):
        return self

    def create_publisher(self, kind, topic, depth):
        said = self.published.setdefault(topic, [])
        return types.SimpleNamespace(publish=lambda message: said.append(message.data))


def test_the_node_publishes_every_line_and_every_label(monkeypatch, capsys):
    events, labels = 4, 3  # an onset and three decisions, of which each has a label
    ros = Ros(enough=events + labels)
    message = types.SimpleNamespace(String=lambda data: types.SimpleNamespace(data=data))
    monkeypatch.setitem(sys.modules, "rclpy", ros)
    monkeypatch.setitem(sys.modules, "std_msgs", types.ModuleType("std_msgs"))
    monkeypatch.setitem(sys.modules, "std_msgs.msg", message)
    # The example's port may be taken here: bind any, and tell the sender which.
    bound = threading.Event()
    port = []

    class Anywhere(socket.socket):
        def bind(self, address):
            super().bind((address[0], 0))
            port.append(self.getsockname()[1])
            bound.set()

    program = runpy.run_path(str(NODE))
    own = types.SimpleNamespace(
        socket=Anywhere, AF_INET=socket.AF_INET, SOCK_DGRAM=socket.SOCK_DGRAM
    )
    program["main"].__globals__["socket"] = own
    node = threading.Thread(target=program["main"], daemon=True)
    node.start()
    assert bound.wait(10)
    touch = str(demo.FOLDER / "pillow-movable.npz")
    run = ["run", "--model", str(demo.MODEL), "--fake", touch]
    assert main([*run, "--udp", f"127.0.0.1:{port[0]}"]) == 0
    node.join(timeout=20)
    assert not node.is_alive()
    lines = capsys.readouterr().out.splitlines(keepends=True)
    assert ros.published["touch"] == lines[:events]
    assert ros.published["touch/mobility"] == ["movable"]
    assert ros.published["touch/object"] == ["pillow"]
    assert json.loads(lines[0])["event"] == "onset"
