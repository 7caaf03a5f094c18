"""The core: the modules that `edge-classify run` loads for Cody's skin on I2C.

`python -m tests.reading_list` prints them in the order in which a frame passes their
rooms.
"""

import subprocess
import sys
from pathlib import Path

from edge import demo
from edge.wire.skin import file as skinfile

ROOT = Path(__file__).parents[1]
ROOMS = (
    "edge",
    "app",
    "commands",
    "bus",
    "chips",
    "skin",
    "touch",
    "features",
    "record",
    "decide",
    "sinks",
    "fake",
)
"""In the order of the list; modules of `edge` itself come first."""
PROGRAM = """
import sys
from edge.app import cli
try:
    cli.main(sys.argv[1:])
finally:
    for name, module in sorted(sys.modules.items()):
        if name.split(".")[0] == "edge" and getattr(module, "__file__", None):
            print("module", module.__file__)
"""


def loaded(*arguments, environment=None):
    """Paths, below the checkout, of the modules of edge that a command loads."""
    command = [sys.executable, "-c", PROGRAM, *arguments]
    process = subprocess.run(
        command,
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    paths = []
    for line in process.stdout.splitlines():
        if line.startswith("module "):
            path = Path(line.removeprefix("module ")).relative_to(ROOT)
            if path.name != "__init__.py":
                paths.append(path)
    return sorted(paths, key=lambda path: (_room(path), path.name))


def _room(path):
    return ROOMS.index(path.parent.name)


def main():
    """Print the list; the skin's buses need not be there."""
    skin = str(skinfile.shipped("cody"))
    print(*loaded("run", "--model", str(demo.MODEL), "--skin", skin), sep="\n")


if __name__ == "__main__":
    main()
