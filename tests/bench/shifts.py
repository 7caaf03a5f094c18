"""`make shifts`: do answers on touches unlike the training carry a doubt?

A model is exported from a simulated set. Fresh touches of the same objects are changed
as a robot's life changes them: taxels die or stick, counts double, a sleeve is put on,
the skin turns on the arm, frames are lost or repeated, joint angles freeze. Others are
simulated with another arm or with another effect of the sensors, from the same draws.
The board's own classifier decides on them. A wrong answer is one in doubt if it has a flag, or a
confidence below one half; it is sure if it has neither and a confidence of 95 % or more.

"held" says whether a shift is told at least as the user was promised: most of its
touches are in doubt, or the answers without a doubt are right about as often as those
on touches that are not shifted.
"""

from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model
from tests.bench import tables
from tests.bench.program import start
from train.data.parts import part
from train.progress import bar
from train.simulate import scene as scenes
from train.simulate.engine import run_physics
from train.simulate.run import batches_of, file_name, recordings, simulate
from train.simulate.schema import EFFECTS

SCENE = tables.SCENES / "cody18.toml"
FRESH_SEED = 77
ENOUGH = 0.6
"""Share of a shift's touches that are in doubt, at the least."""
WORSE = 0.05
"""By so much the answers without a doubt may be worse than those on usual touches."""
UNSURE = 0.5
SURE = 0.95


def counts(change):
    """A change of the counts (frames, rows, cols), which stay within 16 bits."""

    def shift(recording):
        changed = np.rint(change(recording.frames.astype(np.float64)))
        return replace(recording, frames=np.clip(changed, 0, 65535).astype(np.uint16))

    return shift


def joints(change):
    """A change of the joint angles (frames, dof)."""
    return lambda recording: replace(recording, joints=change(recording.joints))


def half_dead(frames):
    alive = np.random.default_rng(5).random(frames.shape[1:]) < 0.5
    return frames * alive


def stuck(frames):
    frames[:, 3, 5] = 2000.0
    return frames


def touched_from(recording):
    """The tenth frame after the first with a taxel above the onset."""
    felt = recording.frames.max(axis=(1, 2)) > recording.layout.onset
    return int(felt.argmax()) + 10


def paused(recording):
    """A quarter of a second without frames, a tenth after the touch began."""
    t = recording.t.copy()
    t[touched_from(recording) :] += 0.25
    return replace(recording, t=t)


def frozen(recording):
    """The frames of the touch repeat its tenth."""
    frames = recording.frames.copy()
    tenth = touched_from(recording)
    frames[tenth:] = frames[tenth]
    return replace(recording, frames=frames)


SHIFTS = {
    "none": lambda recording: recording,
    "two of three frames lost": lambda r: part(r, slice(None, None, 3)),
    "half of the taxels dead": counts(half_dead),
    "counts doubled": counts(lambda frames: 2.0 * frames),
    "a tenth of the counts": counts(lambda frames: 0.1 * frames),
    "60 counts on all taxels": counts(lambda frames: frames + 60.0),
    "a sleeve: 100 counts less": counts(lambda frames: frames - 100.0),
    "skin one column round": counts(lambda frames: np.roll(frames, 1, axis=2)),
    "skin a quarter round": counts(lambda frames: np.roll(frames, 6, axis=2)),
    "skin upside down": counts(lambda frames: frames[:, ::-1]),
    "a taxel stuck at 2,000": counts(stuck),
    "a pause of 0.25 s": paused,
    "frozen frames": frozen,
    "joint angles constant": joints(lambda q: np.repeat(q[:1], len(q), axis=0)),
    "joint angles of the other sign": joints(lambda q: -q),
}


