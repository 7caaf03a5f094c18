"""The core: the modules that `edge-classify run` loads for Cody's skin on I2C.

`python -m tests.reading_list` prints them with their lines of code, in the order in
which a frame passes their rooms.
"""

import ast
import subprocess
import sys
from pathlib import Path

from edge import demo
from edge.skin import file as skinfile

ROOT = Path(__file__).parents[1]
ROOMS = "edge commands bus chips skin touch model output tools fake".split()
"""In the order of the list; modules of `edge` itself come first."""
PROGRAM = """
import sys
from edge import cli
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


def lines_of_code(path):
    """Lines of a module without blank lines, comments and docstrings."""
    text = (ROOT / path).read_text()
    lines = {number: line.strip() for number, line in enumerate(text.splitlines(), 1)}
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(value=ast.Constant(), lineno=first, end_lineno=last):
                for number in range(first, last + 1):
                    lines[number] = ""
    return sum(line != "" and not line.startswith("#") for line in lines.values())


def main():
    """Print the list; the skin's buses need not be there."""
    skin = str(skinfile.shipped("cody"))
    paths = loaded("run", "--model", str(demo.MODEL), "--skin", skin)
    for path in paths:
        print(f"{lines_of_code(path):5}  {path}")
    print(f"{sum(map(lines_of_code, paths)):5}  lines in {len(paths)} modules")


if __name__ == "__main__":
    main()
