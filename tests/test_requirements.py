"""requirements-board.txt pins the board's packages as constraints.txt does, with their hashes."""

import re
from pathlib import Path

import pytest

from board.requirements import differences, normal, pinned

ROOT = Path(__file__).parents[1]


def package(name, version, digest):
    hashes = {"archive_info": {"hashes": {"sha256": digest}}}
    return {"metadata": {"name": name, "version": version}, "download_info": hashes}


def test_each_package_is_listed_once_with_its_hashes_on_all_boards():
    boards = [[package("NumPy", "2.0", "b")], [package("numpy", "2.0", "a")]]
    expected = ["numpy==2.0 \\", "    --hash=sha256:a \\", "    --hash=sha256:b"]
    assert pinned(boards).splitlines()[-3:] == expected


def test_different_versions_for_two_boards_are_refused():
    with pytest.raises(ValueError, match="numpy: 2.0 for one board, 2.1 for another"):
        pinned([[package("numpy", "2.0", "a")], [package("numpy", "2.1", "b")]])


def test_a_missing_and_a_needless_pin_are_named():
    pins = "pip==1\nsetuptools==1\nruamel.yaml==0.19\nnumba==0.6\n"
    assert differences(pins, ["ruamel-yaml"]) == ["constraints.txt pins numba, which nothing needs"]
    assert differences(pins, ["ruamel_yaml", "Numba", "llvmlite"]) == [
        "constraints.txt does not pin llvmlite"
    ]


def test_the_versions_are_those_of_the_constraints():
    text = (ROOT / "requirements-board.txt").read_text()
    board = dict(re.findall(r"^([\w.-]+)==(\S+) \\\n    --hash=sha256:[0-9a-f]{64}", text, re.M))
    assert {"numpy", "onnxruntime", "smbus2"} <= set(board)
    assert text.count("==") == len(board)
    pins = dict(re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.M))
    pins = {normal(name): version for name, version in pins.items()}
    assert {name: pins.get(normal(name)) for name in board} == board