def scene_changes(scene):
    """{what is changed: the changed scene}: another arm, or one effect of the sensors
    more or less."""
    changes = {}
    for factor in (0.5, 2.0):
        # The distance stays.
        rate = tuple(factor * speed for speed in scene.rate)
        slower = {"rate": rate, "travel_s": scene.travel_s / factor}
        changes[f"arm speed x {factor:g}"] = slower
        stiffness = tuple(factor * spring for spring in scene.stiffness)
        changes[f"arm stiffness x {factor:g}"] = {"stiffness": stiffness}
    for name, effect in EFFECTS.items():
        if effect.stage in ("sensor", "clock"):
            add = tuple(other for other in scene.add if other != name)
            if add == scene.add:
                changes[f"with {name}"] = {"add": (*add, name)}
            else:
                changes[f"without {name}"] = {"add": add}
    return {name: replace(scene, **fields) for name, fields in changes.items()}


def redone(scene, usual):
    """Recordings of a changed scene from the draws of the `usual` recordings.

    Its labels are theirs, also where another arm no longer moves an object.
    """
    attempts = {r.meta["trial"]: r.meta["simulation"]["redrawn"] for r in usual}
    specs = []
    for spec in chain.from_iterable(batches_of(scene)):
        trial = file_name(scene, spec).removesuffix(".npz")
        specs.append(replace(spec, attempt=attempts[trial]))
    return [r for _, r in recordings(run_physics(scene, tuple(specs)))]


def decisions(model, recordings):
    """A row for each decision on recordings, with the number of the touch and its true
    label; a touch that is not felt has none."""
    classifier = Classifier(model)
    rows = []
    for touch, recording in enumerate(recordings):
        for event in classifier.classify(recording):
            if isinstance(event, Decided):
                rows.append(
                    (*vars(event).values(), touch, recording.labels[event.task])
                )
    return pd.DataFrame(rows, columns=[*Decided.__annotations__, "touch", "truth"])


def answers(model, recordings):
    """{task: a row for each answer to touches}: whether it is right; whether it
    is in doubt, by a flag or as it is less likely right than wrong; whether it is
    sure, without a flag and with a high confidence."""
    rows = decisions(model, recordings)
    likely = rows["confidence"].astype(float)
    flagged = rows["flags"].map(len) > 0
    rows["right"] = rows["label"] == rows["truth"]
    rows["doubtful"] = flagged | ~(likely >= UNSURE)
    rows["sure"] = ~flagged & (likely >= SURE)
    return {task: rows[rows["task"] == task] for task in model.info.tasks}


def fresh_touches(scene):
    """Recordings of a scene's trials."""
    return [recording for _, recording in simulate(scene)]


def share(facts):
    """The share of facts (n,) that hold; 0 of none."""
    return facts.sum() / max(len(facts), 1)


def trusted(judged):
    """The share of the answers without a doubt that are right."""
    return share(judged["right"][~judged["doubtful"]])


def is_told(judged, usual):
    """Whether most touches are in doubt, or the answers without a doubt are right about
    as often as the `usual` ones."""
    return share(judged["doubtful"]) >= ENOUGH or trusted(judged) >= usual - WORSE


def row(name, task, judged, usual):
    """The row of a shift and a task, beside the accuracy on usual touches."""
    plain = "-" if judged["doubtful"].all() else f"{trusted(judged):.0%}"
    return {
        "shift": name,
        "task": task,
        "answers": len(judged),
        "right": f"{share(judged['right']):.0%}",
        "in doubt": f"{share(judged['doubtful']):.0%}",
        "right without doubt": plain,
        "wrong and sure": (judged["sure"] & ~judged["right"]).sum(),
        "held": "yes" if is_told(judged, usual) else "no",
    }


def measure(model, trials):
    """Measure, and write the table."""
    loaded = Model(model)
    scene = scenes.load(SCENE, seed=FRESH_SEED, count=trials)
    fresh = fresh_touches(scene)
    cases = {name: partial(map, shift, fresh) for name, shift in SHIFTS.items()}
    for name, changed in scene_changes(scene).items():
        cases[name] = partial(redone, changed, fresh)
    rows = []
    usual = {}
    for name, shifted in bar(cases.items(), desc="shifts", total=len(cases)):
        for task, judged in answers(loaded, shifted()).items():
            accuracy = usual.setdefault(task, trusted(judged))
            rows.append(row(name, task, judged, accuracy))
    tables.write("shifts", [rows], "make shifts")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--model", Path, "model.onnx"),
        ("--trials", 5, "of each object"),
    )
