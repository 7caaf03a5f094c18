"""Tests mirror the modules: each module has a test file of its name, or one that is listed here."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("edge", "train", "export")

TOPICS = {
    # Commands, as a user runs them one after another.
    "edge/commands/test_live_commands.py",
    "edge/commands/test_replay_verify.py",
    "edge/commands/test_owner_loop.py",
    # The parts of the fake work only together.
    "edge/fake/test_fake_bus.py",
    # smbus2 itself, over a stand-in for the kernel; the loop as a service.
    "edge/i2c/test_smbus2.py",
    "edge/runtime/test_service.py",
    "train/importers/test_importers.py",
    "train/importers/test_log_importers.py",
    "train/simulate/test_effects.py",
    # Reports by their contents; complete exports.
    "export/test_early_stopping.py",
    "train/study/test_study_report.py",
    "train/tradeoff/test_tradeoff.py",
    "train/test_more_features.py",
    "export/test_export_command.py",
    "export/test_export_features.py",
}
"""Test files that specify several modules together."""

THROUGH = {
    "train/study": "train/study/test_study_report.py",
    "train/tradeoff": "train/tradeoff/test_tradeoff.py",
    "train/report/work.py": "train/study/test_study_report.py",
    "edge/commands/source.py": "edge/commands/test_live_commands.py",
    "edge/config.py": "edge/skin/test_file.py",
    "train/commands/tradeoff.py": "train/tradeoff/test_tradeoff.py",
    "train/importers/mcap.py": "train/importers/test_log_importers.py",
    "train/importers/rosbag.py": "train/importers/test_log_importers.py",
    "train/importers/topics.py": "train/importers/test_log_importers.py",
    "train/simulate/effects/slope.py": "train/simulate/test_simulate_pushing.py",
    "train/simulate/effects/turning.py": "train/simulate/test_simulate_pushing.py",
    "train/simulate/truth.py": "train/simulate/test_simulate_truth.py",
    "train/simulate/scene_model.py": "train/simulate/test_simulate_scene.py",
    "train/simulate/effects/base.py": "train/simulate/test_simulate_oracles.py",
    "train/simulate/trials.py": "train/simulate/test_simulate_oracles.py",
}
"""{module, or folder of a report's sections: the test file that specifies it with others}."""

MODULES = [
    path.relative_to(ROOT)
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
    if not path.name.startswith("__")
]
TESTS = {
    path.relative_to(ROOT / "tests").as_posix(): path.read_text()
    for path in sorted((ROOT / "tests").rglob("*.py"))
    if path != Path(__file__)
}
# The simulator against laws of physics, with the effects that each law needs.
TOPICS |= {name for name in TESTS if name.startswith("train/simulate/test_simulate_")}


def specified(module: Path) -> bool:
    """Whether a test file has the module's name, imports it, or runs it as a command."""
    if (module.parent / f"test_{module.name}").as_posix() in TESTS:
        return True
    if {THROUGH.get(part.as_posix()) for part in (module, module.parent)} & set(TESTS):
        return True
    package, name = ".".join(module.parent.parts), module.stem
    imported = rf"(from|import) {package}\.{name}\b|from {package} import .*\b{name}\b"
    if module.parent.name == "commands":
        imported += rf"|main\(\[\"{name.strip('_')}\"|run\(\"{name}\"|edge\(\"{name}\""
    if module.parent.name == "effects":
        imported += rf"|\"{name}\""
    return any(re.search(imported, text) for text in TESTS.values())


def test_every_module_is_specified_by_a_test():
    without = [module.as_posix() for module in MODULES if not specified(module)]
    assert without == [], "give each a test file of its name"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_test_file_has_the_name_of_a_module_or_is_a_topic(package):
    files = [file for file in TESTS if file.startswith(f"{package}/") and "/test_" in file]
    names = {(module.parent / f"test_{module.name}").as_posix() for module in MODULES}
    assert sorted(set(files) - names - TOPICS) == [], "name it after its module"


def test_every_topic_exists():
    assert sorted(TOPICS - set(TESTS)) == []
