"""CONTRIBUTING.md: its table is true, and a toy of each kind is added as it says.

`tests/edge/wire/chips/test_kinds.py` adds a chip,
`tests/train/simulate/test_effects.py` an effect, `tests/export/test_c_code.py` a
quantity.
"""

import json
import re
import sys
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from pandas import DataFrame

import edge.app.commands
import edge.app.sinks
import edge.decide
import train
import train.importers
from edge import demo
from edge.app import cli
from edge.app.commands import run
from edge.decide.classifier import Classifier
from edge.decide.engines import ENGINES, SCORERS
from edge.decide.events import Decided
from edge.decide.info import Task
from edge.decide.model import Model
from edge.record.recording import load
from export.graph import to_onnx
from tests.conftest import ROOT
from train.__main__ import main
from train.data.feature_sets import SETS
from train.importers import forms
from train.importers.table import Table
from train.report.section import ReportTable, Section
from train.study import run as study

TABLE = re.findall(
    r"^\| (an? .*|another .*) \|$",
    (ROOT / "CONTRIBUTING.md").read_text(),
    re.M,
)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.split(" | ")[0])
def test_each_file_and_name_of_the_table_exists(row):
    paths = re.findall(r"`([\w/]+\.py)`", row)
    for path in paths:
        assert (ROOT / path.replace("NAME", "__init__")).exists(), path
    files = [ROOT / path for path in paths if "NAME" not in path]
    for name in re.findall(r"`([A-Z]{4,}|[A-Z_]{6,}|Section)`", row):
        assert any(name in file.read_text() for file in files), name


def test_the_table_has_each_kind():
    kinds = "chip|quantity|feature set|lab's data|form|message|effect|scorer|sink|subcommand"
    kinds += "|section"
    for kind, row in zip(kinds.split("|"), TABLE, strict=True):
        assert kind in row


def test_a_feature_set_is_an_entry_of_the_list(recordings, monkeypatch):
    monkeypatch.setitem(SETS, "toy", ("max_force@3", "log_contact_area@2"))
    fitted = train.fit(str(recordings), features=["toy"], quick=True, jobs=1)
    assert fitted.dataset.names == SETS["toy"]
    assert fitted.X.shape == (16, 5)


def module(package, monkeypatch, folder, text):
    """A module `toy` in a package."""
    (folder / "toy.py").write_text(text)
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
    monkeypatch.delitem(sys.modules, f"{package.__name__}.toy", raising=False)


IMPORTER = '''"""Pictures of a toy, one trial a line."""
import numpy as np
from edge.record.recording import Recording

def add_options(parser):
    parser.add_argument("--times", type=int, default=1)

def trials(path, arm, options):
    for name, *counts in (line.split() for line in path.read_text().splitlines()):
        frames = np.array(counts, dtype=np.uint16).reshape(-1, 1, 2) * options.times
        skin = {"rows": 1, "cols": 2, "threshold_counts": 3}
        yield name, Recording(0.1 * np.arange(len(frames)), frames, meta={"skin": skin})
'''


def test_an_importer_is_a_module(monkeypatch, tmp_path, capsys):
    module(train.importers, monkeypatch, tmp_path, IMPORTER)
    (tmp_path / "a.txt").write_text("first 1 2 3 4\nsecond 5 6\n")
    words = ["import", "toy", str(tmp_path / "a.txt"), "--out", str(tmp_path / "out")]
    assert main([*words, "--times", "10"]) == 0
    frames = load(tmp_path / "out" / "first.npz").frames
    assert frames.ravel().tolist() == [10, 20, 30, 40]
    with pytest.raises(SystemExit):
        main(["import", "--help"])
    line = r"toy +Pictures of a toy, one trial a line"
    assert re.search(line, capsys.readouterr().out)


class Toy:
    """A form whose lines are a time and a word of as many letters as counts."""

    @staticmethod
    def is_form(file):
        return file.head.startswith("toy")

    @staticmethod
    def tables(file, options):
        rows = [line.split() for line in file.lines[1:] if line]
        data = {"t": [float(t) for t, _ in rows], "s1": [len(word) for _, word in rows]}
        yield Table(str(file.path), DataFrame(data))


