"""examples/ros2_node.py over a stand-in for rclpy, fed by `edge-classify run --udp`."""

import json
import runpy
import socket
import sys
import threading
import types
from pathlib import Path

from edge import demo
from edge.cli import main

NODE = Path(__file__).parents[1] / "examples" / "ros2_node.py"


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
