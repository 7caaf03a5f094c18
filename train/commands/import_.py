"""Turn another lab's data into recordings.

Writes one recording per trial; existing files of the same name are replaced. Where the data give no
thresholds, those that `python -m train thresholds` proposes are written. To add a format, see
train/importers/__init__.py.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
from tqdm import tqdm

from edge.commands.options import add_arm, open_arm
from edge.errors import InputError
from edge.recording import Recording, load, save
from train.commands.thresholds import found, proposed
from train.importers import names

ZERO_FRAMES = 3


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("format", choices=names(), help="the format of the file")
    parser.add_argument("file", type=Path, help="the file")
    parser.add_argument("--out", required=True, type=Path, help="folder for the recordings")
    add_arm(parser, "whose joint names say which angles of a log are kept, and in what order")
    parser.add_argument(
        "--zero",
        action="store_true",
        help="subtract what each taxel shows in the first three frames, for a sensor whose offset "
        "drifts from trial to trial; nothing may be touched in them",
    )


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings."""
    arm = open_arm(arguments)
    if not arguments.file.exists():
        raise InputError(f"{arguments.file}: no such file or folder")
    trials = import_module(f"train.importers.{arguments.format}").trials(arguments.file, arm)
    n, without = 0, []
    for name, recording in tqdm(trials, desc="importing", unit=" trials"):
        if arm is not None and recording.joints is None:
            raise InputError(f"{arguments.file}: holds no joint angles; leave --arm out")
        path = arguments.out / f"{name}.npz"
        save(path, zeroed(recording) if arguments.zero else recording)
        if "threshold_counts" not in recording.meta.get("skin", {}):
            without.append(path)
        n += 1
    print(f"{n} recordings in {arguments.out}")
    if without:
        print(set_thresholds(without))
    return 0


def set_thresholds(paths: Sequence[Path]) -> str:
    """Write the thresholds that the recordings' noise proposes into them; what was done."""
    recordings = [load(path) for path in paths]
    threshold, onset = proposed(recordings)
    for path, recording in zip(paths, recordings, strict=True):
        skin = {"threshold_counts": threshold, "onset_counts": onset}
        meta = {**recording.meta, "skin": {**recording.meta.get("skin", {}), **skin}}
        save(path, replace(recording, meta=meta))
    touched, _ = found(recordings, threshold, onset)
    return (
        f"threshold {threshold} and onset {onset} counts, from the noise before contact: "
        f"{touched} of {len(paths)} have a contact; `python -m train thresholds` compares others"
    )


def zeroed(recording: Recording) -> Recording:
    """The same without each taxel's median over the first three frames; below it is 0."""
    offset = np.median(recording.frames[:ZERO_FRAMES], axis=0).astype(np.uint16)
    frames = np.where(recording.frames > offset, recording.frames - offset, 0)
    return replace(recording, frames=frames.astype(np.uint16))
