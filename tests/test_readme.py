"""README.md and docs/: programs know the commands, make the targets; tables are true."""

import errno
import re
import shlex

import pytest

from edge.app import cli
from edge.app.commands import workstation
from edge.wire.bus import protocol
from export.cli import parser as export_parser
from tests.checks.__main__ import CHECKS
from tests.conftest import ROOT, ended
from train.__main__ import parser as train_parser

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MAKEFILE = (ROOT / "Makefile").read_text()
TEXT = "\n".join(page.read_text() for page in PAGES)
FENCE = re.compile(r"(?ms)^ *```\w*\n(.*?)^ *```")
INLINE = re.findall(r"`([^`]+)`", FENCE.sub("", TEXT))
CODE = [" ".join(code.split()) for code in INLINE]
BLOCKS = "\n".join(FENCE.findall(TEXT)).replace("\\\n", "")
COMMAND = re.compile(r"(?m)(?:^|[ /])(edge-classify|-m train|-m export) ([^\n|>#&;]*)")
COMMANDS = sorted(set(COMMAND.findall("\n".join([*CODE, BLOCKS]))))
README = " ".join(PAGES[0].read_text().split())
MAKE = [c for c in dict.fromkeys(CODE) if c.startswith("make ") and f"`{c}`" in README]
# In code, or at the beginning of a line of it: "make" is a word of prose too.
TARGETS = sorted(set(re.findall(r"(?:^ *|`)make ([a-z-]+)", TEXT, re.M)))


@pytest.mark.parametrize(("program", "arguments"), COMMANDS)
def test_a_command_of_any_page_has_arguments_that_its_program_knows(
    program,
    arguments,
    capsys,
):
    makers = {
        "edge-classify": cli.parser,
        "-m train": train_parser,
        "-m export": export_parser,
    }
    words = shlex.split(re.sub(r"[][]", "", arguments).replace("FORMAT", "csv"))
    if program == "edge-classify" and words and words[0] in workstation.COMMANDS:
        program = "-m train"
        if words[0] == "export":
            program = "-m export"
            words = words[1:]
    try:
        cli.parsed(makers[program](), words)
    except SystemExit as end:
        # A sentence may name a command without all of its arguments.
        assert end.code == 0 or "required" in capsys.readouterr().err


@pytest.mark.parametrize("command", MAKE)
def test_a_make_command_says_what_it_would_do(command):
    plain = re.sub("[][…]", "", command)
    process = ended(*shlex.split(plain), "--dry-run")
    assert process.returncode == 0, process.stderr
    assert "python" in process.stdout


@pytest.mark.parametrize("target", TARGETS)
def test_a_make_target_exists(target):
    rules = re.findall(r"^([\w./-]+(?: [\w./-]+)*):", MAKEFILE, re.M)
    assert target in {*CHECKS, *" ".join(rules).split()}


@pytest.mark.parametrize("picture", re.findall(r"\]\((docs/[^)]+\.png)\)", TEXT))
def test_each_picture_is_there_and_made_by_a_target(picture):
    assert (ROOT / picture).exists()
    assert re.search(rf"^{re.escape(picture)}:", MAKEFILE, re.M)


def test_the_table_of_errnos_has_all_that_the_driver_answers():
    rows = re.findall(r"^\| (E[A-Z]+(?:, E[A-Z]+)*) \|", TEXT, re.M)
    names = [name for row in rows for name in row.split(", ")]
    assert sorted(getattr(errno, name) for name in names) == sorted(protocol.ERRORS)
