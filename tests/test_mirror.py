"""Tests mirror the modules, in their room and name: each has a test file of its name, is
imported by a test of its room, or stands in a list with the test that specifies it. Each
test file is named after a module or a folder of its room, and maybe an aspect of it."""

import re
from pathlib import Path

from tests.conftest import ROOT

THROUGH = {
    "export/c_text.py": "export/test_c_code.py",
    "export/formula.py": "edge/decide/test_knn.py",
    "edge/app/commands/demo.py": "test_demo_data.py",
    "edge/touch/contact.py": "edge/touch/test_track.py",
    "train/study": "train/study/test_study_report.py",
    "train/tradeoff": "train/tradeoff/test_tradeoff.py",
    "train/commands/show.py": "train/test_draw.py",
    "train/commands/simulate.py": "train/simulate/test_run.py",
    "train/commands/study.py": "train/study/test_study_report.py",
    "train/commands/tradeoff.py": "train/tradeoff/test_tradeoff.py",
    "train/report/options.py": "train/study/test_study_report.py",
    "train/report/work.py": "train/study/test_study_report.py",
    "train/fitted.py": "train/test_fitting.py",
    "train/data/vectors.py": "train/choose/test_choose.py",
    "train/importers/forms": "train/importers/forms/test_forms.py",
    "train/simulate/families.py": "train/simulate/test_scene.py",
    "train/simulate/groups.py": "train/simulate/test_effects.py",
    "train/simulate/trials.py": "train/simulate/test_effects.py",
}
"""{module or folder: the test file that specifies it with others}."""
OF_PROGRAMS = {"edge/app/sinks/test_service.py", "export/test_early_stopping.py"}
"""Test files of several rooms together."""
PACKAGES = ("edge", "train", "export")
MODULES = [
    path.relative_to(ROOT)
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
    if not path.name.startswith("__")
]
TESTS = {
    path.relative_to(ROOT / "tests").as_posix(): path.read_text()
    for path in sorted((ROOT / "tests").rglob("test_*.py"))
}


def specified(module):
    """Whether a module has a test; one that defines nothing but names needs none."""
    if not re.search(r"^\s*(def|class) ", (ROOT / module).read_text(), re.M):
        return True
    listed = {THROUGH.get(part.as_posix()) for part in (module, module.parent)}
    if {(module.parent / f"test_{module.name}").as_posix(), *listed} & set(TESTS):
        return True
    package = ".".join(module.parent.parts)
    name = module.stem
    imported = rf"(from|import) {package}\.{name}\b|from {package} import .*\b{name}\b"
    if module.parent.name in ("commands", "app"):
        imported += rf"|main\(\[\"{name.strip('_')}\"|run\(\"{name}\"|edge\(\"{name}\""
    if module.parent.name == "effects":
        imported += rf"|\"{name}\"|\b{name}="
    room = "/".join(module.parent.parts[:2])
    of_room = (text for path, text in TESTS.items() if path.startswith(room))
    return any(re.search(imported, text) for text in of_room)


def test_every_module_is_specified_by_a_test():
    without = [module.as_posix() for module in MODULES if not specified(module)]
    assert without == [], "give each a test file of its name"
    modules = {part.as_posix() for path in MODULES for part in (path, path.parent)}
    assert THROUGH.keys() - modules == set(), "leave out what is gone"


def has_module(test):
    """Whether a test file has the name of a module or folder of its room."""
    room = ROOT / Path(test).parent
    names = {path.stem for path in room.iterdir()} | {room.name}
    aspects = Path(test).stem.removeprefix("test_").split("_")
    return any("_".join(aspects[:n]) in names for n in range(1, len(aspects) + 1))


def test_every_test_file_has_a_module():
    of_rooms = (test for test in TESTS if test.split("/")[0] in PACKAGES)
    assert {test for test in of_rooms if not has_module(test)} == OF_PROGRAMS
