"""Every reader of a file, the valid files it is fed first, and how they are made hostile."""

from __future__ import annotations

import bz2
import contextlib
import io
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

import numpy as np

from edge.errors import InputError
from tests.fuzz import mutate

ROOT = Path(__file__).parents[2]
MODEL = ROOT / "tests" / "golden" / "model.onnx"


BIDI = "\u2028\u2029\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""They break a line, or turn it round."""


class Wrong(AssertionError):
    """A reader ended otherwise than its contract says."""


@dataclass(frozen=True)
class Reader:
    """A reader of files.

    Attributes:
        name: of the reader.
        suffix: of its files.
        seeds: valid files, one of which each input comes from.
        mutate: makes a file hostile.
        read: reads a file as a user's command does; `EdgeError` is one sentence, as it should be.
        more: writes what stands beside the file.
    """

    name: str
    suffix: str
    seeds: Callable[[], list[bytes]]
    mutate: Callable[[bytes, Random], bytes]
    read: Callable[[Path], None]
    more: Callable[[Path], None] = lambda path: None


def command(main: Callable[[list[str]], int], *words: object) -> None:
    """Run a command line; what it says must be fit for a terminal, and its status 0, 1 or 2.

    Raises:
        InputError: the status is 2; the last sentence that it said.
        Wrong: it is none of them, or what was said is not fit.
    """
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main([str(word) for word in words])
    if status not in (0, 1, 2):
        raise Wrong(f"exit status {status}")
    said = err.getvalue().replace("\r", "\n").strip()
    if status == 2 and not said:
        raise Wrong("exit status 2 without a sentence")
    for text in (out.getvalue(), said):
        fit(text.replace("\n", ""))
    if status == 2:
        raise InputError(said.splitlines()[-1])


def fit(text: str) -> None:
    """Raise where a text is not fit for a terminal or cannot be encoded."""
    bad = [
        c for c in text if (c < " " and c != "\t") or "\x7f" <= c < "\xa0" or c in "\u202e\u2028"
    ]
    if bad:
        raise Wrong(f"says {bad[0]!r} as it is")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise Wrong(f"says what cannot be encoded: {error}") from None


def edge(*words: object) -> None:
    """`edge-classify ...`."""
    from edge.cli import main

    command(main, *words)


def train(*words: object) -> None:
    """`python -m train ...`."""
    from train.__main__ import main

    command(main, *words)


def npz(**arrays: object) -> bytes:
    """The bytes of an archive of arrays."""
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type]
    return file.getvalue()


def demo(name: str) -> dict[str, np.ndarray]:
    """A few frames of a shipped recording."""
    arrays = dict(np.load(ROOT / "edge" / "demo" / f"{name}.npz"))
    frames = len(arrays["t"])
    return {k: v[10:90] if v.shape[:1] == (frames,) else v for k, v in arrays.items()}


def recordings() -> list[bytes]:
    """Two recordings, one with taxels that could not be read."""
    one, two = demo("pillow-movable"), demo("cardboard-box-fixed")
    return [npz(**one), npz(**two, valid=np.ones(two["frames"].shape[1:], bool))]


def read_recording(path: Path) -> None:
    """Through everything that follows: skin, region, track, features, model."""
    edge("replay", "--summary", "--model", ROOT / "edge" / "demo" / "model.onnx", path)


def models() -> list[bytes]:
    """The committed models."""
    return [MODEL.read_bytes(), (ROOT / "edge" / "demo" / "model.onnx").read_bytes()]


def read_model(path: Path) -> None:
    """Load it, ask it once, print what it said."""
    from edge.model.model import Model

    model = Model(path)
    said = model.decide(np.ones(model.info.width))
    for task, decision in said.items():
        if not np.isfinite(decision.confidence):
            raise Wrong(f"{task} has a confidence of {decision.confidence}")


