"""Each reader of a file: its command, and the valid files that are damaged for it."""

import bz2
import contextlib
import io
import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from edge.app.cli import main as edge_main
from edge.decide.engines import ENGINES
from edge.decide.model import Model
from edge.errors import InputError
from edge.touch.arm import Chain
from tests.checks.fuzz import mutate
from tests.edge.touch.test_urdf import ARM
from tests.train.importers.ros import (
    FRAMES,
    array,
    skin,
    write_bag,
    write_mcap,
)
from tests.train.importers.test_sdh2 import dsa
from train.__main__ import main as train_main
from train.simulate.scene import load as load_scene

ROOT = Path(__file__).parents[3]
DEMO = ROOT / "edge" / "demo"
MODEL = DEMO / "model.onnx"


UNPRINTABLE = re.compile(r"[\0-\x08\n-\x1f\x7f-\x9f\u2028\u202e\ud800-\udfff]")
"""Characters that act on a terminal or that no file can hold."""


class Wrong(AssertionError):
    """A reader broke its contract."""


@dataclass(frozen=True)
class Reader:
    """A reader of files.

    Attributes:
        name: of the reader.
        suffix: of its files.
        seeds: makes the valid files that are damaged.
        mutate: damages a file.
        read: reads a file as a user's command does; may raise `EdgeError`.
        beside: writes other files that the reader needs beside the file.
    """

    name: str
    suffix: str
    seeds: Callable[[], list[bytes]]
    mutate: Callable[[bytes, Random], bytes]
    read: Callable[[Path], Any]
    beside: Callable[[Path], Any] = lambda path: None


def command(main, *words):
    """Run a command line and check its exit status and its output.

    Raises:
        InputError: the exit status is 2; all that it printed to stderr.
        Wrong: the exit status or a printed text is not allowed.
    """
    out = io.StringIO()
    err = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([str(word) for word in words])
    errors = err.getvalue().replace("\r", "\n").strip()
    if status not in (0, 1, 2) or (status == 2 and not errors):
        raise Wrong(f"exit status {status} with {errors!r} on stderr")
    if characters := UNPRINTABLE.findall((out.getvalue() + errors).replace("\n", "")):
        raise Wrong(f"prints {characters} unescaped")
    if status == 2:
        raise InputError(" ".join(errors.splitlines()))


def importing(kind, *more):
    """`python -m train import KIND`."""

    def read(path):
        out = path.parent / "out"
        shutil.rmtree(out, ignore_errors=True)
        command(train_main, "import", kind, path, "--out", out, *more)

    return read


def files(*patterns):
    """The files of the checkout that match."""
    return lambda: [
        p.read_bytes() for pattern in patterns for p in sorted(ROOT.glob(pattern))
    ]


def recordings():
    """A few frames of two shipped recordings, the second with a mask of readable
    taxels."""
    out = []
    for name in ("pillow-movable", "cardboard-box-fixed"):
        arrays = dict(np.load(DEMO / f"{name}.npz"))
        arrays |= {key: arrays[key][10:90] for key in ("t", "frames", "joints")}
        if out:
            arrays["valid"] = np.ones(arrays["frames"].shape[1:], bool)
        file = io.BytesIO()
        np.savez(file, **arrays)
        out.append(file.getvalue())
    return out


def read_model(path):
    """Load a model and ask it once, by numpy too where ONNX Runtime takes it."""
    for engine in ENGINES:
        model = Model(path, engine)
        for task, decision in model.decide(np.ones(model.info.width)).items():
            confidence = decision.confidence
            if confidence is not None and not 0.0 <= confidence <= 1.0:
                raise Wrong(f"{task} has a confidence of {confidence}")


def skins():
    """The shipped skins, and the first of them calibrated."""
    shipped = files("edge/skins/*.toml")()
    rows, noise = (
        ", ".join([f"[{', '.join([x] * 24)}]"] * 16) for x in ("20000", "1.5")
    )
    calibration = f"\n[calibration]\nbaseline = [{rows}]\nnoise = [{noise}]\n"
    return [*shipped, shipped[0] + calibration.encode()]


def read_chain(path):
    """Load an arm and compute a pose."""
    urdf = path.suffix == ".urdf"
    chain = Chain.from_urdf(path, "base", "lower") if urdf else Chain.from_toml(path)
    if not np.isfinite(chain.pose(np.full(chain.dof, 0.5))).all():
        raise Wrong("a pose is not finite")


def read_grasp(path):
    """Import the XML as the only grasp of a folder."""
    folder = path.parent / "grasps"
    (folder / "cup").mkdir(parents=True, exist_ok=True)
    (folder / "cup" / "a.dsa").write_bytes(bz2.compress(path.read_bytes()))
    importing("sdh2")(folder)


