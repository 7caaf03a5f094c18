"""`make mutants`: exchange one word of the code, at random places, and see whether a fast
test notices.

Each of the `ROOMS` draws `--count` words of Python or C that have another in `WORDS`
from a stream of its own. In a copy of the checkout a word is exchanged, the room's tests
run, with the examples of its docstrings, and the word is put back. The exit status is 1
if more than one of 50 changes of a room is not noticed. The tables are in docs/measured/.
"""

import os
import re
import shutil
import signal
import sys
from multiprocessing import get_context
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import NamedTuple

import pytest

from edge.errors import EdgeError
from tests.checks.__main__ import end_with_parent
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.conftest import ROOT
from train.progress import bar

PACKAGES = ("edge", "train", "export", "tests")
MOST_UNNOTICED = 1 / 50
LONGEST_S = 300.0
"""A loop without an end is noticed."""
EXCHANGED = [
    ("<", "<="),
    (">", ">="),
    ("==", "!="),
    ("+", "-"),
    ("and", "or"),
    ("&&", "||"),
    ("True", "False"),
    ("true", "false"),
    ("min", "max"),
    ("any", "all"),
    ("break", "continue"),
    ("0", "1"),
]
WORDS = dict(EXCHANGED) | {new: old for old, new in EXCHANGED} | {"not": "", "!": ""}
SKIPPED = {
    ".py": r'#[^\n]*|@dataclass[^\n]*|strict=\w+|"""(?:\\.|[^\\])*?"""',
    ".c": r"/\*.*?\*/|//[^\n]*|^\s*#[^\n]*",
}
TOKEN = (
    r""""(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'"""
    r"|\+\+|--|->|<<|>>|[-+*/&|^%]=|[<>=!]=|&&|\|\||[-+<>!]|[\w.]+"
)


class Room(NamedTuple):
    """Files, and the tests that are to notice their changes, the nearest first."""

    files: str
    tests: str


ROOMS = {
    "skin": Room(
        "edge/wire/skin/*.py",
        "tests/edge/wire/skin tests/edge/app/commands/test_calibrate.py",
    ),
    "bus": Room("edge/wire/bus/*.py", "tests/edge/wire/bus"),
    "labels": Room(
        "edge/record/labels.py",
        "tests/edge/record/test_labels.py tests/edge/app/commands/test_label.py",
    ),
    "page": Room(
        "edge/app/sinks/page.py",
        "tests/edge/app/sinks/test_page.py tests/edge/app/sinks/test_web.py",
    ),
    "model-in-c": Room(
        "export/c/*.c", "tests/export/test_c_code.py tests/export/test_image.py"
    ),
    "skin-in-c": Room("export/c/skin/*.c", "tests/export/test_skin_code.py"),
}


class Change(NamedTuple):
    """Another word at a place of a file's text."""

    file: str
    text: str
    begin: int
    old: str
    new: str

    def changed(self):
        """The file's text with the other word."""
        return (
            self.text[: self.begin] + self.new + self.text[self.begin + len(self.old) :]
        )

    def row(self):
        """A row of the table of those that no test noticed."""
        number = self.text.count("\n", 0, self.begin)
        line, other = (
            text.splitlines()[number].strip().replace("|", "\\|")
            for text in (self.text, self.changed())
        )
        return {
            "not noticed": f"{self.file}:{number + 1}",
            "line": f"`{line}`",
            "as": f"`{other}`",
        }


def changes(pattern):
    """Each change of the files of a pattern."""
    for path in sorted(ROOT.glob(pattern)):
        text = path.read_text()
        for match in re.finditer(f"{SKIPPED[path.suffix]}|{TOKEN}", text, re.M | re.S):
            if match[0] in WORDS:
                file = path.relative_to(ROOT).as_posix()
                yield Change(file, text, match.start(), match[0], WORDS[match[0]])


def drawn(room, count, seed):
    """So many changes of a room."""
    every = list(changes(ROOMS[room].files))
    return Random(f"{seed} {room}").sample(every, min(count, len(every)))


def tested(folder, words):
    """End this process with the status of pytest in a copy of the checkout."""
    end_with_parent()
    os.setsid()
    os.chdir(folder)
    os.environ["PYTHONPATH"] = str(folder)
    for number in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), number)
    for name in list(sys.modules):
        if name.partition(".")[0] in PACKAGES:
            del sys.modules[name]
    os._exit(pytest.main(words))


def passes(room, folder):
    """Whether the tests of a room pass in a copy of the checkout.

    The process is forked, because the imports take most of the time.
    """
    slow = "slow or not slow" if room.endswith("-c") else "not slow"
    files = [str(path) for path in folder.glob(ROOMS[room].files)]
    examples = ["--doctest-modules", *files] if files[0].endswith(".py") else []
    options = ["-qx", "-p", "no:cacheprovider", "-m", slow]
    words = [*options, *ROOMS[room].tests.split(), *examples]
    process = get_context("fork").Process(target=tested, args=(folder, words))
    process.start()
    process.join(LONGEST_S)
    if process.exitcode is None:  # a program that it compiled may have no end
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
    return process.exitcode == 0


def unnoticed(room, changes, folder):
    """The changes that no test notices in a copy of the checkout.

    Raises:
        EdgeError: a test fails without a change.
    """
    if not passes(room, folder):
        raise EdgeError(f"a test of {ROOMS[room].tests} fails without a change")
    for change in bar(changes, desc=room):
        path = folder / change.file
        path.write_text(change.changed())
        if passes(room, folder):
            print(change.row(), file=sys.stderr)
            yield change
        shutil.copy2(ROOT / change.file, path)


def measure(rooms, count, seed):
    """Write the tables; 1 if too many changes of a room are not noticed.

    Raises:
        EdgeError: no room has a name, or a test fails without a change.
    """
    rooms = rooms or list(ROOMS)
    if not ROOMS.keys() >= set(rooms):
        raise EdgeError(f"--rooms {rooms}: the rooms are {', '.join(ROOMS)}")
    rows = []
    living = []
    with TemporaryDirectory() as name:
        folder = Path(name) / "checkout"
        ignored = shutil.ignore_patterns(".*", "__pycache__", "build", "dist")
        shutil.copytree(ROOT, folder, ignore=ignored)
        for room in rooms:
            sample = drawn(room, count, seed)
            alive = list(unnoticed(room, sample, folder))
            row = {"room": room, "changes": len(sample), "not noticed": len(alive)}
            rows.append(row)
            living += alive
    tables.write("mutants", [rows, [change.row() for change in living]])
    return int(any(r["not noticed"] > MOST_UNNOTICED * r["changes"] for r in rows))


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--rooms", [], "rooms, or all"),
        ("--count", 50, "words to exchange in each room"),
        ("--seed", 2012, "of the draws"),
    )