def golden_files() -> list[bytes]:
    """The committed golden file, cut down to two trials and a few vectors."""
    arrays = dict(np.load(ROOT / "tests" / "golden" / "golden.npz"))
    start, series = arrays["start"], arrays["series_start"]
    vectors, trials = len(arrays["vectors"]), 2
    out = {}
    for key, array in arrays.items():
        if key in ("start", "series_start"):
            out[key] = array[: trials + 1]
        elif key.startswith("series_"):
            out[key] = array[: series[trials]]
        elif key in ("t", "frames", "joints", "valid"):
            out[key] = array[: start[trials]]
        elif array.shape[:1] == (vectors,):
            out[key] = array[:4]
        elif key == "onset_s":
            out[key] = array[:trials]
        else:
            out[key] = array
    return [npz(**out)]


def skins() -> list[bytes]:
    """The shipped skins, one calibrated."""
    files = [path.read_bytes() for path in sorted((ROOT / "edge" / "skins").glob("*.toml"))]
    rows, noise = (", ".join([f"[{', '.join([x] * 24)}]"] * 16) for x in ("20000", "1.5"))
    return [
        *files,
        files[0] + f"\n[calibration]\nbaseline = [{rows}]\nnoise = [{noise}]\n".encode(),
    ]


def arms() -> list[bytes]:
    """The shipped arm."""
    return [(ROOT / "edge" / "arms" / "cody.toml").read_bytes()]


def read_arm(path: Path) -> None:
    """Load it, and bend it."""
    from edge.touch.arm import Chain

    chain = Chain.from_toml(path)
    if not np.isfinite(chain.pose(np.full(chain.dof, 0.5))).all():
        raise Wrong("a pose is not finite")


URDF = b"""<?xml version="1.0"?>
<robot name="r"><link name="base"/><link name="upper"/><link name="tip"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0.1 0 -0.2" rpy="0 1.5 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="2.5"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="tip"/>
<axis xyz="0 1 0"/></joint></robot>
"""


def read_urdf(path: Path) -> None:
    """Load the chain between two of its links."""
    from edge.touch.arm import Chain

    chain = Chain.from_urdf(path, "base", "tip")
    if not np.isfinite(chain.pose(np.full(chain.dof, 0.5))).all():
        raise Wrong("a pose is not finite")


def maps() -> list[bytes]:
    """A map of two runs."""
    head = {"event": "map", "frame": "torso", "unit": "metre", "tasks": ["object"]}
    touch = {
        "event": "decision",
        "task": "object",
        "contact": 1,
        "onset_s": 1.5,
        "place": [0.1, 0.2, 0.3],
        "label": "cup",
        "confidence": 0.5,
        "flags": ["tie"],
    }
    lines = [head, touch, touch, head, touch]
    return ["".join(json.dumps(line) + "\n" for line in lines).encode()]


def read_map(path: Path) -> None:
    """Load it."""
    from edge.runtime.touch_map import TouchMap

    list(TouchMap(path))


def scenes() -> list[bytes]:
    """The shipped scenes."""
    return [path.read_bytes() for path in sorted((ROOT / "train" / "scenes").glob("*.toml"))]


def beside_a_scene(path: Path) -> None:
    """The scene that another is like."""
    shutil.copy(ROOT / "train" / "scenes" / "cody18.toml", path.parent)


def read_scene(path: Path) -> None:
    """Check it, and say what it calls for."""
    from train.simulate.scene import load

    load(path)


def boards() -> list[bytes]:
    """A board's figures."""
    stage = {"median_us": 12.5, "p99_us": 20.0}
    return [json.dumps({
        "machine": {"kind": "x86_64", "name": "a board"},
        "model": {"data_digest": "0" * 64, "features": ["max_force"], "sha256": "1" * 64},
        "stages": {"track": stage, "features": stage, "decision": stage},
        "memory_mb": 54.0, "cold_start_ms": 110.0,
    }).encode()]  # fmt: skip


