"""`python -m train import`: other labs' data to a folder of recordings."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path
from typing import Any

from tqdm import tqdm

from edge.recording import save
from train.importers import names


def add_parser(commands: Any) -> None:
    """Add the command to the command line."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "import",
        help="turn other labs' data into recordings",
        description="Writes one recording a trial; an existing file of that name is replaced. "
        "To add a format, see train/importers/__init__.py.",
    )
    parser.add_argument("format", choices=names(), help="what kind of file it is")
    parser.add_argument("file", type=Path, help="the file")
    parser.add_argument("--out", required=True, type=Path, help="folder for the recordings")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings."""
    trials = import_module(f"train.importers.{arguments.format}").trials(arguments.file)
    n = 0
    for name, recording in tqdm(trials, desc="importing", unit=" trials"):
        save(arguments.out / f"{name}.npz", recording)
        n += 1
    print(f"{n} recordings in {arguments.out}")
    return 0
