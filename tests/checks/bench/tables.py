"""Measured tables: each measuring program writes its own into docs/measured/.

The head of a file names the command, the commit, the machine and the date. The pages
include the files, so nobody copies a figure by hand, and `tests/test_measured.py`
compares the figures in README.md and docs/recipes.md with them.
"""

import csv
import os
import platform
import re
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "docs" / "measured"
MEASURED = (":!docs/measured", ":!docs/*.png")
"""What measuring changes, for git."""
SCENES = ROOT / "train" / "scenes"


def markdown(rows):
    """Rows as a Markdown table without a line break at its end; the keys of the first
    one are the columns."""
    columns = list(rows[0])
    lines = [columns, ["---"] * len(columns)]
    lines += [[row[column] for column in columns] for row in rows]
    return "\n".join(f"| {' | '.join(map(str, line))} |" for line in lines)


def processor():
    """The name of the processor, with the number of cores that may be used."""
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text() if cpuinfo.exists() else ""
    name = re.search(r"(?m)^model name\s*:\s*(.*\S)", text)
    return f"{name[1] if name else platform.machine()}, {os.cpu_count()} cores"


def commit():
    """The commit that is checked out, marked "-dirty" where a tracked file differs from
    it, other than the tables and pictures that were measured."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}

    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, text=True, **pipes).stdout

    changed = git("status", "--porcelain", "-uno", "--", ".", *MEASURED)
    number = git("rev-parse", "--short", "HEAD").strip() or "unknown"
    return number + ("-dirty" if changed else "")


def write(name, tables, command=""):
    """Print the tables and write them to docs/measured/NAME.md.

    Args:
        name: of the file.
        tables: one below the other; those without a row are left out.
        command: that was run; the command line of this process if it is empty.
    """
    text = "\n\n".join(map(markdown, filter(None, tables)))
    print(text)
    if not command:
        module = Path(sys.argv[0]).relative_to(ROOT).with_suffix("")
        command = shlex.join(["python", "-m", ".".join(module.parts), *sys.argv[1:]])
    today = f"{datetime.now(UTC):%Y-%m-%d}"
    head = f"*`{command}`, commit {commit()}, {processor()}, {today}*"
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.md").write_text(f"{head}\n\n{text}\n", encoding="utf-8")


def main():
    """Write the tables of a report: `python -m tests.checks.bench.tables NAME COMMAND CSV...`."""
    name, command, *files = sys.argv[1:]
    texts = [Path(file).read_text(encoding="utf-8") for file in files]
    tables = [list(csv.DictReader(text.splitlines())) for text in texts]
    write(name, tables, command)


if __name__ == "__main__":
    main()