def read_board(path: Path) -> None:
    """Read it."""
    from train.tradeoff.board import read

    read(path)


def prices() -> list[bytes]:
    """Measured prices."""
    one = {"rows": 140, "components": 6, "k": 2, "operators": "ours", "us": 16.0, "kilobytes": 9.5}
    return [json.dumps({
        "machine": "x86_64", "data_digest": "0" * 64, "decisions": [one, {**one, "rows": 280}],
    }).encode()]  # fmt: skip


def read_prices(path: Path) -> None:
    """Read them."""
    from train.tradeoff.prices import read

    read(path, "0" * 64)


def fronts() -> list[bytes]:
    """The shipped front."""
    return [(ROOT / "train" / "tradeoff" / "front.json").read_bytes()]


def read_front(path: Path) -> None:
    """Read it, and pick."""
    from train.operating_points import ParetoFront

    front = ParetoFront.read(path)
    for wanted in ("fast", "balanced", "accurate"):
        front.pick(wanted)


def imported(kind: str) -> Callable[[Path], None]:
    """A reader that imports a file as a user does."""

    def read(path: Path) -> None:
        out = path.parent / "out"
        shutil.rmtree(out, ignore_errors=True)
        train("import", kind, path, "--out", out)

    return read


def grasps() -> list[bytes]:
    """The XML of a small grasp of the SDH-2 hand."""
    matrices = "".join(
        f'<matrix index="{i}"><cells_x>6</cells_x><cells_y>{13 if i % 2 else 14}</cells_y>'
        "<texel_width>3.4</texel_width></matrix>"
        for i in range(6)
    )
    frames = "".join(
        f"<frame><time_stamp>{1000 + 32 * i}</time_stamp><frame_data>{data}</frame_data></frame>"
        # 486 zeros; 100 of them, a count of 600, 385 more.
        for i, data in enumerate(["C3F30000", "C2C8000044160000C3C08000"])
    )
    angle = "<angle><time_stamp>1000</time_stamp><angle_data>1,2,3,4,5,6,7</angle_data></angle>"
    return [
        f"<root><sensor>{matrices}</sensor><data>{frames}</data>"
        f"<joint_angles>{angle}</joint_angles></root>".encode()
    ]


def read_grasp(path: Path) -> None:
    """Import the XML as the one grasp of a folder."""
    folder = path.parent / "grasps"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "cup").mkdir(parents=True)
    (folder / "cup" / "a.dsa").write_bytes(bz2.compress(path.read_bytes()))
    imported("sdh2")(folder)


def logs() -> list[bytes]:
    """MCAP files of JSON messages, in chunks and without."""
    from mcap.writer import CompressionType, Writer

    files = []
    for options in ({}, {"use_chunking": False}, {"compression": CompressionType.LZ4}):
        file = io.BytesIO()
        writer = Writer(file, **options)
        writer.start()
        schema = writer.register_schema("frame", "jsonschema", b"{}")
        for topic, message in (("/skin", {"counts": [[1, 2], [3, 4]]}), ("/q", {"q": [0.1, 0.2]})):
            channel = writer.register_channel(topic, "json", schema)
            for i in range(3):
                data = json.dumps(message | {"t": 100.0 + i}).encode()
                writer.add_message(channel, i * 10**9, data, i * 10**9)
        writer.finish()
        files.append(file.getvalue())
    return files


def bags() -> list[bytes]:
    """A ROS 1 bag of arrays."""
    import tempfile

    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    kind = "std_msgs/msg/UInt16MultiArray"
    dimension = types.types["std_msgs/msg/MultiArrayDimension"]
    layout = types.types["std_msgs/msg/MultiArrayLayout"](
        dim=[dimension(label=n, size=2, stride=0) for n in ("rows", "cols")], data_offset=0
    )
    message = types.types[kind](layout=layout, data=np.arange(4, dtype=np.uint16))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bag"
        with Writer(path) as bag:
            connection = bag.add_connection("/skin", kind, typestore=types)
            for i in range(3):
                bag.write(connection, i * 10**9, types.serialize_ros1(message, kind))
        return [path.read_bytes()]


