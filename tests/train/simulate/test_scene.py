"""The keys of a scene's file, and the sentence that each mistake gets."""

import copy
import math
from dataclasses import replace
from pathlib import Path

import pytest

from edge.errors import InputError
from edge.touch.arm import Chain
from tests.train.simulate.scenes import movable
from train.simulate import scene as scenes
from train.simulate.run import simulate
from train.simulate.scene import from_dict

SCENES = Path(__file__).parents[3] / "train" / "scenes"
GOOD = {
    "name": "test",
    "seed": 1,
    "trials": {"count": 2, "lead_s": [0.1, 0.2]},
    "step_s": {"base": 0.01, "sliding": 0.005},
    "skin": {"taxel_n_m": 8000.0},
    "arm": {},
    "motion": {},
    "spread": {"yaw_deg": 2.0},
    "effects": {"add": ["tilt"], "noise": {"counts": 4.0}},
    "object": movable([1.0, 2.0], 0.5, 0.4),
}


def changed(path, value):
    """The good scene with another value, at a path like `object.0.name`."""
    table = copy.deepcopy(GOOD)
    *keys, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    place = table
    for key in keys:
        place = place[key]
    place[last] = value
    return table


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda p: p.stem)
def test_the_shipped_scenes_are_good(path):
    scene = scenes.load(path)
    assert scene.name == path.stem
    assert {o.family for o in scene.objects} >= {"rigid", "foam"}


MISTAKES = [
    ("colour", 1, "unknown key colour; allowed: seed, trials, arm"),
    (
        "trials.lead_s",
        [0.3, 0.1],
        "a range with its lower limit first, [0.1, 0.3], not [0.3, 0.1]",
    ),
    (
        "step_s.sliding",
        0.003,
        "step_s.sliding must be an even part of a frame's 0.01 s",
    ),
    ("motion.travel_s", 0.1, "the arm's stroke ends after 0.1 s (motion.travel_s, or"),
    (
        "motion.start_deg",
        [-60, 0, 0, 0, 0],
        "of shoulder_pitch must be -47.61 to 120, not -60.0",
    ),
    (
        "motion.rate_deg_s",
        [0] * 5,
        "must be not all 0, so that the arm reaches an object",
    ),
    ("motion.place_m", 5.0, "motion.place_m must be a number from 0.02232 to"),
    ("spread.place_m", 0.05, "spread.place_m must be at most 0.0322, not 0.05: some"),
    (
        "effects.add",
        ["tlit"],
        "effects.add must be a list of different names out of foundation,",
    ),
    ("effects.add", ["stems"], "it needs an object of family foliage"),
    (
        "object",
        GOOD["object"] * 2,
        "object 'thing': name must be different from every other",
    ),
    ("trials.lead_s", [0.1], "trials.lead_s must be one number or a range"),
    ("skin.cols", 2, "skin.cols must be a whole number from 3 to 1000, not 2"),
    ("object", [], "give at least one [[object]] or [[family]]"),
    ("object.0.conditions", [], "conditions must be fixed, movable or both"),
    ("object.0.friction_static", None, "friction_static is missing"),
    ("object.0.friction_kinetic", 0.6, "must be at most friction_static (0.5)"),
    (
        "object.0.modulus_pa",
        1e4,
        "object 'thing': unknown key modulus_pa; allowed: name",
    ),
    ("object.0.base_m", 0.2, "object 'thing': height_m is missing"),
]


@pytest.mark.parametrize(("path", "value", "says"), MISTAKES)
def test_a_mistake_gets_one_sentence_with_the_key_and_the_values_allowed(
    path,
    value,
    says,
):
    with pytest.raises(InputError) as error:
        from_dict(changed(path, value), where="scene.toml")
    assert str(error.value).startswith("scene.toml: ")
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_trials_whose_recordings_no_command_would_read_are_refused():
    trials = {"after_s": 60.0, "rate_hz": 5000.0}
    with pytest.raises(InputError, match="a recording of 301001 frames would hold"):
        from_dict({**GOOD, "trials": trials, "step_s": {}})


def test_a_scene_may_be_like_another_but_for_its_own_values(tmp_path):
    (tmp_path / "one.toml").write_text(
        'name = "one"\n[trials]\ncount = 3\nafter_s = 1.5\n[spread]\nyaw_deg = 2.0\n'
        '[[object]]\nname = "wall"\nfamily = "rigid"\nconditions = ["fixed"]\n'
    )
    second_file = tmp_path / "other.toml"
    second_file.write_text('like = "one.toml"\nname = "other"\n[trials]\ncount = 4\n')
    first = scenes.load(tmp_path / "one.toml")
    second = scenes.load(second_file)
    trials = {**first.trials, "count": 4}
    assert second == replace(first, name="other", trials=trials, arm=second.arm)
    (tmp_path / "third.toml").write_text('like = "other.toml"\n')
    with pytest.raises(InputError, match="itself like another scene"):
        scenes.load(tmp_path / "third.toml")
    second_file.write_text("like = 3\n")
    with pytest.raises(InputError, match="like must be"):
        scenes.load(second_file)


def test_a_skin_of_other_columns_has_them_evenly_around():
    scene = from_dict({**GOOD, "skin": {"cols": 12, "release_s": 0.7}})
    assert scene.skin.column_angles_deg[:2] == (15.0, 45.0)
    assert scene.skin.column_angles_deg[-1] == -15.0
    assert scene.skin.pitch[1] == pytest.approx(2.0 * math.pi * 0.04604 / 12)
    _, trial = next(simulate(replace(scene, trials={**scene.trials, "count": 1.0})))
    assert trial.frames.shape[1:] == (16, 12)
    assert trial.meta["skin"]["release_s"] == 0.7


def test_a_motion_about_the_forearm_itself_is_refused():
    scene = from_dict({**GOOD, "motion": {"rate_deg_s": [0.0, 0.0, 0.0, 0.0, 20.0]}})
    with pytest.raises(InputError, match="rate_deg_s does not move the forearm"):
        next(simulate(scene))


def test_an_arm_may_come_from_a_urdf_unless_it_slides(tmp_path):
    robot = """
        <robot name="r"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="lift" type="{}"><parent link="a"/><child link="b"/>
        <axis xyz="0 -1 0"/><limit lower="-1" upper="1"/></joint>
        <joint name="tip" type="fixed"><parent link="b"/><child link="c"/>
        <origin xyz="0 0 -0.4"/></joint></robot>"""
    urdf = tmp_path / "arm.urdf"
    place = str(tmp_path / "scene.toml")
    arm = {"chain": "arm.urdf", "base": "a", "tip": "c"}
    arm |= {"stiffness_nm_rad": [12.0], "damping_nms_rad": [0.4]}
    table = {**GOOD, "arm": arm, "motion": {"start_deg": [0.0], "rate_deg_s": [30.0]}}
    urdf.write_text(robot.format("revolute"))
    scene = from_dict(table, place)
    assert scene.arm.to_dict() == Chain.from_urdf(urdf, "a", "c").to_dict()
    assert next(simulate(scene))[1].frames.max() > 0
    urdf.write_text(robot.format("prismatic"))
    with pytest.raises(
        InputError, match="chain: joint 'lift' slides; .* make it fixed"
    ):
        from_dict(table, place)


def test_a_key_that_no_condition_of_the_object_heeds_is_refused():
    keys = {"conditions": ["fixed"], "slope_deg": 5.0}
    table = changed("object.0", GOOD["object"][0] | keys)
    with pytest.raises(
        InputError, match="gives slope_deg, which has no effect without"
    ):
        from_dict(table, where="scene.toml")
