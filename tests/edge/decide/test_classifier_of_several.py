"""Several contacts at once, each with its own decisions and its position, decided with
a few questions a frame."""

import subprocess
import sys
from collections import defaultdict
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from edge import demo
from edge.decide.classifier import FEWEST_ASKED, Classifier
from edge.decide.events import Decided, Onset
from edge.decide.model import Model
from edge.record.recording import load
from edge.record.saving import save
from edge.touch.frame import Frame
from tests.conftest import ROOT, export, save_touches

PLACES = [(row, col) for row in (0, 4, 8, 12) for col in (0, 6, 12, 18)]

ERROR = 0.9
AT_ONCE = 1e9
"""Questions a second that hold nothing back."""


@pytest.fixture(scope="module")
def early(tmp_path_factory):
    """A model that decides at several points of time."""
    folder = tmp_path_factory.mktemp("early")
    touches = save_touches(folder / "touches", 16)
    fixed = ["--decision-points", "0.4:1.2:0.4", "--features", "paper"]
    fixed += ["--projection", "pca", "--components", "4", "-k", "1", "--jobs", "1"]
    return Model(export(folder / "model", "--data", touches, *fixed) / "model.onnx")


def frames(dof):
    """Touches of two by two taxels that all begin at once."""
    for i in range(190):
        counts = np.zeros((16, 24), np.uint16)
        for number, (row, col) in enumerate(PLACES):
            if i >= 20:
                strength = 400 + (8 + 3 * number) * (i - 20)
                counts[row : row + 2, col : col + 2] = strength
        yield Frame(0.01 * i, counts, joints=np.full(dof, 0.001 * i))


def decided(model, error, stop=None, step=1):
    """The classifier's events, each with the time of its frame, and the questions that
    each frame asked."""
    questions = [0]
    decide = model.decide

    def counted(*arguments):
        questions[-1] += 1
        return decide(*arguments)

    classifier = Classifier(model, error=error, max_contacts=len(PLACES))
    events = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "decide", counted)
        for frame in islice(frames(model.info.dof or 0), 0, stop, step):
            events += [(frame.t, event) for event in classifier.push(frame)]
            questions.append(0)
        events += [(frame.t, event) for event in classifier.finish()]
    return events, questions[:-1]


def answers_of(events):
    """{contact and task: what was answered}."""
    return {
        (event.contact, event.task): (event.label, event.window_s, event.confidence)
        for _, event in events
        if isinstance(event, Decided)
    }


@pytest.mark.parametrize("error", [None, ERROR])
def test_no_frame_asks_more_than_a_few_questions_and_the_answers_are_the_same(
    early,
    error,
    monkeypatch,
):
    spread, questions = decided(early, error)
    assert sum(isinstance(event, Onset) for _, event in spread) == len(PLACES)
    assert max(questions) == FEWEST_ASKED
    monkeypatch.setattr("edge.decide.classifier.ASKED_A_SECOND", AT_ONCE)
    at_once, questions = decided(early, error)
    assert max(questions) == len(PLACES)
    assert len(answers_of(at_once)) == len(PLACES) * len(early.info.tasks)
    assert answers_of(spread) == answers_of(at_once)
    assert sum(isinstance(event, Decided) for _, event in spread) == len(
        answers_of(at_once)
    )


FIRST = """\
import sys, edge
from edge import demo
recording = edge.load(demo.recordings()[0])
classifier = edge.Classifier(edge.Model(demo.MODEL), recording.layout)
before = set(sys.modules)
decided = sum(isinstance(e, edge.Decided) for f in recording for e in classifier.push(f))
print(decided, *sorted(set(sys.modules) - before))
"""


def test_the_first_decision_imports_little():
    """Importing in the midst of a decision takes a board a tenth of a second."""
    process = subprocess.run(
        [sys.executable, "-c", FIRST],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert process.stdout.split() == ["3"]


MODEL = Model(demo.MODEL)


def test_a_single_contact_is_followed_as_by_the_largest_region():
    """One code for onset, series and decision: the same events but for number and
    place."""
    for path in demo.recordings():
        recording = load(path)
        expected = stripped(Classifier(MODEL).classify(recording))
        events = list(Classifier(MODEL, max_contacts=8).classify(recording))
        number = next(e.contact for e in events if isinstance(e, Decided))
        assert stripped(e for e in events if e.contact == number) == expected


def stripped(events):
    """Events as they are written, without number and place."""
    return [strip(event.to_dict()) for event in events]


def strip(event):
    unequal = ("contact", "position", "latency_ms")
    return {key: value for key, value in event.items() if key not in unequal}


@pytest.fixture(scope="module")
def two_touches():
    """Two of the demo's touches on one skin, half a turn and 0.32 s apart."""
    a, b = (
        load(demo.FOLDER / f"cardboard-box-{how}.npz") for how in ("fixed", "movable")
    )
    late = 8  # at 25 Hz
    n = min(len(a.t), len(b.t)) + late
    frames = np.zeros((n, *a.frames.shape[1:]), dtype=np.uint16)
    frames[: len(a.t)] = np.where(a.frames > 60, a.frames, 0)[:n]
    frames[late : late + len(b.t)] += np.roll(
        np.where(b.frames > 60, b.frames, 0),
        12,
        2,
    )[: n - late]
    t = np.arange(n) / 25.0
    joints = np.concatenate([a.joints, np.repeat(a.joints[-1:], n, axis=0)])[:n]
    return replace(a, t=t, frames=frames, joints=joints, meta={**a.meta, "labels": {}})


def test_each_contact_is_decided_and_placed_on_its_own(two_touches, tmp_path, edge):
    save(tmp_path / "both.npz", two_touches)
    options = ("--model", demo.MODEL, "--fake", tmp_path / "both.npz")
    status, lines, _ = edge("run", *options, "--contacts", 2)
    assert status == 0
    first, second = by_contact(lines)
    assert {d["task"]: d["label"] for d in first} == {
        "category": "rigid-fixed",
        "mobility": "fixed",
        "object": "cardboard box",
    }
    late_s = second[0]["onset_s"] - first[0]["onset_s"]
    assert late_s == pytest.approx(0.36, abs=0.02)  # 0.04 their own
    places = [first[0]["position"], second[0]["position"]]
    # Opposite sides of the forearm.
    assert np.linalg.norm(np.subtract(*places)) > two_touches.layout.radius_m


def by_contact(lines):
    """The decisions of each contact, in the order of their numbers."""
    contacts = defaultdict(list)
    for line in lines:
        if line["event"] == "decision":
            contacts[line["contact"]].append(line)
    return [contacts[number] for number in sorted(contacts)]
