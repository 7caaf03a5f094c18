"""Data flows one way: what each package may import."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BOARD = {"numpy", "onnxruntime", "smbus2", "edge"}
FORBIDDEN = {"pickle", "joblib.dump", "marshal", "shelve"}


def imported(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "edge" if node.level == 0 else "edge")
    return found


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("path", modules("edge"), ids=lambda p: str(p.relative_to(ROOT)))
def test_the_board_needs_numpy_onnxruntime_and_smbus2_alone(path):
    roots = {name.split(".")[0] for name in imported(path)}
    assert roots - BOARD <= set(sys.stdlib_module_names)


def test_train_never_reaches_export():
    for path in modules("train"):
        assert "export" not in {name.split(".")[0] for name in imported(path)}, path


@pytest.mark.parametrize("package", ["edge", "train", "export"])
def test_nothing_pickles(package):
    for path in modules(package):
        assert not imported(path) & FORBIDDEN, path


ORDER = ["frame", "region", "track", "features", "model", "live"]


@pytest.mark.parametrize("name", ORDER)
def test_no_room_of_the_path_reaches_back(name):
    """bus, chip, skin, region, track, features, model, decision: each knows those before it."""
    later = {f"edge.{room}" for room in ORDER[ORDER.index(name) + 1 :]}
    assert not imported(ROOT / "edge" / f"{name}.py") & later


def test_importing_the_path_does_not_load_onnxruntime():
    """It is most of the start-up time, and only a model needs it."""
    import subprocess

    code = "import sys, edge.cli, edge.classifier; sys.exit('onnxruntime' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0
