"""docs/: the tutorial and the notebook run as written, and links and paths exist."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from edge import cli
from edge.chips import block
from edge.chips.chip import MOST_TAXELS
from edge.model.info import FORMAT
from export.__main__ import main as export
from tests.conftest import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def commands():
    """The tutorial's shell commands, without the first block, which makes the
    environment."""
    blocks = re.findall(r"```sh\n(.*?)```", (DOCS / "tutorial.md").read_text(), re.S)
    return [line for lines in blocks[1:] for line in lines.splitlines()]


def test_the_tutorial_runs_as_it_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ran = []
    for line in commands():
        words = shlex.split(line, comments=True)
        if words[0] == "cp":
            shutil.copy(ROOT / words[1], words[2])
            continue
        run = cli.main if words[0] == "edge-classify" else export
        given = (
            words[1:] if words[0] == "edge-classify" else [*words[3:], "--jobs", "1"]
        )
        assert run(given) == 0, (line, capsys.readouterr().err)
        ran.append(words[1])
    first = ["check", "fake", "calibrate", "record", "-m", "info"]
    assert ran == [*first, "fake", "verify", "run", "replay"]
    events = [
        json.loads(x) for x in capsys.readouterr().out.splitlines() if x.startswith("{")
    ]
    assert {e["label"] for e in events if e.get("task") == "object"} >= {
        "pillow",
        "foam block",
    }


def test_the_two_evenings_mend_a_mistake(tmp_path):
    text = (DOCS / "evenings.md").read_text()
    script = "".join(re.findall(r"```sh\n(.*?)```", text, re.S))
    programs = Path(sys.executable).parent
    environment = {
        **os.environ,
        "PATH": f"{programs}:{os.environ['PATH']}",
        "PROJECT": str(ROOT),
    }
    ran = subprocess.run(
        ["bash", "-e", "-c", script],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    events = [json.loads(x) for x in ran.stdout.splitlines() if x.startswith("{")]
    objects = [e["label"] for e in events if e.get("task") == "object"]
    before = objects[0]
    after = objects[-1]
    assert before != "pillow"
    assert after == "pillow"


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(DOCS / "first-touch.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    nbclient.NotebookClient(
        notebook, timeout=120, resources={"metadata": {"path": ROOT}}
    ).execute()
    (printed,) = (
        o.text
        for cell in notebook.cells
        for o in cell.get("outputs", ())
        if o.output_type == "stream"
    )
    assert "label='soft-fixed'" in printed


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_page_is_on_the_site_and_its_links_and_paths_lead_somewhere(page):
    assert f": {page.name}" in (ROOT / "mkdocs.yml").read_text()
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        assert link.startswith("https://") or (DOCS / link).exists(), link
    prose = re.sub(r"```.*?```", "", page.read_text(), flags=re.S)
    for named in re.findall(r"`((?:edge|train|docs/examples|tests)/[\w./-]+)`", prose):
        assert (ROOT / named).exists(), named


def test_the_table_of_formats_ends_with_the_one_that_is_written():
    rows = re.findall(
        r"^\| ([\d, ]+) \| .*versions? ?|^\| ([\d, ]+) \|",
        (DOCS / "formats.md").read_text(),
        re.M,
    )
    numbers = [int(n) for row in rows for part in row if part for n in part.split(",")]
    assert numbers == list(range(1, FORMAT + 1))


def test_the_block_protocol_is_described_as_it_is():
    text = (DOCS / "block-protocol.md").read_text()
    assert f"`{block.crc16(b'123456789'):#06x}`".replace("0x29b1", "0x29B1") in text
    assert f"at most {MOST_TAXELS} taxels" in text
    assert block.pack(np.array([0xABC, 0xDEF], "u2"), 12).hex(" ").upper() in text
