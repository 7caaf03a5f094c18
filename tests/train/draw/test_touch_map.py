"""A map of touch as a picture."""

import json
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from edge import demo
from edge.model.model import Model
from edge.touch.arm import Chain
from train.__main__ import main
from train.draw.touch_map import outline

HEAD = {
    "event": "map",
    "frame": "torso_lift_link",
    "unit": "metre",
    "tasks": ["category"],
}


def touch(n, place, label, confidence=1.0):
    decision = {"event": "decision", "task": "category", "flags": []}
    decision |= {"contact": n, "onset_s": float(n)}
    return decision | {"place": place, "label": label, "confidence": confidence}


@pytest.fixture
def path(tmp_path):
    rng = np.random.default_rng(5)
    labels = ["rigid-fixed", "soft-movable", r"no $\frac$ formula", None]
    places = rng.normal([0.4, -0.2, -0.3], 0.05, (20, 3)).tolist()
    touches = [
        touch(n, place, labels[n % 4], n % 3 / 2) for n, place in enumerate(places)
    ]
    path = tmp_path / "map.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in [HEAD, *touches]))
    return path


def test_a_map_is_drawn_beside_its_file(path, capsys):
    assert main(["show", str(path)]) == 0
    out = path.with_suffix(".png")
    assert capsys.readouterr().out.strip() == str(out)
    pixels = matplotlib.image.imread(out)[..., :3]
    assert pixels.shape[1] > 1000
    assert (
        len(np.unique(pixels.reshape(-1, 3).round(1), axis=0)) > 20
    )  # colours of labels


@pytest.mark.parametrize(
    ("text", "options", "sentence"),
    [
        (json.dumps(HEAD), [], "no contact is on this map yet"),
        (None, ["--task", "weight"], "has no task 'weight'; it has category"),
        ("hello", [], "not a map"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(path, refusal, text, options, sentence):
    if text is not None:
        path.write_text(text + "\n")
    assert sentence in refusal("show", path, *options)
    assert not path.with_suffix(".png").exists()


def test_the_arm_or_skin_of_a_model_is_drawn_behind_the_contacts(path, tmp_path):
    plain = tmp_path / "plain.png"
    behind = tmp_path / "behind.png"
    assert main(["show", str(path), "--out", str(plain)]) == 0
    assert (
        main(["show", str(path), "--model", str(demo.MODEL), "--out", str(behind)]) == 0
    )
    assert plain.read_bytes() != behind.read_bytes()
    chain = Chain.cody()
    name, (links,) = outline(replace(Model(demo.MODEL).info, chain=chain))
    assert name == "the arm, its joints mid-range"
    middle = [sum(limit) / 2 for limit in chain.limits]
    np.testing.assert_allclose(links[-1], chain.pose(middle)[:3, 3], atol=1e-12)


def test_a_skin_without_an_arm_is_its_own_outline():
    info = replace(Model(demo.MODEL).info, chain=None)
    name, lines = outline(info)
    assert name == "the skin"
    layout = info.layout
    for line in lines:
        np.testing.assert_allclose(
            np.hypot(line[:, 0], line[:, 1]),
            layout.radius_m,
            rtol=1e-12,
        )
    assert lines[0][0, 2] - lines[1][0, 2] == pytest.approx(15 * layout.pitch_m[0])