def test_a_form_of_tables_is_an_entry_of_the_list(monkeypatch, tmp_path):
    monkeypatch.setattr(forms, "FORMS", [Toy, *forms.FORMS])
    (tmp_path / "cup_1.txt").write_text("toy\n0.0 a\n0.1 abc\n")
    words = [
        "import",
        "csv",
        str(tmp_path / "cup_1.txt"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(words) == 0
    assert load(tmp_path / "out" / "cup_1.npz").frames.ravel().tolist() == [1, 3]


COMMAND = '''"""Say a word.

Says it once.
"""
from edge.app.output import Output

def add_options(parser):
    parser.add_argument("word")

def run(arguments):
    Output.of(arguments).event({"event": "toy", "word": arguments.word}, arguments.word)
    return 0
'''


def test_a_subcommand_is_a_module_and_its_name(monkeypatch, tmp_path, capsys):
    module(edge.app.commands, monkeypatch, tmp_path, COMMAND)
    monkeypatch.setitem(cli.COMMANDS, "toy", "edge.app.commands.toy")
    assert cli.main(["toy", "hello"]) == 0
    assert json.loads(capsys.readouterr().out) == {"event": "toy", "word": "hello"}
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    assert re.search(r"toy +say a word", capsys.readouterr().out)


SINK = '''"""A toy that counts."""

def add_options(parser):
    parser.add_argument("--toy", type=Path)

def open_sink(arguments, opened, model):
    return arguments.toy and Toy(arguments.toy)

class Toy:
    def __init__(self, path):
        self.path, self.lines = path, []

    def push(self, frame, events):
        self.lines += [f"{frame.t:.2f} {event.to_dict()['event']}" for event in events]

    def close(self):
        self.path.write_text("\\n".join(self.lines))

from pathlib import Path
'''


def test_a_sink_is_a_module_in_the_list(monkeypatch, tmp_path):
    module(edge.app.sinks, monkeypatch, tmp_path, SINK)
    toy = import_module("edge.app.sinks.toy")
    monkeypatch.setattr(run, "SINKS", [*run.SINKS, toy])
    touch = demo.FOLDER / "foam-block-fixed.npz"
    words = ["--model", str(demo.MODEL), "--fake", str(touch)]
    assert cli.main(["run", *words, "--toy", str(tmp_path / "events")]) == 0
    lines = (tmp_path / "events").read_text().split("\n")
    names = [line.split()[1] for line in lines]
    assert names == ["onset", *["decision"] * len(Model(demo.MODEL).info.tasks)]


def test_a_section_is_a_function_in_the_list(recordings, monkeypatch, tmp_path):
    def section(context):
        classes = {task: len(set(y)) for task, y in context.labels.items()}
        rows = [{"task": task, "classes": n} for task, n in classes.items()]
        return Section(
            "A toy", ["As it stands."], [ReportTable("toy", "Classes", rows)]
        )

    monkeypatch.setattr(study, "ANALYSES", (section,))
    monkeypatch.setattr(study, "FEWEST", 16)
    page = study.study([str(recordings)], tmp_path)
    assert "<h2>A toy</h2>" in page.read_text()
    lines = (tmp_path / "toy.csv").read_text().splitlines()
    assert lines[:2] == ["task,classes", "category,2"]
    assert np.all([line.endswith((",2", ",4")) for line in lines[1:]])


SCORER = '''"""How far the first feature lies from the mean of each label."""
import numpy as np

class Means:
    name = "numpy"

    def __init__(self, arrays, info):
        self._means = {task: arrays[f"means of {task}"] for task in info.tasks}

    def score(self, vectors, point):
        outputs = {"out_of_range": np.zeros(len(vectors))}
        for task, means in self._means.items():
            distances = np.abs(vectors[:, :1] - means)
            label = distances.argmin(axis=1)
            outputs[f"{task}_label"] = label
            outputs[f"{task}_scores"] = np.eye(len(means))[label]
            outputs[f"{task}_label_distances"] = distances
        return outputs
'''


class FittedMeans:
    """The same as nodes."""

    def __init__(self, means):
        self.means = means

    def add_nodes(self, build):
        finite = build.node("Mul", "features", 0.0)
        build.node("ReduceL1", finite, [1], keepdims=0, output="out_of_range")
        first = build.node("Gather", "features", [0], axis=1)
        for task, values in self.means.items():
            means = build.constant(np.array(values), f"means of {task}")
            apart = build.node("Sub", first, means)
            far = build.node("Mul", apart, -1.0)
            far = build.node("Max", apart, far, output=f"{task}_label_distances")
            near = build.node("Mul", far, -1.0)
            name = f"{task}_label"
            label = build.node("ArgMax", near, axis=1, keepdims=0, output=name)
            build.node("Gather", np.eye(len(values)), label, output=f"{task}_scores")


MEANS = {
    "category": [0.0, 2.0, 4.0, 6.0],
    "softness": [0.0, 5.0],
    "mobility": [0.0, 3.0],
}
LABELS = {
    "category": ("rigid-fixed", "rigid-movable", "soft-fixed", "soft-movable"),
    "softness": ("rigid", "soft"),
    "mobility": ("fixed", "movable"),
}
FACTORS = {"category": {"softness": [0, 0, 1, 1], "mobility": [0, 1, 0, 1]}}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scorer_is_a_module_nodes_and_an_entry(monkeypatch, tmp_path, engine):
    """By itself softness would be soft; the nearest answer in which all agree is
    not."""
    module(edge.decide, monkeypatch, tmp_path, SCORER)
    monkeypatch.setitem(SCORERS, "toy", "edge.decide.toy.Means")
    tasks = {
        task: Task(labels, 0, 1, "none", 0.0, factors=FACTORS.get(task, {}))
        for task, labels in LABELS.items()
    }
    blank = {
        "decision_points_s": (),
        "stopping": {},
        "outlier_score": None,
        "usual": {},
    }
    info = replace(Model(demo.MODEL).info, tasks=tasks, scorer="toy", **blank)
    path = tmp_path / "model.onnx"
    path.write_bytes(to_onnx(FittedMeans(MEANS), info))
    model = Model(path, engine)
    decisions = model.decide(np.full(info.width, 2.6))
    answers = {task: decision.label for task, decision in decisions.items()}
    expected = {"category": "rigid-movable", "softness": "rigid", "mobility": "movable"}
    assert answers == expected
    assert not any(len(decision.neighbours) for decision in decisions.values())
    touch = load(demo.FOLDER / "pillow-movable.npz")
    events = [e for e in Classifier(model).classify(touch) if isinstance(e, Decided)]
    assert {event.task for event in events} == set(tasks)
