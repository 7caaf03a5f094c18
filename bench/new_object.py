"""Objects that a model was taught on the board, beside a model that is exported with them.

Arguments: a folder of simulated trials, whose names end in their number; how many trials of an
object, fixed or movable, a model is exported of; and a number of draws. A draw leaves out three
objects, exports a model of the others, and teaches it 1, 3, 5 and 10 trials of each. Printed last:
the percentage of the last quarter of the trials whose object is right, of the new objects and of
the others, before, taught, and exported with the same trials; a mean of the draws.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from edge.cli import main as edge
from edge.commands.replay import contact_of
from edge.model.model import Model
from edge.recording import load
from export.__main__ import main as export

COUNTS = (1, 3, 5, 10)
KINDS = ("taught", "exported")
FIXED = ("--quick", "--tasks", "object", "--decision-points", "none", "--jobs", "1")


def right(path: Path, asked: dict[Path, str], new: set[str]) -> list[float]:
    """Percentages of the trials {file: object} decided rightly: of new objects, and of others."""
    model, shares = Model(path), {True: [], False: []}
    for file, label in asked.items():
        vector = model.info.vector(contact_of(model, load(file), str(file)))
        shares[label in new].append(model.decide(vector)["object"].label == label)
    return [100.0 * float(np.mean(shares[kind])) for kind in (True, False)]


def rows(objects: dict[Path, str], first: int, draw: int, out: str):
    """(1 + 2 counts, 2) percentages: before, and for each count taught and exported."""
    rng = np.random.default_rng([draw])
    number = {path: int(path.stem[-2:]) for path in objects}
    asked = {p: own for p, own in objects.items() if 4 * number[p] >= 3 * max(number.values())}
    new = sorted(rng.permutation(sorted(set(objects.values())))[:3].tolist())
    known = [str(p) for p, own in objects.items() if own not in new and number[p] < first]
    pools = [sorted(str(p) for p in objects.keys() - asked if objects[p] == own) for own in new]
    pools = [rng.permutation(pool).tolist() for pool in pools]
    export(["--data", *known, "--out", out, *FIXED])
    yield right(Path(out, "model.onnx"), asked, set(new))
    model = ["--model", f"{out}/model.onnx", "--new-labels"]
    for count in COUNTS:
        more = [path for pool in pools for path in pool[:count]]
        edge(["teach", *more, *model, "--out", f"{out}/taught"])
        export(["--data", *known, *more, "--out", f"{out}/exported", *FIXED])
        yield from (right(Path(out, kind, "model.onnx"), asked, set(new)) for kind in KINDS)


def main(folder: str, first: str, draws: str) -> None:
    """Print a row for the model before, and two for each number of trials."""
    objects = {path: load(path).labels["object"] for path in sorted(Path(folder).glob("*.npz"))}
    with tempfile.TemporaryDirectory() as out:
        each = [[*rows(objects, int(first), draw, out)] for draw in range(int(draws))]
    names = ["before", *(f"{count} {kind}" for count in COUNTS for kind in KINDS)]
    for name, (of_new, of_others) in zip(names, np.mean(each, axis=0), strict=True):
        print(f"{name:<12}{of_new:>8.1f}{of_others:>8.1f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
