"""Put a new model in the place of the one that the robot runs, or take it back.

Verifies the model with its golden file, and against the skin file if one is given. The
model that ran is kept as the former one beside the new one, which takes its place in
one step; --back exchanges the two. A golden file has its model's version in its name.
Restart the service then.
"""

import argparse
import hashlib
from pathlib import Path

from edge.app.options import add_file
from edge.app.output import LOG, Output
from edge.decide.model import LARGEST_BYTES, Model
from edge.decide.verify import golden_of, verify
from edge.errors import InputError
from edge.files import read_bytes
from edge.touch.layout import differences
from edge.wire.skin.file import load
from edge.writing import alone, write_whole

FORMER = ".former"
"""Ends the name of the model that was replaced."""
LEAVING = ".leaving"
"""Ends the name of a copy of the model that is being replaced."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "the new model")
    parser.add_argument(
        "--to",
        type=Path,
        default=Path("/etc/edge-classify/model.onnx"),
        help="the model that the robot runs (default: %(default)s)",
    )
    parser.add_argument(
        "--golden",
        type=Path,
        help="its golden.npz (default: that beside the model)",
    )
    add_file(parser, "skin", "the skin that the model must suit")
    parser.add_argument(
        "--back",
        action="store_true",
        help="exchange of the model for the former one",
    )


def run(arguments: argparse.Namespace) -> int:
    """Install, or go back."""
    with alone(arguments.to.parent, "installs a model"):
        return _exchange(arguments)


def _exchange(arguments: argparse.Namespace) -> int:
    output = Output.of(arguments)
    target = arguments.to
    finish(target)
    if arguments.back:
        former = beside(target, FORMER)
        if former.is_file():
            Model(former)  # a damaged one must not take a working one's place
        go_back(target)
        model = Model(target)
        text = f"{target}: the former model {model.version} is back"
        output.event({"event": "installed", "version": model.version}, text)
        return 0
    if arguments.model is None:
        raise InputError("give the model to install, or --back for the former one")
    new = Path(arguments.model)
    golden = arguments.golden or new.with_name("golden.npz")
    prove(new, golden, arguments.skin)
    place(new, golden, target)
    version = Model(target).version
    text = (
        f"{target}: {version} is installed; `edge-classify install --back --to {target}` "
        "goes back"
    )
    output.event({"event": "installed", "version": version}, text)
    return 0


def prove(path: Path, golden: Path, skin: str | None) -> None:
    """Refuse a model that this machine computes otherwise, or that suits no such skin.

    Raises:
        InputError: the sentence names what differs.
    """
    model = Model(path)
    if not golden.is_file():
        raise InputError(
            f"{golden}: no such file; copy golden.npz with the model, or name it by "
            "--golden"
        )
    failed = [check.name for check in verify(model, golden) if not check.passed]
    if failed:
        raise InputError(
            f"{path}: this machine gives other results than the exporting one: "
            f"{', '.join(failed[:4])}; see `edge-classify verify`"
        )
    if skin is not None:
        for sentence in differences(model.info.layout, load(skin).layout):
            LOG.warning(f"{path}: {sentence}")


def beside(target: Path, end: str) -> Path:
    """The path of a file whose name is the model's with another end."""
    return target.with_name(target.name + end)


def place(model: Path, golden: Path, target: Path) -> None:
    """Put the model and its golden file in place, and keep the model that runs."""
    data = read_bytes(model, LARGEST_BYTES)
    target_golden = _golden_of(target, data)
    is_new = not target_golden.exists()
    _write(target_golden, read_bytes(golden, LARGEST_BYTES))
    try:
        _replace(target, data)
    except InputError:
        if is_new:
            target_golden.unlink()
        raise


def _golden_of(target: Path, data: bytes) -> Path:
    """The golden file of a model with these bytes."""
    return golden_of(target, hashlib.sha256(data).hexdigest()[:8])


def _replace(target: Path, data: bytes) -> None:
    """Let a model take the place of the one that runs, which becomes the former one."""
    if target.is_file():
        running = read_bytes(target, LARGEST_BYTES)
        if running == data:  # installed twice, it would be its own way back
            return
        _write(beside(target, LEAVING), running)
    _write(target, data)
    finish(target)


def finish(target: Path) -> None:
    """Finish an exchange that was interrupted: what has left becomes the former model,
    unless it still runs."""
    leaving = beside(target, LEAVING)
    former = beside(target, FORMER)
    if not leaving.is_file():
        return
    running = read_bytes(target, LARGEST_BYTES)
    if running == read_bytes(leaving, LARGEST_BYTES):
        leaving.unlink()
        return
    if former.is_file():
        dropped = read_bytes(former, LARGEST_BYTES)
        if dropped != running:
            _golden_of(target, dropped).unlink(missing_ok=True)
    leaving.replace(former)


def go_back(target: Path) -> None:
    """Exchange the model for the former one.

    Raises:
        InputError: there is no former model.
    """
    former = beside(target, FORMER)
    if not former.is_file():
        raise InputError(f"{target}: has no former model to go back to")
    _replace(target, read_bytes(former, LARGEST_BYTES))


def _write(goal: Path, data: bytes) -> None:
    with write_whole(goal) as file:
        file.write(data)
