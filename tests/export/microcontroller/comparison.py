"""A model in C beside Python, bit by bit."""

import shutil

import numpy as np
import pytest

from export import c_code
from tests.export.microcontroller import machine

TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")
needs_qemu = pytest.mark.skipif(
    not all(map(shutil.which, TOOLS)), reason=f"there is no {' or no '.join(TOOLS)}"
)
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")


def same(values, expected):
    """Whether two arrays have the same bits, but for those of what is not a number."""
    assert values.shape == expected.shape
    both_nan = np.isnan(values) & np.isnan(expected)
    return bool(((values == expected) | both_nan).all())


def assert_same(model, folder, recordings, vectors=(), error=None, board=None):
    """Ask C about vectors and recordings, and compare every bit with Python's answer."""
    c_code.export(model, folder, error)
    command = machine.compiled(folder, board)
    last = len(model.decision_points_s) - 1
    points = [last] if error is None else [*range(last + 1)]
    questions = [machine.ABOUT_ITSELF]
    expected = [[1.0]]
    for i, vector in enumerate(vectors):
        point = i % len(points)
        questions.append(machine.about_vector(point, vector))
        expected.append(machine.outputs(model, points[point], vector))
    for recording in recordings:
        questions.append(
            machine.about_recording(machine.VECTORS_OF_RECORDING, recording)
        )
        expected.append(machine.vectors(model, points, recording))
    assert same(machine.ask(command, folder, questions), np.concatenate(expected))
    assert_same_events(model, folder, command, recordings, error)


def assert_same_events(model, folder, command, recordings, error=None, slices=0):
    """Compare every bit of the events of recordings.

    Args:
        slices: of a decision that C may compute after each frame; 0: all.
    """
    kind = machine.EVENTS_OF_RECORDING + slices
    questions = [machine.about_recording(kind, r) for r in recordings]
    rows = machine.ask(command, folder, questions).reshape(-1, machine.FIELDS)
    ends = np.flatnonzero(rows[:, 0] == -1.0)
    answers = np.split(rows, ends)[:-1]
    for answer, recording in zip(answers, recordings, strict=True):
        events = machine.events(model, recording, error)
        assert same(ordered(answer[answer[:, 0] >= 0]), ordered(events))


def ordered(events):
    """By contact, kind and task: C decides a contact that has ended before its window
    does, so its events come in another order, with its release, and never short."""
    events = events.copy()
    for onset_s, released_s in events[events[:, 0] == 1][:, [1, -1]]:
        decided = (events[:, 1] == onset_s) & (events[:, 0] == 2)
        events[decided, 6] -= events[decided, 6] % 2
        events[decided, -1] = np.minimum(events[decided, -1], released_s)
    return events[np.lexsort((events[:, 2], events[:, 0], events[:, 1]))]