def bytes_of(write):
    """The bytes of a file that a function writes."""
    with tempfile.TemporaryDirectory() as folder:
        return write(Path(folder) / "log").read_bytes()


def logs():
    """An MCAP file of arrays."""
    topic = skin([array(frame, dims=frame.shape) for frame in FRAMES])
    return [bytes_of(lambda path: write_mcap(path.with_suffix(".mcap"), topic))]


def bags():
    """A ROS 1 bag of arrays."""
    topic = skin([array(frame, version=1, dims=frame.shape) for frame in FRAMES])
    return [
        bytes_of(lambda path: write_bag(path.with_suffix(".bag"), topic, version=1))
    ]


FRAME_FILES = [
    b"one/a.csv\n1,2,3\n4,5,6\n",
    b"labels.csv\ntrial,object\none,cup\n",
    b'skin.json\n{"threshold_counts": 50, "wraps": false}',
]
"""Files of a folder of CSV recordings: the first line is the name."""


def of_frames(data, draw):
    """The contents damaged, not the name."""
    name, contents = data.split(b"\n", 1)
    return name + b"\n" + mutate.of_text(contents, draw)


def read_frames(path):
    """Import a folder in which one file is damaged."""
    folder = path.parent / "csv"
    (folder / "one").mkdir(parents=True, exist_ok=True)
    for data in (*FRAME_FILES, b"one/b.csv\n1,2,3\n4,5,6\n", path.read_bytes()):
        name, contents = data.split(b"\n", 1)
        (folder / name.decode("ascii")).write_bytes(contents)
    importing("csv", "--frames", "--rate", "100")(folder)


TABLES = [
    b"time,p1,p2\n0,245,244\n0.1,240,244\n0.2,230,241\n",
    b"trial\tobject\tt\ttaxel\tvalue\n1\tcup\t0\t0\t9\n1\tcup\t0\t1\t8\n2\tpen\t0\t0\t7\n2\tpen\t0\t1\t7\n",
]
"""A trial of a sensor whose values fall, and two trials with a value a row."""

LOGS = [
    b'{"t": 0.0, "p": [1, 2]}\n{"t": 0.1, "p": [3, 4]}\n',
    b'{"payload": {"interval_ms": 10, "sensors": [{"name": "s1"}], "values": [[1], [2]]}}',
    b"SECONDS_PER_FRAME 0.01\nFrame 1\n1,B\n3,4\nFrame 2\n5,6\n7,8\n",
    b"CLEARDATA\nLABEL,Time,p1,millis\nDATA,TIME,1,0\nDATA,TIME,2,10\n",
    b"1700000000,0,skin,1,2\n1700000000,10000000,skin,3,4\n",
    b"12:00:00.000 -> s1:1\ts2:2\n12:00:00.010 -> s1:3\ts2:4\n",
]
"""A file of each form that is no table."""

READERS = (
    Reader(
        "recording",
        ".npz",
        recordings,
        mutate.of_npz,
        lambda path: command(edge_main, "replay", "--summary", "--model", MODEL, path),
    ),
    Reader(
        "model",
        ".onnx",
        files("tests/golden/model.onnx", "edge/demo/model.onnx"),
        mutate.of_onnx,
        read_model,
    ),
    Reader(
        "golden",
        ".npz",
        files("tests/golden/demo.npz"),
        mutate.of_npz,
        lambda path: command(edge_main, "verify", "--model", MODEL, "--golden", path),
    ),
    Reader(
        "skin",
        ".toml",
        skins,
        mutate.of_text,
        lambda path: command(edge_main, "check", path),
    ),
    Reader("arm", ".toml", files("edge/arms/cody.toml"), mutate.of_text, read_chain),
    Reader("urdf", ".urdf", lambda: [ARM.encode()], mutate.of_text, read_chain),
    Reader(
        "scene",
        ".toml",
        files("train/scenes/*.toml"),
        mutate.of_text,
        load_scene,
        lambda path: [
            shutil.copy(ROOT / "train" / "scenes" / name, path.parent)
            for name in ("cody18.toml", "household.toml")
        ],
    ),
    Reader("sdh2", ".xml", lambda: [dsa().encode()], mutate.of_text, read_grasp),
    Reader("csv", ".csv", lambda: TABLES, mutate.of_text, importing("csv", "--falls")),
    Reader("forms", ".txt", lambda: LOGS, mutate.of_text, importing("csv")),
    Reader("csv_frames", ".one", lambda: FRAME_FILES, of_frames, read_frames),
    Reader("mcap", ".mcap", logs, mutate.of_bytes, importing("rosbag")),
    Reader("rosbag", ".bag", bags, mutate.of_bytes, importing("rosbag")),
)
