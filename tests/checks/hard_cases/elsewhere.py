"""`python -m tests.checks.hard_cases.elsewhere PYTHON`: hard sets' golden files, by another
Python of another ONNX Runtime or another architecture.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
GUEST = """\
import json, os, platform, sys
import onnxruntime
from edge.app.cli import main
versions = {"machine": platform.machine(), "onnxruntime": onnxruntime.__version__}
print(json.dumps({"event": "machine", **versions}))
for folder in sys.argv[1:]:
    print(json.dumps({"event": "set", "name": os.path.basename(folder)}), flush=True)
    model, golden = (os.path.join(folder, name) for name in ("model.onnx", "golden.npz"))
    main(["verify", "--model", model, "--golden", golden])
"""


def sets(golden):
    """The folders of golden files."""
    return sorted(path.parent for path in golden.glob("*/golden.npz"))


def ask(golden, python, path=""):
    """Let a Python verify all golden files, away from the checkout.

    Args:
        golden: their folder.
        python: the command.
        path: where its `edge` is, unless it has one.

    Returns:
        The machine that answered, and {(set, quantity): whether it is equal}.

    Raises:
        subprocess.CalledProcessError: it ended with an error.
    """
    # -P: the current folder, which may be the checkout, offers no modules.
    command = [*python, "-P", "-c", GUEST, *map(str, sets(golden))]
    environment = {**os.environ, "PYTHONPATH": path}
    text = subprocess.check_output(command, env=environment, text=True)
    machine = {}
    equal = {}
    name = ""
    for line in map(json.loads, text.splitlines()):
        if line["event"] == "set":
            name = line["name"]
        elif line["event"] == "check":
            equal[name, line["name"]] = line["passed"]
        else:
            machine |= line
    return machine, equal


def main(argv=None):
    """Ask, and say which answers differ from their golden values; 1 if any does."""
    parser = argparse.ArgumentParser(prog="elsewhere", description=__doc__)
    parser.add_argument("--golden", type=Path, default=Path("build/hard-cases/golden"))
    parser.add_argument(
        "python",
        nargs="+",
        help="the command that runs the other Python",
    )
    arguments = parser.parse_args(argv)
    if not sets(arguments.golden):
        parser.error(f"no golden files are in {arguments.golden}; make them first")
    machine, equal = ask(arguments.golden, arguments.python, str(ROOT))
    differ = [": ".join(key) for key, is_equal in equal.items() if not is_equal]
    print(
        f"ONNX Runtime {machine['onnxruntime']} on {machine['machine']}: {len(equal)} "
        f"quantities of {len(sets(arguments.golden))} hard sets, of which "
        f"{len(differ)} differ {differ}"
    )
    return int(bool(differ))


if __name__ == "__main__":
    sys.exit(main())
