"""docs/: the tutorial and the notebook run as written, and links and paths exist."""

import json
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from edge.app import cli
from edge.decide.info import FORMAT
from edge.wire.chips import block
from edge.wire.chips.chip import MOST_TAXELS
from export.__main__ import main as export
from tests.conftest import ROOT, ended

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def commands():
    """The tutorial's shell commands, without the first block, which makes the
    environment."""
    blocks = re.findall(r"```sh\n(.*?)```", (DOCS / "tutorial.md").read_text(), re.S)
    return [line for lines in blocks[1:] for line in lines.splitlines()]


def objects(text):
    """The objects that a program decided on, of the lines of JSON that it printed."""
    events = [json.loads(x) for x in text.splitlines() if x.startswith("{")]
    return [event["label"] for event in events if event.get("task") == "object"]


@pytest.mark.slow
def test_the_tutorial_runs_as_it_is_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ran = []
    for line in commands():
        words = shlex.split(line, comments=True)
        if words[0] == "cp":
            shutil.copy(ROOT / words[1], words[2])
            continue
        if words[0] == "edge-classify":
            status = cli.main(words[1:])
        else:
            status = export([*words[3:], "--jobs", "1"])
        assert status == 0, (line, capsys.readouterr().err)
        ran.append(words[1])
    first = ["check", "fake", "calibrate", "record", "-m", "info"]
    assert ran == [*first, "fake", "verify", "run", "replay"]
    assert {*objects(capsys.readouterr().out)} >= {"pillow", "foam block"}


@pytest.mark.slow
def test_the_two_evenings_mend_a_mistake(tmp_path):
    text = (DOCS / "evenings.md").read_text()
    script = "".join(re.findall(r"```sh\n(.*?)```", text, re.S))
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PROJECT": str(ROOT)}
    ran = ended("bash", "-e", "-c", script, cwd=tmp_path, env=environment)
    assert ran.returncode == 0, ran.stderr
    # Five touches, with a model of two objects; then one, with a model that knows it.
    *before, after = objects(ran.stdout)[:6]
    assert "pillow" not in before
    assert after == "pillow"
    touches = [json.loads(x) for x in ran.stdout.splitlines() if '"kinds": ["uns' in x]
    assert len({line["file"] for line in touches if "unlabelled" in line["kinds"]}) == 5
    assert ran.stderr.count("record a third object") == 2


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(DOCS / "first-touch.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    resources = {"metadata": {"path": ROOT}}
    nbclient.NotebookClient(notebook, resources=resources).execute()
    outputs = [o for cell in notebook.cells for o in cell.get("outputs", ())]
    (printed,) = (o.text for o in outputs if o.output_type == "stream")
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
    rows = re.findall(r"^\| ([\d, ]+) \|", (DOCS / "formats.md").read_text(), re.M)
    numbers = [int(number) for row in rows for number in row.split(",")]
    assert numbers == list(range(1, FORMAT + 1))


def test_the_block_protocol_is_described_as_it_is():
    text = (DOCS / "block-protocol.md").read_text()
    assert f"`{block.crc16(b'123456789'):#06x}`".replace("0x29b1", "0x29B1") in text
    assert f"at most {MOST_TAXELS} taxels" in text
    assert block.pack(np.array([0xABC, 0xDEF], "u2"), 12).hex(" ").upper() in text
