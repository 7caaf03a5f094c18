"""Imports follow the one way of the data, and the board's package needs few others."""

import ast
import sys
from functools import cache
from graphlib import TopologicalSorter

import pytest

from tests.conftest import ROOT, python

PACKAGES = ["edge", "train", "export"]
BOARD = {"numpy", "onnxruntime", "smbus2", "edge"}
OPTIONAL = {"serial": "edge/wire/bus/serial_bus.py", "argcomplete": "edge/app/cli.py"}
"""The packages of the wheel's extras, and the only module that may import each."""
FORBIDDEN = {"pickle", "joblib.dump", "marshal", "shelve"}


@cache
def parsed(path):
    return ast.parse(path.read_text())


@cache
def imported(path):
    names = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "edge" if node.level == 0 else "edge")
    return names


def at_the_top(path):
    """What a module imports when it is loaded."""
    nodes = [node for node in parsed(path).body if isinstance(node, ast.ImportFrom)]
    return {node.module or "edge" for node in nodes}


def modules(package):
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize(
    "path",
    modules("edge"),
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_the_board_imports_only_numpy_onnxruntime_and_smbus2(path):
    roots = {name.split(".")[0] for name in imported(path)}
    optional = {name for name, user in OPTIONAL.items() if path == ROOT / user}
    assert roots - BOARD - optional <= set(sys.stdlib_module_names)


@pytest.mark.parametrize("name", OPTIONAL)
def test_an_optional_dependency_is_imported_only_where_it_is_used(name):
    """Within a function, so that the module works without it."""
    inside = set()
    loaded = set()
    for node in ast.walk(parsed(ROOT / OPTIONAL[name])):
        if isinstance(node, ast.FunctionDef):
            inside.update(ast.walk(node))
        if isinstance(node, ast.Import) and node.names[0].name == name:
            loaded.add(node)
    assert loaded
    assert loaded <= inside


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_pickles(package):
    for path in modules(package):
        assert not imported(path) & FORBIDDEN, path


ROOMS = ("wire", "touch", "features", "record", "decide", "app")
FRAME = [f"edge.{room}" for room in ROOMS]
"""The way of one frame through `edge/`."""
TOUCH = [f"edge.touch.{name}" for name in ("frame", "layout", "region", "track")]
"""The way of a touch: a frame becomes a region, a contact."""
FITTING = [f"train.{room}" for room in "data model choose fitting report".split()]
"""The rooms of the workstation, from the bottom."""
OF_A_FRAME = {"edge.touch.frame", "edge.touch.layout"}
"""The skin makes these, and later stages pass them on."""
STAGES = [
    (way[i], way[i + 1 :])
    for way in (PACKAGES, FRAME, TOUCH, FITTING)
    for i in range(len(way))
]


@pytest.mark.parametrize(("stage", "later"), STAGES)
def test_a_stage_imports_only_earlier_ones(stage, later):
    path = ROOT.joinpath(*stage.split("."))
    passed_on = set() if stage in TOUCH else OF_A_FRAME
    for module in sorted(path.rglob("*.py")) or [path.with_suffix(".py")]:
        if module.parent.name == "fake":  # plays recordings to the wire
            continue
        for name in at_the_top(module) - passed_on:
            rooms = tuple(f"{room}." for room in later)
            assert not f"{name}.".startswith(rooms), f"{module}: {name}"


@pytest.mark.parametrize(
    ("program", "left_out"),
    [
        ("import edge", ("edge.", "numpy")),
        ("import edge.app.cli, edge.decide.classifier", ("onnxruntime",)),
        (
            "from edge.app import cli; cli.parser(['check'])",
            ("edge.app.commands.r", "edge.app.sinks"),
        ),
    ],
)
def test_what_is_slow_is_loaded_only_when_it_is_needed(program, left_out):
    """Loading onnxruntime takes most of the start-up time, and only a model needs
    it."""
    code = f"{program}; import sys; print([m for m in sys.modules if m.startswith({left_out})])"
    assert python("-c", code).stdout == "[]\n"


INSIDE = 15
"""Imports within functions of edge: what is optional by nature, as a command, the driver
of a chip or a bus, the page, the fake and early decisions."""


def test_imports_stand_at_the_head():
    inside = {
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in modules("edge")
        for function in ast.walk(parsed(path))
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert len(inside) <= INSIDE, sorted(inside)


def test_only_the_top_floor_knows_commands():
    """Training and export have its options and its way to run a program alone; no
    command imports another, but where it lists them."""
    for path in [*modules("train"), *modules("export")]:
        app = {name for name in imported(path) if name.startswith("edge.app")}
        app -= {"edge.app.cli", "edge.app.options"}
        assert not app, path
    for path in modules("edge"):
        commands = [n for n in imported(path) if n.startswith("edge.app.commands")]
        assert not commands or path.name == "cli.py", path


def test_no_modules_import_each_other_in_a_circle():
    paths = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path
        for package in PACKAGES
        for path in modules(package)
        if path.name != "__init__.py"
    }
    graph = {}
    for name, path in paths.items():
        named = {
            f"{node.module}.{alias.name}"
            for node in ast.walk(parsed(path))
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        graph[name] = (imported(path) | named) & paths.keys()
    assert graph["edge.wire.skin.file"] >= {
        "edge.wire.chips.chip",
        "edge.wire.skin.wiring",
    }
    assert len(list(TopologicalSorter(graph).static_order())) == len(graph)
