"""Numbers that are not finite are refused wherever frames, angles and vectors enter."""

import json
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from edge.errors import InputError
from edge.recording import Recording
from edge.saving import save
from edge.touch.arm import Chain, Joint
from edge.touch.frame import Frame
from edge.touch.joint_stream import Joints
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker
from tests.hard_cases.cases import Case
from tests.hard_cases.frames import FOREARM, taxels
from tests.hard_cases.models import (
    Ours,
    converted,
    features,
    labels_for,
    usual_pipeline,
)
from train.__main__ import parser
from train.choose.crossval import neighbours
from train.model.pipeline import Choice, ContactClassifier
from train.model.projection import Projection

BAD = (float("nan"), float("inf"), float("-inf"))


def recording(bad, key):
    t = np.arange(3.0)
    joints = np.zeros((3, 5))
    {"t": t, "joints": joints.reshape(-1)}[key][2] = bad
    trial = Recording(t, np.zeros((3, 4, 4), np.uint16), joints, None, {})
    with tempfile.TemporaryDirectory() as folder:
        save(Path(folder) / "x.npz", trial)


def frame(bad, key):
    times = np.full((16, 24), bad if key == "times" else 0.0)
    joints = np.full(5, bad if key == "joints" else 0.0)
    tracker = ContactTracker(FOREARM, chain=Chain.cody())
    t = bad if key == "t" else 0.0
    tracker.push(Frame(t, taxels((3, 3)), times=times, joints=joints))


def line(bad):
    lines = iter([json.dumps({"t": 1.0, "q": [bad]}).encode() + b"\n", None])
    joints = Joints(lambda: next(lines), dof=1, now=lambda: 1.0)
    if joints.at(1.0) is None and joints.malformed == 1:
        raise InputError(joints.problem)


@cache
def small_model():
    return Ours(features(30), choice=Choice("none", 5, 3))


def graph(bad):
    """Every position in one batch; the graph itself answers -1 and votes for
    nothing."""
    queries = np.repeat(features(1, 1), 121, axis=0)
    queries[np.arange(120), np.arange(120)] = bad
    answer = small_model().model.run(queries)
    refused = (answer["t_label"][:120] == -1).all() and not answer["t_scores"][
        :120
    ].any()
    if refused and answer["t_label"][120] >= 0:
        raise InputError("label -1")


def spoiled(bad, count=12):
    """Vectors of which one has a bad value."""
    X = features(count)
    X[0, 43] = bad
    return X


def csv_frames(bad):
    """A folder of frames whose times are bad in their names."""
    with tempfile.TemporaryDirectory() as folder:
        trial = Path(folder) / "trial"
        trial.mkdir()
        for name in ("0.0", f"{bad}"):
            (trial / f"{name}.csv").write_text("1,2\n3,4\n")
        words = ["import", "csv", folder, "--frames", "--out", folder]
        options = parser().parse_args(words)
        list(options.importer.trials(Path(folder), None, options))


ENTRIES = {
    "a recording's times, written": lambda bad: recording(bad, "t"),
    "a recording's joint angles, written": lambda bad: recording(bad, "joints"),
    "a frame's time": lambda bad: frame(bad, "t"),
    "a frame's chip times": lambda bad: frame(bad, "times"),
    "a frame's joint angles": lambda bad: frame(bad, "joints"),
    "a line of joint angles": line,
    "an angle given to the arm": lambda bad: Chain.cody().pose([bad] * 5),
    "an arm's axis": lambda bad: Chain([Joint("j", (0.0, 0.0, bad))]),
    "a skin's scale": lambda bad: SkinLayout.from_dict(
        {"rows": 2, "cols": 2, "counts_per_newton": bad}
    ),
    "a skin's pitch": lambda bad: SkinLayout.from_dict(
        {"rows": 2, "cols": 2, "pitch_m": bad}
    ),
    "a feature vector": lambda bad: small_model().model.decide(spoiled(bad, 1)[0]),
    "the graph": graph,
    "a training vector": lambda bad: ContactClassifier({"t": Choice("none", 2, 1)}).fit(
        spoiled(bad), {"t": labels_for(features(12))}
    ),
    "leave-one-out": lambda bad: neighbours(spoiled(bad)),
    "the names of CSV frames": csv_frames,
}


SIZES = {
    "a vector, infinite once scaled": lambda size: small_model().model.decide(
        np.full(120, size)
    ),
    "units of training vectors": lambda size: Projection("none", 3).fit(
        features(20) * size
    ),
}
BEYOND = [("a vector, infinite once scaled", size) for size in (1e303, -1e305, 1.7e308)]
BEYOND += [
    ("units of training vectors", size) for size in (1e-300, 1e-40, 1e105, 1e300)
]


def let_in(entry, bad):
    """1 where an entry takes a value that is not finite, or that float64 cannot hold
    scaled."""
    try:
        (ENTRIES | SIZES)[entry](bad)
    except InputError:
        return 0.0
    return 1.0


def usual():
    X = features(30)
    pipe = usual_pipeline(X, 5, 1, np.arange(30))
    queries = np.repeat(features(1, 1), 3, axis=0)
    queries[:, 43] = BAD
    rows = converted(pipe, X)(queries).tolist()
    try:
        pipe.predict(queries)
        raises = "answers"
    except ValueError:
        raises = "raises"
    return f"skl2onnx answers NaN, inf and -inf with rows {rows}; scikit-learn {raises}"


CASES = [
    Case(
        f"refusals: NaN and infinity at {len(ENTRIES)} places where they can enter",
        "one sentence, no result",
        "let in",
        let_in,
        [{"entry": entry, "bad": bad} for entry in ENTRIES for bad in BAD],
        usual=usual,
    ),
    Case(
        "refusals: finite, but beyond float64 once scaled",
        "one sentence, no result",
        "let in",
        let_in,
        [{"entry": entry, "bad": size} for entry, size in BEYOND],
    ),
]
