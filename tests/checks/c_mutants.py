"""One-word changes of the C that `export --c` writes, for `tests.checks.mutants`."""

import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from tests.conftest import ROOT

EXCHANGED = [
    ("<", "<="),
    (">", ">="),
    ("==", "!="),
    ("&&", "||"),
    ("+", "-"),
    ("true", "false"),
    ("0", "1"),
]
WORDS = dict(EXCHANGED) | {new: old for old, new in EXCHANGED}
TOKEN = re.compile(
    r'/\*.*?\*/|//[^\n]*|^\s*#[^\n]*|"(?:\\.|[^"])*"'  # none of these is changed
    r"|\+\+|--|->|<<|>>|[-+*/&|^%]=|[<>=!]=|&&|\|\||[-+<>]|[\w.]+",
    re.M | re.S,
)
FOLDERS = ("edge", "train", "export", "tests", "docs")
TESTS = "tests/export/test_c_code.py"
LONGEST_S = 900.0
"""A loop without an end is noticed."""


class Change(NamedTuple):
    """Another word at a place of a file, from `begin` on."""

    file: str
    begin: int
    old: str
    new: str


def changes():
    """{name: the change}, of each word that can be exchanged."""
    found = {}
    for path in sorted((ROOT / "export" / "c").glob("*.c")):
        text = path.read_text()
        for match in TOKEN.finditer(text):
            word = match[0]
            if word in WORDS:
                line = text.count("\n", 0, match.start()) + 1
                column = match.start() - text.rfind("\n", 0, match.start())
                name = f"export/c/{path.name}:{line}:{column}"
                found[name] = Change(path.name, match.start(), word, WORDS[word])
    return found


@contextmanager
def copied():
    """A copy of the checkout, to be changed."""
    with TemporaryDirectory() as folder:
        for name in FOLDERS:
            shutil.copytree(ROOT / name, Path(folder) / name)
        shutil.copy(ROOT / "pyproject.toml", folder)
        yield Path(folder)


def status_of(change, folder):
    """Whether a test of a copy notices a change, which is taken back."""
    path = folder / "export" / "c" / change.file
    text = path.read_text()
    end = change.begin + len(change.old)
    path.write_text(text[: change.begin] + change.new + text[end:])
    words = [sys.executable, "-m", "pytest", "-qx", "-m", "slow or not slow", TESTS]
    try:
        ended = subprocess.run(
            words, cwd=folder, capture_output=True, timeout=LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired:
        return "timeout"
    finally:
        path.write_text(text)
    return "killed" if ended.returncode else "survived"
