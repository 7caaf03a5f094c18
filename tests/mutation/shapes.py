"""Find code by its shape, whatever its names, its layout and its file are called today.

A pattern is Python source. Its structure, constants, keywords, builtins and the names of
modules such as `np` must agree; every other name (`self.high`, `rows`) may have been renamed, as
long as it is renamed alike throughout. `...` stands for any expression or any block. Among
several places of one shape, the one with the most of the pattern's own names is meant.
"""

from __future__ import annotations

import ast
import builtins
import copy
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("edge", "train", "export")
MODULES = frozenset({"np", "math", "os", "json", "TensorProto"})
"""Names that stay what they are, beside the builtins."""
LITERAL = MODULES | frozenset(dir(builtins))
LEAST = 0.4
"""The least likeness: its file and function, or as many of the names."""


@dataclass
class Match:
    """A place that has a pattern's shape.

    Attributes:
        file: its path from the root of the checkout.
        node: the node in the file's tree.
        function: the functions and classes that it stands in, dotted.
        names: the pattern's names and what stands for them here.
        parts: what `...` stands for, in order.
    """

    file: str
    node: ast.AST
    function: str
    names: dict[str, ast.expr] = field(default_factory=dict)
    parts: list[object] = field(default_factory=list)

    def likeness(self, hint: str) -> float:
        """Share of the names that are the pattern's own; its file and function break ties."""
        same = sum(name == ast.unparse(node) for name, node in self.names.items())
        share = same / len(self.names) if self.names else 1.0
        file, _, function = hint.partition(":")
        return share + 0.2 * (self.file == file) + 0.2 * (function in self.function.split("."))


def chain(node: object) -> str:
    """`a.b.c` of a dotted name; "" of anything else."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        start = chain(node.value)
        return f"{start}.{node.attr}" if start else ""
    return ""


def ellipsis(node: object) -> bool:
    """Whether it is `...`, as an expression or as a statement."""
    if isinstance(node, ast.Expr):
        node = node.value
    return isinstance(node, ast.Constant) and node.value is ...


def agree(pattern: object, node: object, match: Match) -> bool:
    """Whether a node has the pattern's shape; what stands for its names goes into `match`."""
    if isinstance(pattern, list):
        if len(pattern) == 1 and ellipsis(pattern[0]):
            match.parts.append(node)
            return isinstance(node, list)
        if not isinstance(node, list) or len(pattern) != len(node):
            return False
        return all(agree(p, n, match) for p, n in zip(pattern, node, strict=True))
    if not isinstance(pattern, ast.AST):
        return pattern == node
    if ellipsis(pattern):
        match.parts.append(node)
        return isinstance(node, ast.AST)
    name = chain(pattern)
    if name and name.split(".")[0] not in LITERAL:
        if not chain(node) or chain(node).split(".")[0] in LITERAL:
            return False
        assert isinstance(node, ast.expr)
        return ast.unparse(match.names.setdefault(name, node)) == ast.unparse(node)
    if type(pattern) is not type(node):
        return False
    return all(
        agree(value, getattr(node, part), match)
        for part, value in ast.iter_fields(pattern)
        if part not in ("ctx", "type_comment")
    )


def parsed(source: str) -> ast.AST:
    """A pattern: one expression or one statement."""
    (statement,) = ast.parse(source).body
    return statement.value if isinstance(statement, ast.Expr) else statement


@cache
def trees(root: Path) -> Mapping[str, Mapping[type, list[tuple[ast.AST, str]]]]:
    """For each file its nodes by type, each with the functions that it stands in."""
    out: dict[str, dict[type, list[tuple[ast.AST, str]]]] = {}
    for path in sorted(p for name in PACKAGES for p in (root / name).rglob("*.py")):
        nodes: dict[type, list[tuple[ast.AST, str]]] = {}
        for node, function in walk(ast.parse(path.read_text()), ""):
            nodes.setdefault(type(node), []).append((node, function))
        out[path.relative_to(root).as_posix()] = nodes
    return out


def walk(node: ast.AST, function: str) -> Iterator[tuple[ast.AST, str]]:
    """Each node below, and the dotted functions and classes around it."""
    for child in ast.iter_child_nodes(node):
        yield child, function
        inner = function
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            inner = f"{function}.{child.name}".strip(".")
        yield from walk(child, inner)


def find(source: str, hint: str, root: Path = ROOT) -> Match:
    """The one place that a pattern means.

    Args:
        source: the pattern.
        hint: `file:function` where it stood last.
        root: the checkout.

    Raises:
        LookupError: none has its shape, or several are equally like it.
    """
    pattern = parsed(source)
    found: list[Match] = []
    for file, nodes in trees(root).items():
        for node, function in nodes.get(type(pattern), []):
            match = Match(file, node, function)
            if agree(pattern, node, match):
                found.append(match)
    found.sort(key=lambda match: -match.likeness(hint))
    if not found or found[0].likeness(hint) < LEAST:
        raise LookupError(f"{hint}: nothing looks like {source!r}")
    if len(found) > 1 and found[0].likeness(hint) == found[1].likeness(hint):
        places = ", ".join(f"{m.file}:{m.node.lineno}" for m in found[:2])  # type: ignore[attr-defined]
        raise LookupError(f"{hint}: two places look alike for {source!r}: {places}")
    return found[0]


class Filled(ast.NodeTransformer):
    """A replacement with the names and parts of the place that it goes to."""

    def __init__(self, match: Match) -> None:
        self.names, self.parts = match.names, iter(match.parts)

    def visit(self, node: ast.AST) -> ast.AST | list[ast.stmt]:
        name = chain(node)
        if name in self.names:
            standing = copy.deepcopy(self.names[name])
            for inner in ast.walk(standing):
                if hasattr(inner, "ctx"):
                    inner.ctx = ast.Load()
            if hasattr(node, "ctx"):
                standing.ctx = node.ctx  # type: ignore[attr-defined]
            return standing
        if ellipsis(node):
            return copy.deepcopy(next(self.parts))  # type: ignore[return-value]
        return self.generic_visit(node)


class Swapped(ast.NodeTransformer):
    """A tree in which one node is another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def without(match: Match, source: str, root: Path = ROOT) -> str:
    """The text of the match's file with a replacement in its place."""
    new = Filled(match).visit(parsed(source))
    assert isinstance(new, ast.AST)
    if isinstance(match.node, ast.stmt) and isinstance(new, ast.expr):
        new = ast.Expr(new)
    return swapped(match.file, match.node, new, root)


def span(node: ast.AST) -> tuple[int | None, ...]:
    """Where a node begins and ends; with its type, which node it is."""
    parts = ("lineno", "col_offset", "end_lineno", "end_col_offset")
    return tuple(getattr(node, part, None) for part in parts)


def swapped(file: str, old: ast.AST, new: ast.AST, root: Path = ROOT) -> str:
    """The text of a file in which the node that stands where `old` does is `new`."""
    tree = ast.parse((root / file).read_text())
    (here,) = (n for n in ast.walk(tree) if type(n) is type(old) and span(n) == span(old))
    return ast.unparse(ast.fix_missing_locations(Swapped(here, new).visit(tree))) + "\n"
