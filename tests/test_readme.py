"""README.md: its commands exist as they are written there, and its tables are the code's."""

import errno
import re
import shlex
from pathlib import Path

import pytest

from edge import bus, cli
from export.__main__ import parser as export_parser
from train.__main__ import main as train

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text()
CODE = [" ".join(found.split()) for found in re.findall(r"`([^`]+)`", TEXT)]
COMMANDS = sorted({c for c in CODE if c.startswith("edge-classify ") and "skin.toml`" not in c})
TARGETS = sorted(set(re.findall(r"make ([a-z-]+)", TEXT)))


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_board_is_understood(command):
    words = shlex.split(command)[1:]
    if words[1:] and not any("REC…" in w for w in words):
        cli.parser([words[0]]).parse_args(words)
    assert words[0] in cli.COMMANDS


@pytest.mark.parametrize("target", TARGETS)
def test_a_make_target_exists(target):
    if not re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.M):
        pytest.fail(f"README.md names `make {target}`, the Makefile has none")


@pytest.mark.parametrize("picture", re.findall(r"\]\((docs/[^)]+)\)", TEXT))
def test_each_picture_is_there_and_made_by_a_target(picture):
    assert (ROOT / picture).exists()
    assert re.search(rf"^{re.escape(picture)}:", (ROOT / "Makefile").read_text(), re.M)


def test_the_table_of_errnos_has_all_that_the_driver_answers():
    rows = re.findall(r"^\| (E[A-Z]+(?:, E[A-Z]+)*) \|", TEXT, re.M)
    named = [name for row in rows for name in row.split(", ")]
    assert sorted(getattr(errno, name) for name in named) == sorted(bus.RESPONSES)


def test_each_command_of_python_is_there():
    for name in ("import", "simulate", "show"):
        with pytest.raises(SystemExit) as left:
            train([name, "--help"])
        assert left.value.code == 0
    options = export_parser().format_help()
    assert all(option in options for option in ("--scaling", "--k", "--front"))
