"""A model in C, compiled and asked: by this machine, or by a Cortex-M of QEMU."""

import math
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.decide.classifier import Classifier, suited
from edge.decide.events import Decided, Onset, Release
from edge.decide.flags import FLAGS as ALL_FLAGS
from tests.conftest import ROOT

HERE = Path(__file__).parent
CORTEX = ROOT / "docs" / "examples" / "firmware" / "cortex"
VECTOR, VECTORS_OF_RECORDING, COSTS, SELFTEST, EVENTS_OF_RECORDING = range(5)
ABOUT_ITSELF = struct.pack("<II", SELFTEST, 0)
"""The question whether `ec_selftest` passes."""
WARNINGS = "-Wall -Wextra -Werror -Wconversion -Wdouble-promotion -pedantic"
COMMON = f"-std=c99 -Os -ffp-contract=off {WARNINGS}".split()
DEFINED = "-fsanitize=undefined -fno-sanitize-recover=all".split()
"""What C leaves undefined ends the program."""
SANITIZED = [*DEFINED, "-fsanitize=address"]
BOARDS = {
    "M0+": ("cortex-m0plus", "", "mps2-an385", 0x00000000, 0x20000000),
    "M4F": (
        "cortex-m4",
        "-mfpu=fpv4-sp-d16 -mfloat-abi=hard",
        "mps2-an386",
        0,
        0x20000000,
    ),
    "M33": ("cortex-m33", "", "mps2-an505", 0x10000000, 0x38000000),
}
"""{processor: its name for gcc, its options, QEMU's board, where code and RAM lie}.
QEMU has no board with a Cortex-M0+ of enough memory; its code runs on a Cortex-M3."""
LACKING = ("no_contact", "speed", "near_contact", "skin_motion")
FLAGS = [flag for flag in ALL_FLAGS if flag not in LACKING]
"""In the order of their bits in C."""
FIELDS = 10
"""Numbers of an event."""


def without_an_arm(model):
    """A model that takes motion on the skin."""
    model.info = replace(model.info, chain=None, joints=0, motion_frame="skin")
    return model


def tools(board, specs="rdimon"):
    """The words that compile for a processor, and those that run a program on it."""
    cpu, options, machine, code, ram = BOARDS[board]
    gcc = ["arm-none-eabi-gcc", f"-mcpu={cpu}", "-mthumb", *options.split()]
    gcc += [f"--specs={specs}.specs", f"-Wl,--defsym=CODE={code},--defsym=RAM={ram}"]
    gcc += ["-T", CORTEX / "board.ld", CORTEX / "startup.c"]
    qemu = f"qemu-system-arm -M {machine} -nographic -semihosting -kernel"
    return gcc, qemu.split()


def compiled(folder, board=None, options=SANITIZED):
    """The command that answers `input.bin` in a folder of C."""
    rooms = [path for path in folder.glob("*.c") if path.name != "main.c"]
    program = folder / f"answer-{board or 'host'}"
    gcc, command = tools(board) if board else (["gcc"], [])
    words = [
        *gcc,
        *COMMON,
        *([] if board else options),
        "-I",
        folder,
        *rooms,
        HERE / "host.c",
        "-o",
        program,
    ]
    subprocess.run(words, check=True)
    return [*command, program]


def ask(command, folder, questions):
    """The numbers that answer questions.

    Raises:
        RuntimeError: a frame was refused, or the program failed.
    """
    (folder / "input.bin").write_bytes(b"".join(questions))
    ended = subprocess.run(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    if ended.returncode or ended.stderr:
        raise RuntimeError(ended.stderr or ended.returncode)
    return np.fromfile(folder / "output.bin")


def about_vector(point, vector):
    return struct.pack("<II", VECTOR, point) + np.asarray(vector, "<f8").tobytes()


def about_recording(kind, recording):
    parts = [struct.pack("<II", kind, len(recording.t))]
    for frame in recording:
        joints = np.zeros(16)
        if frame.joints is not None:
            joints[: len(frame.joints)] = frame.joints
        valid = (
            np.ones(frame.counts.shape, bool) if frame.valid is None else frame.valid
        )
        parts += [struct.pack("<d", frame.t), joints.tobytes()]
        parts.append(struct.pack("?", frame.joints is not None))
        parts += [frame.counts.astype("<u2").tobytes(), valid.tobytes()]
    return b"".join(parts)


def outputs(model, point, vector):
    """What the graph gives, in the order of `give_outputs`."""
    values = model.run(np.asarray(vector, float)[None], point)
    tasks = model.info.tasks
    refused = min(values[f"{task}_label"] for task in tasks) < 0
    ends = "label scores distances neighbours label_distances".split()
    names = [f"{task}_{end}" for task in tasks for end in ends[: 2 if refused else 5]]
    names += [] if refused else ["out_of_range", "outlier_score", "known_distance"]
    parts = [values[name].reshape(-1) for name in names if name in values]
    return np.concatenate(parts).astype(float)


def vectors(model, points, recording):
    """As `give_vectors`: of the first contact, each when its window ends."""
    tracker = model.info.tracker(recording.layout)
    windows_s = [model.decision_points_s[point] for point in points]
    measured = []
    contact = None
    for frame in recording:
        for contact in tracker.push(frame):
            age_s = math.inf if contact.ended else frame.t - contact.onset_s
            while windows_s and age_s >= windows_s[0]:
                measured.append(model.info.vector(contact.series(), windows_s.pop(0)))
        if not windows_s or (contact is not None and contact.ended):
            break
    if contact is None:
        return np.array([0.0])
    measured += [model.info.vector(contact.series(), window) for window in windows_s]
    return np.concatenate([[1.0], *measured])


def events(model, recording, error=None):
    """As `classify` in host.c, of an event a row; the last number is the time of the
    frame that brought it about."""
    classifier = Classifier(model, recording.layout, error=error)
    rows = []
    for frame in suited(model, recording, "the recording"):
        rows += [[*fields(model, e), frame.t] for e in classifier.push(frame)]
    rows += [[*fields(model, e), frame.t] for e in classifier.finish()]
    told = [row for row in rows if len(row) == FIELDS]
    return np.array(told, float).reshape(-1, FIELDS)


def fields(model, event):
    """The numbers of an event; none of one that C does not tell."""
    if isinstance(event, Onset | Release):
        kind = float(isinstance(event, Release))
        return [kind, event.onset_s, 0, -1, 0, 0, 0, 0, 0]
    if not isinstance(event, Decided):
        return []
    labels = model.info.tasks[event.task].labels
    label = -1 if event.label is None else labels.index(event.label)
    flags = sum(1 << i for i, flag in enumerate(FLAGS) if flag in event.flags)
    confidence = math.nan if event.confidence is None else event.confidence
    decision = event.decision
    nearest = 0 if decision is None else int(decision.neighbours[0])
    stopped = (None, "confidence", "window").index(event.stopped_by)
    task = list(model.info.tasks).index(event.task)
    row = [2, event.onset_s, task, label, event.window_s, confidence, flags]
    return [*row, nearest, stopped]
