"""`python -m tests.mutation.sample`: small random changes of edge/; a test must notice 90 %.

200 places are drawn by a seed, 50 of each kind: comparisons, arithmetic, constants and
conditions. A change is made on a copy of the tree, and the tests that run through its line are
asked, the fastest first. What survives is printed with its line; `EQUIVALENT` says of those that
change nothing why they do not: they are not tried, and count as neither. `--part 1/4` tries a
quarter of them, `--reach FILE` keeps which tests run through which line for the next part, and
`--done FILE` leaves out those that an earlier run printed there, if there was one.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from operator import itemgetter
from pathlib import Path

from edge.files import write_whole
from tests.mutation import runner, shapes
from tests.mutation.equivalent import EQUIVALENT

MEASURED = ("edge", "golden", "hard_cases", "export", "test_demo_data.py")
"""Of tests/: those whose way through edge/ is measured."""
APART = ("subprocess", "python(", "start(")
"""What a test calls that runs edge/ in a process of its own: such tests are asked at the end."""
FEW_TESTS, MOST_TESTS = 10, 200
SHARE = 0.9

COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
COMPUTED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitAnd,
    ast.LShift: ast.RShift, ast.RShift: ast.LShift, ast.Pow: ast.Mult,
}  # fmt: skip
KINDS = ("comparison", "arithmetic", "constant", "condition")


@dataclass(frozen=True)
class Change:
    """One small change.

    Attributes:
        kind: one of `KINDS`.
        file: where.
        line: its line.
        old: the source of the node.
        new: what it becomes.
        text: the whole file with it.
    """

    kind: str
    file: str
    line: int
    old: str
    new: str
    node: ast.AST
    other: ast.AST

    @property
    def name(self) -> str:
        """File, line and change, for people."""
        return f"{self.file}:{self.line}: {self.old}  ->  {self.new}"

    @property
    def same(self) -> str:
        """Why it changes nothing; "" where it does."""
        line = (shapes.ROOT / self.file).read_text().splitlines()[self.line - 1]
        for (file, change, part), reason in EQUIVALENT.items():
            if file in ("", self.file) and change == f"{self.old}  ->  {self.new}" and part in line:
                return reason
        return ""


def others(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """(kind, what the node becomes) of each small change of it."""
    new = copy.deepcopy(node)
    if isinstance(new, ast.Compare):
        new.ops[0] = COMPARED[type(new.ops[0])]()
        yield "comparison", new
    elif isinstance(new, ast.BinOp | ast.AugAssign) and type(new.op) in COMPUTED:
        new.op = COMPUTED[type(new.op)]()
        yield "arithmetic", new
    elif isinstance(new, ast.UnaryOp) and isinstance(new.op, ast.USub):
        yield "arithmetic", new.operand
    elif isinstance(new, ast.UnaryOp) and isinstance(new.op, ast.Not):
        yield "condition", new.operand
    elif isinstance(new, ast.Constant) and type(new.value) in (bool, int, float):
        value = new.value
        new.value = (not value) if isinstance(value, bool) else value + 1
        yield "constant", new
    elif isinstance(new, ast.BoolOp):
        new.op = ast.Or() if isinstance(new.op, ast.And) else ast.And()
        yield "condition", new
    elif isinstance(new, ast.If | ast.IfExp | ast.While):
        new.test = ast.UnaryOp(ast.Not(), new.test)
        yield "condition", new


def annotations(tree: ast.AST) -> set[int]:
    """Nodes within annotations, which nothing computes with."""
    inside: set[int] = set()
    for node in ast.walk(tree):
        for part in ("annotation", "returns"):
            annotation = getattr(node, part, None)
            if isinstance(annotation, ast.AST):
                inside |= {id(n) for n in ast.walk(annotation)}
    return inside


def changes(root: Path = shapes.ROOT) -> list[Change]:
    """All small changes of edge/, in the order of the files."""
    found: list[Change] = []
    for path in sorted((root / "edge").rglob("*.py")):
        file = path.relative_to(root).as_posix()
        tree = ast.parse(path.read_text())
        apart = annotations(tree)
        for node in ast.walk(tree):
            if id(node) in apart:
                continue
            for kind, other in others(node):
                shown = [ast.unparse(n).splitlines()[0][:90] for n in (node, other)]
                line = getattr(node, "lineno", 0)
                found.append(Change(kind, file, line, *shown, node, other))
    return found


def drawn(count: int, seed: int) -> list[Change]:
    """As many of each kind, the same for the same seed.

    Each change draws a lot of its own, so that code which is changed elsewhere, or moved, hardly
    changes which are drawn.
    """
    lots: list[tuple[bytes, Change]] = []
    alike: Counter[str] = Counter()
    for change in changes():
        what = f"{change.file}: {change.old} -> {change.new}"
        lots.append((sha256(f"{seed} {what} {alike[what]}".encode()).digest(), change))
        alike[what] += 1
    lots.sort(key=itemgetter(0))
    out = []
    for kind in KINDS:
        out += [change for _, change in lots if change.kind == kind][: count // len(KINDS)]
    return out


def reach(kept: Path | None) -> dict[str, dict[str, list[str]]]:
    """{file: {line: the tests that run through it, the fastest first}}, from `kept` if there."""
    if kept is not None and kept.exists():
        stored: dict[str, dict[str, list[str]]] = json.loads(kept.read_text())
        return stored
    found = measured()
    if kept is not None:
        with write_whole(kept) as file:
            file.write(json.dumps(found).encode())
    return found


def measured() -> dict[str, dict[str, list[str]]]:
    """What the tests run through, by running them all."""
    with tempfile.NamedTemporaryFile(suffix=".json") as kept:
        words = [
            "-q",
            "-p",
            "tests.mutation.reach",
            "-p",
            "no:xdist",
            "-k",
            "not simulator",
            *(f"tests/{name}" for name in MEASURED),
        ]
        environment = {**os.environ, "REACH_FILE": kept.name, "PYTHONPATH": str(shapes.ROOT)}
        # A test that fails where its lines are measured still says which lines those are.
        subprocess.run(
            [sys.executable, "-m", "pytest", *words], cwd=shapes.ROOT, env=environment, check=False
        )
        found: dict[str, dict[str, list[str]]] = json.loads(Path(kept.name).read_text())
        return found


@cache
def apart() -> tuple[str, ...]:
    """The tests that run edge/ where its lines are not measured."""
    found = []
    for path in sorted((shapes.ROOT / "tests" / "edge").rglob("test_*.py")):
        text = path.read_text()
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                code = ast.get_source_segment(text, node) or ""
                if any(call in code for call in APART):
                    found.append(f"{path.relative_to(shapes.ROOT).as_posix()}::{node.name}")
    return tuple(found)


def job(change: Change, reached: dict[str, dict[str, list[str]]]) -> runner.Job:
    """The change and those who are asked: the tests of its line, its mirror, those apart."""
    mirror, package = runner.mirror(change.file), Path("tests", change.file).parent
    # Those of the module itself first, then the fastest; each file of tests takes time to load.
    tests = reached.get(change.file, {}).get(str(change.line), [])
    own = [test for test in tests if test.startswith(mirror)]
    rest = [test for test in tests if not test.startswith(mirror)]
    asked = (own, rest[:FEW_TESTS], rest[FEW_TESTS:MOST_TESTS])
    stages: list[tuple[str, ...]] = [tuple(some) for some in asked if some]
    # A default or a constant is run through but once, where the module is first imported.
    if (shapes.ROOT / mirror).exists():
        stages.append((mirror,))
    if not tests and package.name != "edge" and (shapes.ROOT / package).is_dir():
        stages.append((package.as_posix(),))
    text = shapes.swapped(change.file, change.node, change.other)
    return runner.Job(change.name, change.file, text, (*stages, apart()))


def main(argv: Sequence[str] | None = None) -> int:
    """Print a line a change; 1 where fewer than 90 % are noticed."""
    parser = argparse.ArgumentParser(prog="mutation.sample", description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=2012)
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--only", default="", help="changes whose line holds this text")
    parser.add_argument("--part", default="1/1", help="such as 2/4: the second quarter")
    parser.add_argument("--reach", type=Path, help="keep here which tests run through which line")
    parser.add_argument("--done", type=Path, help="what earlier runs printed: leave those out")
    arguments = parser.parse_args(argv)
    part, parts = map(int, arguments.part.split("/"))
    chosen = [c for c in drawn(arguments.count, arguments.seed) if arguments.only in c.name]
    done = arguments.done.read_text() if arguments.done and arguments.done.exists() else ""
    chosen = [c for c in chosen[part - 1 :: parts] if f" {c.name}\n" not in done]
    alive, tried = 0, [change for change in chosen if not change.same]
    for change in chosen:
        if change.same:
            print(f"SAME     {change.name}\n         {change.same}")
    reached = reach(arguments.reach)
    work = (job(change, reached) for change in tried)
    for one, noticed, took in runner.run(work, arguments.jobs):
        alive += not noticed
        verdict = "killed  " if noticed else "SURVIVED"
        print(f"{verdict} {one.name}\n         {noticed} [{took:.0f} s]", flush=True)
    same = len(chosen) - len(tried)
    print(f"{len(tried) - alive} of {len(tried)} changes are noticed; {same} more change nothing")
    return 1 if len(tried) - alive < SHARE * len(tried) else 0


if __name__ == "__main__":
    sys.exit(main())
