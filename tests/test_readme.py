"""README.md and docs/: README's commands run as written, others are known; tables are
true."""

import errno
import re
import shlex
import shutil

import pytest

from edge import cli
from edge.bus import protocol
from edge.recording import Recording, load
from edge.saving import save
from edge.skin import file as skinfile
from edge.tools import workstation
from export.cli import parser as export_parser
from tests.conftest import ROOT, ended
from train.__main__ import main as train
from train.__main__ import parser as train_parser
from train.importers import sdh2

GRASPS = ROOT.parent / "shared" / "real" / "sdh2_grasps"
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
FIRST = [code for code in dict.fromkeys(CODE) if f"`{code}`" in README]
BOARD = [c for c in FIRST if c.startswith("edge-classify ")]
WORKSTATION = [c for c in FIRST if c.startswith("python -m train ") and "--" in c]
MAKE = [c for c in FIRST if c.startswith("make ")]
# In code, or at the beginning of a line of it: "make" is a word of prose too.
TARGETS = sorted(set(re.findall(r"(?:^ *|`)make ([a-z-]+)", TEXT, re.M)))
FAKED = {
    "scan": "--fake still.npz",
    "calibrate": "--fake still.npz --frames 20",
    "view": "--fake REC.npz --seconds 0.3",
    "record": "--fake REC.npz",
    "run": "--fake REC.npz",
}
"""What is added to a command that reads the skin."""


@pytest.fixture(scope="module")
def bench(exported, recordings, tmp_path_factory):
    """A folder with the files that the README's commands name."""
    folder = tmp_path_factory.mktemp("owner")
    touch = load(recordings / "hard_0.npz")
    text = skinfile.shipped().read_text()
    for name, value in (("threshold", 50), ("onset", touch.layout.onset)):
        text = re.sub(rf"(?m)^{name}_counts = \d+", f"{name}_counts = {value}", text)
    (folder / "skin.toml").write_text(text)
    for name in ("model.onnx", "golden.npz"):
        shutil.copy(exported / name, folder)
    shutil.copy(recordings / "hard_0.npz", folder / "REC.npz")
    save(folder / "still.npz", Recording(touch.t[:20], touch.frames[:20], meta={}))
    return folder


@pytest.mark.parametrize("command", BOARD)
def test_a_command_of_the_board_does_as_it_is_written(
    command,
    bench,
    monkeypatch,
    capsys,
):
    """In the order of the page; commands that read the skin use fake chips."""
    monkeypatch.chdir(bench)
    written = command.replace("REC…", "REC.npz").replace(" M ", " model.onnx ")
    words = shlex.split(written)[1:]
    if words == ["view"]:
        words += ["--skin", "skin.toml"]
    assert cli.main([*words, *FAKED.get(words[0], "").split()]) == 0, (
        capsys.readouterr().err
    )


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
        makers[program]().parse_args(words)
    except SystemExit as end:
        # A sentence may name a command without all of its arguments.
        assert end.code == 0 or "are required" in capsys.readouterr().err


@pytest.mark.parametrize("command", WORKSTATION)
def test_a_command_of_the_workstation_does_as_it_is_written(
    command,
    bench,
    monkeypatch,
):
    if "sdh2" in command and not GRASPS.exists():
        pytest.skip("the recordings are not beside the checkout")
    monkeypatch.chdir(bench)
    scene = bench / "SCENE.toml"
    scene.write_text((ROOT / "train/scenes/demo.toml").read_text())
    if "sdh2" in command:
        for file in sdh2.files(GRASPS)[:2]:
            (bench / "FOLDER" / file.parent.name).mkdir(parents=True, exist_ok=True)
            shutil.copy(file, bench / "FOLDER" / file.parent.name)
    names = {"DIR": "made", "SCENE": str(scene)}
    written = command.replace("[", "").replace("]", "").split()[3:]
    words = [names.get(word, word) for word in written]
    more = ["--trials", "1"] if words[0] == "simulate" else []
    assert train([*words, *more]) == 0


@pytest.mark.parametrize("command", MAKE)
def test_a_make_command_says_what_it_would_do(command):
    written = re.sub("[][…]", "", command)
    process = ended(*shlex.split(written), "--dry-run")
    assert process.returncode == 0, process.stderr
    assert "python" in process.stdout


@pytest.mark.parametrize("target", TARGETS)
def test_a_make_target_exists(target):
    rules = re.findall(r"^([\w./-]+(?: [\w./-]+)*):", MAKEFILE, re.M)
    assert target in " ".join(rules).split()


@pytest.mark.parametrize("picture", re.findall(r"\]\((docs/[^)]+\.png)\)", TEXT))
def test_each_picture_is_there_and_made_by_a_target(picture):
    assert (ROOT / picture).exists()
    assert re.search(rf"^{re.escape(picture)}:", MAKEFILE, re.M)


def test_the_table_of_errnos_has_all_that_the_driver_answers():
    rows = re.findall(r"^\| (E[A-Z]+(?:, E[A-Z]+)*) \|", TEXT, re.M)
    named = [name for row in rows for name in row.split(", ")]
    assert sorted(getattr(errno, name) for name in named) == sorted(protocol.ERRORS)


def test_each_command_of_python_is_there():
    commands = {command.split()[3] for command in WORKSTATION}
    assert commands == {"import", "simulate", "show"}
    options = export_parser().format_help()
    assert all(option in options for option in ("--scaling", "--k", "--front", "--arm"))
