"""What a board installs: pinned as constraints.txt pins it, each package with its hashes."""

import re
from pathlib import Path

import pytest

from board.requirements import pinned

ROOT = Path(__file__).parents[1]


def package(name, version, digest):
    hashes = {"archive_info": {"hashes": {"sha256": digest}}}
    return {"metadata": {"name": name, "version": version}, "download_info": hashes}


def test_a_package_stands_once_with_the_hashes_of_all_boards():
    boards = [[package("NumPy", "2.0", "b")], [package("numpy", "2.0", "a")]]
    assert pinned(boards).splitlines()[-3:] == [
        "numpy==2.0 \\",
        "    --hash=sha256:a \\",
        "    --hash=sha256:b",
    ]


def test_boards_that_would_get_different_versions_are_refused():
    with pytest.raises(ValueError, match="numpy: 2.0 for one board, 2.1 for another"):
        pinned([[package("numpy", "2.0", "a")], [package("numpy", "2.1", "b")]])


def test_the_file_holds_what_the_constraints_say():
    text = (ROOT / "requirements-board.txt").read_text()
    found = dict(re.findall(r"^([\w.-]+)==(\S+) \\\n    --hash=sha256:[0-9a-f]{64}", text, re.M))
    assert {"numpy", "onnxruntime", "smbus2"} <= set(found)
    assert text.count("==") == len(found)
    pins = dict(re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.M))
    pins = {name.lower().replace("_", "-"): version for name, version in pins.items()}
    assert {name: pins.get(name.replace("_", "-")) for name in found} == found
