"""`make accuracy`: the accuracies that an export prints, on simulated and on real sets.

Each set is fitted as `make export` would fit it. The accuracies are nested: of the
whole choice, on trials that took no part in it, with the interval of the exported model
on other trials, or on other objects or kinds where entire groups are left out.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import train
from tests.bench import tables
from train.__main__ import main as train_command
from train.progress import bar

SCENES = tables.ROOT / "train" / "scenes"


def simulated(folder: Path) -> Iterator[tuple[str, Path, dict[str, Any]]]:
    """Sets of recordings that are simulated: name, folder, options of the fit."""
    for scene in ("cody18", "household"):
        out = folder / scene
        train_command(["simulate", str(SCENES / f"{scene}.toml"), "--out", str(out)])
        yield f"`{scene}`, simulated", out, {}


def real(grasps: Path, folder: Path) -> Iterator[tuple[str, Path, dict[str, Any]]]:
    """Sets of recordings of the SDH-2 hand, by touch alone and with joint angles."""
    out = folder / "sdh2"
    train_command(["import", "sdh2", str(grasps), "--out", str(out)])
    touch = {"features": ["moments"], "projection": "lda"}
    yield "SDH-2 grasps, by touch alone", out, touch
    yield "SDH-2 grasps, with joint angles, which leak", out, {}


def accuracies(
    name: str, folder: Path, options: dict[str, Any]
) -> list[dict[str, Any]]:
    """A row for each task of a set of recordings."""
    fitted = train.fit(folder, **options)
    rows = []
    for task, chosen in fitted.chosen.items():
        low, high = chosen.accuracy.interval
        row = {"recordings": name, "trials": len(fitted.dataset.trials), "task": task}
        row["labels"] = len(set(fitted.dataset.labels(task)))
        row["left out"] = chosen.left_out
        row["accuracy"] = f"{chosen.accuracy.accuracy:.0%}"
        row["95 % interval"] = f"{low:.0%} to {high:.0%}"
        rows.append(row)
    return rows


def main() -> int:
    """Fit the sets, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--grasps", type=Path, metavar="FOLDER", help="of the published SDH-2 grasps"
    )
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sets = list(simulated(folder))
        if arguments.grasps is not None:
            sets += real(arguments.grasps, folder)
        for label, recordings, options in bar(sets, desc="sets"):
            rows += accuracies(label, recordings, options)
    tables.write("accuracy", [rows])
    return 0


if __name__ == "__main__":
    sys.exit(main())
