"""The recipes for other labs' data, run on files in their form."""

import os
import re
import subprocess
import sys

import numpy as np
import pytest

from edge.record.recording import load
from tests.conftest import ROOT
from tests.train.importers.ros import FRAMES, sensor, write_mcap

BLOCKS = re.findall(
    r"^```(sh|python)\n(.*?)^```", (ROOT / "docs/recipes.md").read_text(), re.M | re.S
)


def run(folder, word):
    """Run the block of the page that has a word in it; the recordings by name."""
    ((kind, text),) = [(kind, text) for kind, text in BLOCKS if word in text]
    shell = text.replace("python -m", f"{sys.executable} -m")
    words = ["sh", "-ec", shell] if kind == "sh" else [sys.executable, "-c", text]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run(words, cwd=folder, env=environment, check=True, capture_output=True)
    return {path.stem: load(path) for path in folder.glob("recordings/*.npz")}


def test_grasps_of_a_hand_whose_joints_are_in_degrees(tmp_path):
    (tmp_path / "icub_grasps").mkdir()
    rng = np.random.default_rng(1)
    for name in ("red_cup_1", "blue_bear_10"):
        lines = ["-10000"]
        for frame in range(20):
            values = 245 + rng.integers(-1, 2, (5, 12)) - 20 * (frame > 10)
            rows = [
                [20.0, 81.5, 15.0, 0.5, 40.0, 66.0, 36.0, 55.0, 2.0],
                [14.0] * 5,
                *values,
            ]
            lines += [" ".join(map(str, row)) for row in rows]
        text = "\r\n".join([*lines, ""])
        (tmp_path / "icub_grasps" / f"{name}.txt").write_text(text, newline="")
    recordings = run(tmp_path, "icub_grasps")
    assert {name: trial.labels["object"] for name, trial in recordings.items()} == {
        "blue_bear_10": "blue_bear",
        "red_cup_1": "red_cup",
    }
    cup = recordings["red_cup_1"]
    assert cup.frames.shape == (20, 5, 12)
    assert cup.joints[0, 1] == pytest.approx(np.radians(81.5))
    assert cup.frames[15].min() > 15 > cup.frames[5].max()


def test_grasps_that_stand_in_one_file_below_a_line_each(tmp_path):
    names = ",".join(f"opto{i}_{axis}" for i in (1, 2, 3) for axis in "xyz")
    lines = ["Philip Maus,data"]
    for grasp, thing in ((7, 3), (8, 4)):
        lines += [f"header,grasp,{grasp},,,,,,,,{thing}", f"step,{names}"]
        for step in range(12):
            force = 0.5 * (step > 6)
            values = ",".join(["0.01", "-0.02", f"{0.03 - force}"] * 3)
            lines.append(f"{step},{values}")
    (tmp_path / "000_real_life_data.csv").write_text("\n".join(lines))
    run(tmp_path, "000_real_life_data.csv")
    recordings = run(tmp_path, "opto1-opto3")
    assert {name: trial.labels["object"] for name, trial in recordings.items()} == {
        "object3_7": "object3",
        "object4_8": "object4",
    }
    trial = recordings["object3_7"]
    assert trial.shear.shape == (12, 1, 3, 2)
    assert trial.frames[10].min() > 0 == trial.frames[3].max()


def test_a_log_of_a_sensors_own_messages(tmp_path):
    write_mcap(tmp_path / "grasp.mcap", sensor())
    recordings = run(tmp_path, "grasp.mcap")
    assert (recordings["grasp"].frames == FRAMES >> 1).all()
    assert recordings["grasp"].shear is not None
