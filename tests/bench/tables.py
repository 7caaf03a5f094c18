"""Measured tables: each measuring program writes its own into docs/measured/.

The head of a file names the command, the commit, the machine and the date. The pages
include the files, so nobody copies a figure by hand, and `tests/test_measured.py`
compares the figures in README.md and docs/recipes.md with them.
"""

import csv
import os
import platform
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "measured"

Rows = Sequence[Mapping[str, object]]
"""The rows of a table; the keys of the first one are the columns."""


def markdown(rows: Rows) -> str:
    """A table as Markdown, without a line break at its end."""
    columns = list(rows[0])
    lines = [" | ".join(columns), " | ".join("---" for _ in columns)]
    for row in rows:
        lines.append(" | ".join(str(row[column]) for column in columns))
    return "\n".join(f"| {line} |" for line in lines)


def processor() -> str:
    """The name of the processor, with the number of cores that may be used."""
    name = platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return f"{name}, {os.cpu_count()} cores"


def commit() -> str:
    """The commit that is checked out, marked where a tracked file differs from it."""
    command = ["git", "describe", "--always", "--dirty", "--exclude", "*"]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() or "unknown"


def head(command: str) -> str:
    """The line above a table."""
    today = datetime.now(UTC).date().isoformat()
    return f"*`{command}`, commit {commit()}, {processor()}, {today}*"


def rows_of(path: Path) -> Rows:
    """The rows of a CSV file that a report wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write(name: str, tables: Sequence[Rows], command: str = "") -> None:
    """Print the tables and write them to docs/measured/NAME.md.

    Args:
        name: of the file.
        tables: one below the other.
        command: that was run; the command line of this process if it is empty.
    """
    text = "\n\n".join(markdown(rows) for rows in tables)
    print(text)
    if not command:
        module = Path(sys.argv[0]).relative_to(ROOT).with_suffix("")
        command = " ".join(["python -m", ".".join(module.parts), *sys.argv[1:]])
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{name}.md"
    path.write_text(f"{head(command)}\n\n{text}\n", encoding="utf-8")


def main() -> None:
    """Write the tables of a report: `python -m tests.bench.tables NAME COMMAND CSV...`."""
    name, command, *files = sys.argv[1:]
    write(name, [rows_of(Path(file)) for file in files], command)


if __name__ == "__main__":
    main()
