"""Each package imports only what it may, so that data flows one way."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BOARD = {"numpy", "onnxruntime", "smbus2", "edge"}
OPTIONAL = {"serial": "edge/i2c/serial_bus.py", "argcomplete": "edge/cli.py"}
"""The packages of the wheel's extras, and the only module that may import each."""
FORBIDDEN = {"pickle", "joblib.dump", "marshal", "shelve"}


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "edge" if node.level == 0 else "edge")
    return names


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("path", modules("edge"), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_board_imports_only_numpy_onnxruntime_and_smbus2(path):
    roots = {name.split(".")[0] for name in imported(path)}
    optional = {name for name, user in OPTIONAL.items() if path == ROOT / user}
    assert roots - BOARD - optional <= set(sys.stdlib_module_names)


@pytest.mark.parametrize("name", OPTIONAL)
def test_an_optional_dependency_is_imported_only_where_it_is_used(name):
    """Within a function, so that the module works without it."""
    tree = parsed(ROOT / OPTIONAL[name])
    loaded = [n for n in ast.walk(tree) if isinstance(n, ast.Import) and n.names[0].name == name]
    inside = [n for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for n in ast.walk(f)]
    assert loaded
    assert all(node in inside for node in loaded)


def test_train_never_reaches_export():
    for path in modules("train"):
        assert "export" not in {name.split(".")[0] for name in imported(path)}, path


@pytest.mark.parametrize("package", ["edge", "train", "export"])
def test_nothing_pickles(package):
    for path in modules(package):
        assert not imported(path) & FORBIDDEN, path


FRAME = ["i2c", "skin", "touch", "model", "classifier", "runtime", "commands"]
"""The way of one frame through `edge/`; a stage imports only earlier ones."""
OF_A_FRAME = {"edge.touch.frame", "edge.touch.layout"}
"""The skin makes these, and later stages pass them on."""


@pytest.mark.parametrize("stage", FRAME)
def test_no_stage_reaches_back(stage):
    later = FRAME[FRAME.index(stage) + 1 :]
    path = ROOT / "edge" / stage
    for module in sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]:
        for name in imported(module) - OF_A_FRAME:
            assert name.split(".")[1:2] not in [[room] for room in later], f"{module}: {name}"


TOUCH = ["frame", "layout", "region", "measures", "track", "features"]


@pytest.mark.parametrize("name", TOUCH)
def test_no_room_of_a_touch_reaches_back(name):
    """A frame becomes a region, a contact, a vector, in this order."""
    later = {f"edge.touch.{room}" for room in TOUCH[TOUCH.index(name) + 1 :]}
    assert not imported(ROOT / "edge" / "touch" / f"{name}.py") & later


def test_importing_the_path_does_not_load_onnxruntime():
    """Loading it takes most of the start-up time, and only a model needs it."""
    code = "import sys, edge.cli, edge.classifier; sys.exit('onnxruntime' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


def test_no_modules_import_each_other_in_a_circle():
    paths = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path
        for package in ("edge", "train", "export")
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
    assert graph["edge.skin.file"] >= {"edge.skin.kinds", "edge.skin.wiring"}
    assert len(list(TopologicalSorter(graph).static_order())) == len(graph)
