"""Each module has a test file of its name, each test file a module; exceptions are named here."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("edge", "train", "export")

TOGETHER = {
    # Commands, as a user runs them one after another.
    "edge/commands/test_live_commands.py": "calibrate check record run scan source sure view",
    "edge/commands/test_replay_verify.py": "replay summary verify",
    "edge/commands/test_owner_loop.py": "check scan calibrate record run",
    # The fake's parts are only worth what they give together.
    "edge/fake/test_fake_bus.py": "bus chips faults clock",
    # smbus2 itself, over a stand-in for the kernel.
    "edge/i2c/test_smbus2.py": "bus",
    "edge/runtime/test_service.py": "systemd loop",
    "edge/touch/test_track.py": "contacts frame tracks",
    "train/importers/test_importers.py": "csv_frames sdh2",
    "train/importers/test_log_importers.py": "mcap rosbag topics",
    # The simulator against laws of physics, whichever effects they need.
    "train/simulate/test_simulate_oracles.py": "arm base contact convergence engine motion "
    "foundation impact sliding stribeck tipping stems pop relaxation hysteresis",
    "train/simulate/test_simulate_stability.py": "contact tilt cover",
    "train/simulate/test_simulate_called_for.py": "plan required_effects explain crosstalk "
    "dead_band dead_taxels drift dropped_frames jitter noise quantisation saturation",
    "train/simulate/test_simulate_run.py": "run sensor_frames",
    "train/simulate/test_simulate_scene.py": "scene scene_model schema reader",
    "train/simulate/test_simulate_paper.py": "run convergence",
    # Reports, by what stands in them.
    "train/study/test_study_report.py": "beyond classify context honest paper resolution run",
    "train/tradeoff/test_tradeoff.py": "accuracy board early plots prices run sections wires",
    "export/test_export_command.py": "golden",
    "export/test_export_features.py": "graph",
    "train/test_more_features.py": "dataset pipeline",
}
"""{test file of another name: the modules beside it, or below, that it specifies}."""

ELSEWHERE = {
    "edge/commands/demo.py": "tests/test_demo_data.py",
    "edge/config.py": "tests/edge/skin/test_file.py",
    "edge/files.py": "tests/edge/test_recording.py",
    "edge/clock.py": "tests/edge/runtime/test_loop.py",
    "edge/skin/calibration.py": "tests/edge/skin/test_file.py",
    "edge/skin/buffers.py": "tests/edge/skin/test_skin.py",
    "train/draw/recording.py": "tests/test_readme.py",
    "train/commands/import_.py": "tests/train/importers/test_importers.py",
    "train/commands/show.py": "tests/train/draw/test_touch_map.py",
    "train/commands/simulate.py": "tests/train/simulate/test_simulate_run.py",
    "train/commands/study.py": "tests/train/study/test_study_report.py",
    "train/commands/tradeoff.py": "tests/train/tradeoff/test_tradeoff.py",
}
"""{module: the test file that specifies it, where that stands in another folder}."""

MODULES = [
    path.relative_to(ROOT)
    for package in PACKAGES
    for path in sorted((ROOT / package).rglob("*.py"))
    if not path.name.startswith("__")
]
TESTS = [
    path.relative_to(ROOT / "tests")
    for package in PACKAGES
    for path in sorted((ROOT / "tests" / package).rglob("test_*.py"))
]


def together(module: Path) -> list[str]:
    """The test files of other names that say they specify a module."""
    return [
        file
        for file, names in TOGETHER.items()
        if module.stem in names.split() and module.parent.is_relative_to(Path(file).parent)
    ]


@pytest.mark.parametrize("module", MODULES, ids=str)
def test_a_module_has_a_test_file(module):
    mirror = ROOT / "tests" / module.parent / f"test_{module.name}"
    assert mirror.exists() or together(module) or ELSEWHERE.get(module.as_posix()), (
        f"{mirror.relative_to(ROOT)} is missing"
    )


@pytest.mark.parametrize("file", TESTS, ids=str)
def test_a_test_file_has_a_module(file):
    module = file.parent / file.name.removeprefix("test_")
    assert module in MODULES or file.as_posix() in TOGETHER, f"{module} is no module"


def test_the_exceptions_exist_and_are_needed():
    for file, names in TOGETHER.items():
        assert Path(file) in TESTS, file
        for name in names.split():
            folder = ROOT / Path(file).parent
            assert any(folder.rglob(f"{name}.py")), f"{file} specifies {name}, which is not there"
    for module, test in ELSEWHERE.items():
        assert (ROOT / module).exists(), module
        assert (ROOT / test).exists(), test
        mirror = ROOT / "tests" / Path(module).parent / f"test_{Path(module).name}"
        assert not mirror.exists(), f"{module} has a test file of its own now"