def besides() -> list[bytes]:
    """What stands in the JSON file beside a log."""
    return [json.dumps({
        "labels": {"object": "cup"}, "frames_topic": "/skin",
        "skin": {"rows": 2, "cols": 2, "threshold_counts": 50, "wraps": True, "pitch_m": 0.003},
    }).encode()]  # fmt: skip


def read_beside(path: Path) -> None:
    """Import the good log that it stands beside."""
    imported("mcap")(path.with_suffix(".mcap"))


def log_beside(path: Path) -> None:
    """A good log, beside the hostile file."""
    path.with_suffix(".mcap").write_bytes(logs()[0])


def frame_files() -> list[bytes]:
    """One file that says which of a CSV trial's files it is, and holds it."""
    labels = "trial,object\none,cup\n"
    skin = '{"rate_hz": 100, "threshold_counts": 50, "wraps": false}'
    return [
        b"a.csv\n1,2,3\n4,5,6\n",
        f"labels.csv\n{labels}".encode(),
        f"skin.json\n{skin}".encode(),
    ]


def of_frames(data: bytes, draw: Random) -> bytes:
    """The file's contents, not its name."""
    name, contents = data.split(b"\n", 1)
    return name + b"\n" + mutate.of_text(contents, draw)


def read_frames(path: Path) -> None:
    """Import a folder of which one file is hostile."""
    folder = path.parent / "csv"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "one").mkdir(parents=True)
    for data in (*frame_files(), b"b.csv\n1,2,3\n4,5,6\n", path.read_bytes()):
        name, contents = data.split(b"\n", 1)
        where = folder / "one" if name in (b"a.csv", b"b.csv") else folder
        (where / name.decode("ascii")).write_bytes(contents)
    imported("csv_frames")(folder)


READERS = (
    Reader("recording", ".npz", recordings, mutate.of_npz, read_recording),
    Reader("model", ".onnx", models, mutate.of_onnx, read_model),
    Reader("golden", ".npz", golden_files, mutate.of_npz,
           lambda path: edge("verify", "--model", MODEL, "--golden", path)),
    Reader("skin", ".toml", skins, mutate.of_text, lambda path: edge("check", path)),
    Reader("arm", ".toml", arms, mutate.of_text, read_arm),
    Reader("urdf", ".urdf", lambda: [URDF], mutate.of_text, read_urdf),
    Reader("map", ".jsonl", maps, mutate.of_text, read_map),
    Reader("scene", ".toml", scenes, mutate.of_text, read_scene, beside_a_scene),
    Reader("board", ".json", boards, mutate.of_text, read_board),
    Reader("prices", ".json", prices, mutate.of_text, read_prices),
    Reader("front", ".json", fronts, mutate.of_text, read_front),
    Reader("sdh2", ".xml", grasps, mutate.of_text, read_grasp),
    Reader("csv_frames", ".one", frame_files, of_frames, read_frames),
    Reader("mcap", ".mcap", logs, mutate.of_bytes, imported("mcap")),
    Reader("mcap_words", ".mcap", lambda: logs()[1:2], mutate.of_text, imported("mcap")),
    Reader("rosbag", ".bag", bags, mutate.of_bytes, imported("rosbag")),
    Reader("beside", ".json", besides, mutate.of_text, read_beside, log_beside),
)  # fmt: skip


def hostile(reader: Reader, number: int, seeds: list[bytes]) -> bytes:
    """The number-th input of a reader; the first ones are the valid files."""
    if number < len(seeds):
        return seeds[number]
    draw = Random(f"{reader.name} {number}")
    return reader.mutate(draw.choice(seeds), draw)
