"""requirements-board.txt pins the board's packages as constraints.txt does, with their
hashes."""

import re

from tests.conftest import ROOT


def test_the_versions_are_those_of_the_constraints():
    text = (ROOT / "requirements-board.txt").read_text()
    pin = r"^([\w.-]+)==(\S+)(?: ; [^\\]+)? \\\n    --hash=sha256:[0-9a-f]{64}"
    board = dict(re.findall(pin, text, re.M))
    assert {"numpy", "onnxruntime", "smbus2"} <= set(board)
    assert text.count("==") == len(board)
    pins = dict(
        re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.M)
    )
    assert {name: pins.get(name) for name in board} == board
