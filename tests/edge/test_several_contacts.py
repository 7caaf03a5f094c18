"""Several contacts at once are decided with a few questions a frame."""

import subprocess
import sys
from itertools import islice

import numpy as np
import pytest

from edge.classifier import ASKED_A_SECOND, FEWEST_ASKED, Classifier
from edge.events import Decided, Onset
from edge.model.model import Model
from edge.touch.frame import Frame
from tests.conftest import ROOT, export, save_touches

PLACES = [(row, col) for row in (0, 4, 8, 12) for col in (0, 6, 12, 18)]
POINTS_S = (0.4, 0.8, 1.2)
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
    monkeypatch.setattr("edge.classifier.ASKED_A_SECOND", AT_ONCE)
    at_once, questions = decided(early, error)
    assert max(questions) == len(PLACES)
    assert len(answers_of(at_once)) == len(PLACES) * len(early.info.tasks)
    assert answers_of(spread) == answers_of(at_once)
    assert sum(isinstance(event, Decided) for _, event in spread) == len(
        answers_of(at_once)
    )


def test_a_slow_skin_asks_more_a_frame_so_that_no_answer_comes_late(early):
    """At 20 Hz a frame has five times as long as at 100 Hz."""
    events, _ = decided(early, ERROR, step=5)
    late_s = [
        t - event.onset_s - event.window_s
        for t, event in events
        if isinstance(event, Decided)
    ]
    assert late_s
    assert max(late_s) <= len(PLACES) / ASKED_A_SECOND + 0.05


def test_a_stream_that_ends_is_asked_about_all_that_is_due(early, monkeypatch):
    """Decision points that have come are not passed over for the full window."""
    spread, _ = decided(early, ERROR, stop=83)
    monkeypatch.setattr("edge.classifier.ASKED_A_SECOND", AT_ONCE)
    at_once, _ = decided(early, ERROR, stop=83)
    assert answers_of(at_once)
    assert answers_of(spread) == answers_of(at_once)


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
    done = subprocess.run(
        [sys.executable, "-c", FIRST],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["3"]
