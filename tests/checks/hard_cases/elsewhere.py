"""Golden files of hard sets, asked of another Python, with another ONNX Runtime or on
another architecture.
"""

import json
import os
import subprocess
from pathlib import Path

from edge.errors import EdgeError
from tests.checks.bench.program import start

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


def measure(golden, python):
    """Ask, and say which answers differ from their golden values; 1 if any does.

    Raises:
        EdgeError: there are no golden files.
    """
    golden = Path(golden)
    if not sets(golden):
        raise EdgeError(f"no golden files are in {golden}; make them first")
    machine, equal = ask(golden, python, str(ROOT))
    differ = [": ".join(key) for key, is_equal in equal.items() if not is_equal]
    print(
        f"ONNX Runtime {machine['onnxruntime']} on {machine['machine']}: {len(equal)} "
        f"quantities of {len(sets(golden))} hard sets, of which {len(differ)} differ "
        f"{differ}"
    )
    return int(bool(differ))


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--golden", "build/hard-cases/golden", "the folder of golden files"),
        ("--python", list, "the command that runs the other Python"),
    )
