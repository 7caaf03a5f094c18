"""The hard sets' golden files, asked again by another Python: `python -m tests.hard_cases.elsewhere
PYTHON`, of another ONNX Runtime or another architecture. Its answers join the table.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from edge.files import write_whole
from tests.hard_cases.cases import Case

ROOT = Path(__file__).parents[2]
MAKE = {"x86_64": "make hard-cases-versions", "aarch64": "make board-test"}
"""What runs the golden files on each architecture."""

GUEST = """\
import json, os, platform, sys
import onnxruntime
from edge.cli import main
said = {"machine": platform.machine(), "onnxruntime": onnxruntime.__version__}
print(json.dumps({"event": "machine", **said}))
for folder in sys.argv[1:]:
    print(json.dumps({"event": "set", "name": os.path.basename(folder)}), flush=True)
    model, golden = (os.path.join(folder, name) for name in ("model.onnx", "golden.npz"))
    main(["verify", "--model", model, "--golden", golden])
"""


def sets(golden: Path) -> list[Path]:
    """The folders of golden files."""
    return sorted(path.parent for path in golden.glob("*/golden.npz"))


def digest(golden: Path) -> str:
    """Of all golden files and their models: what was answered is of these."""
    made = hashlib.sha256()
    for folder in sets(golden):
        for name in ("model.onnx", "golden.npz"):
            made.update((folder / name).read_bytes())
    return made.hexdigest()


def ask(golden: Path, python: Sequence[str], path: str = "") -> Path:
    """Let a Python verify all golden files, away from the checkout.

    Args:
        golden: their folder; what was said is stored there.
        python: the command.
        path: where its `edge` is, unless it has one.

    Returns:
        What was stored.

    Raises:
        subprocess.CalledProcessError: it ended with an error.
    """
    folders = [str(folder.resolve()) for folder in sets(golden)]
    with tempfile.TemporaryDirectory() as away:
        said = subprocess.run(
            [*python, "-c", GUEST, *folders],
            cwd=away,
            env={**os.environ, "PYTHONPATH": path},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout
    machine = json.loads(said.splitlines()[0])
    of = {"event": "golden", "digest": digest(golden)}
    out = golden / f"on-{machine['machine']}-{machine['onnxruntime']}.jsonl"
    with write_whole(out) as file:
        file.write((json.dumps(of) + "\n" + said).encode())
    return out


def answers(path: Path) -> tuple[dict[str, Any], dict[tuple[str, str], float]]:
    """The machine that answered, and the share of its bound of each quantity of each set."""
    machine: dict[str, Any] = {}
    shares: dict[tuple[str, str], float] = {}
    of = ""
    for line in map(json.loads, path.read_text().splitlines()):
        if line["event"] == "set":
            of = line["name"]
        elif line["event"] == "check":
            share = float(line.get("share_of_bound", "inf"))
            shares[of, line["name"]] = share if line["passed"] else max(share, 2.0)
        else:
            machine |= line
    return machine, shares


def found(golden: Path) -> list[Case]:
    """A case for each machine that answered the golden files that are there now."""
    now = digest(golden)
    cases: list[Case] = []
    for path in sorted(golden.glob("on-*.jsonl")):
        machine, shares = answers(path)
        if machine["digest"] != now:
            continue

        def error(set: str, quantity: str, of: dict[tuple[str, str], float] = shares) -> float:
            return of[set, quantity]

        cases.append(
            Case(
                "everywhere",
                f"ONNX Runtime {machine['onnxruntime']} on {machine['machine']}",
                f"what this machine answered to {len(sets(golden))} hard sets: labels, neighbours "
                "and counts bit for bit",
                "share of a float's bound",
                1,
                error,
                [{"set": of, "quantity": quantity} for of, quantity in shares],
                usual="does not apply: its own runtime on the same machine already differs, see "
                "`a batch of 1 or 1000` and `one thread or two`",
            )
        )
    return cases


def missing(golden: Path) -> list[str]:
    """The architectures that have not answered yet, with what makes them."""
    there = {case.name.rpartition(" on ")[2] for case in found(golden)}
    return [
        f"no other ONNX Runtime has answered on {machine}: {make}"
        if machine == "x86_64"
        else f"{machine} has not answered: {make}"
        for machine, make in MAKE.items()
        if machine not in there
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Ask, and say how far off the farthest answer is; 1 where it is beyond its bound."""
    parser = argparse.ArgumentParser(prog="elsewhere", description=__doc__)
    parser.add_argument("--golden", type=Path, default=Path("build/hard-cases/golden"))
    parser.add_argument("python", nargs="+", help="the command that runs the other Python")
    arguments = parser.parse_args(argv)
    program, *words = arguments.python
    if os.sep in program:
        program = os.path.abspath(program)
    machine, shares = answers(ask(arguments.golden, [program, *words], str(ROOT)))
    of, quantity = max(shares, key=lambda key: shares[key])
    worst = shares[of, quantity]
    print(
        f"ONNX Runtime {machine['onnxruntime']} on {machine['machine']}: {len(shares)} quantities "
        f"of {len(sets(arguments.golden))} hard sets, farthest {worst:.2g} of its bound "
        f"({of}: {quantity})"
    )
    return int(worst > 1.0)


if __name__ == "__main__":
    sys.exit(main())
