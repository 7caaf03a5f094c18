"""`make shifts`: do answers on touches unlike the training carry a doubt?

A model is exported from a simulated set. Fresh touches of the same objects are changed
as a robot's life changes them: taxels die or stick, counts double, a sleeve is put on,
the skin turns on the arm, frames are lost or repeated, joint angles freeze. The board's
own classifier decides on them. A wrong answer is one in doubt if it has a flag, or a
confidence below one half; it is sure if it has neither and a confidence of 95 % or more.

"held" says whether a shift is told at least as the user was promised: most of its
touches are in doubt, or the answers without a doubt are right about as often as those
on touches that are not shifted.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from edge.classifier import Classifier
from edge.events import Decided
from edge.model.model import Model
from edge.recording import Recording
from tests.bench import tables
from train.progress import bar
from train.simulate import scene as scenes
from train.simulate.run import simulate

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "train" / "scenes" / "cody18.toml"
FRESH_SEED = 77
ENOUGH = 0.6
"""Share of a shift's touches that are in doubt, at the least."""
WORSE = 0.05
"""By so much the answers without a doubt may be worse than those on usual touches."""
UNSURE = 0.5
SURE = 0.95
Shift = Callable[[Recording], Recording]


def counts(change: Callable[[np.ndarray], np.ndarray]) -> Shift:
    """A change of the counts (frames, rows, cols), which stay within 16 bits."""

    def shift(recording: Recording) -> Recording:
        changed = np.rint(change(recording.frames.astype(np.float64)))
        return replace(recording, frames=np.clip(changed, 0, 65535).astype(np.uint16))

    return shift


def joints(change: Callable[[np.ndarray], np.ndarray]) -> Shift:
    """A change of the joint angles (frames, dof)."""
    return lambda recording: replace(recording, joints=change(recording.joints))


def half_dead(frames: np.ndarray) -> np.ndarray:
    alive = np.random.default_rng(5).random(frames.shape[1:]) < 0.5
    return frames * alive


def stuck(frames: np.ndarray) -> np.ndarray:
    frames = frames.copy()
    frames[:, 3, 5] = 2000.0
    return frames


def late(recording: Recording) -> Recording:
    """Two of three frames are lost."""
    kept = slice(None, None, 3)
    return replace(
        recording,
        t=recording.t[kept],
        frames=recording.frames[kept],
        joints=recording.joints[kept],
    )


def touched_from(recording: Recording) -> int:
    """The first frame with a taxel above the onset."""
    return int((recording.frames.max(axis=(1, 2)) > recording.layout.onset).argmax())


def paused(recording: Recording) -> Recording:
    """A quarter of a second without frames, a tenth after the touch began."""
    t = recording.t.copy()
    t[touched_from(recording) + 10 :] += 0.25
    return replace(recording, t=t)


def frozen(recording: Recording) -> Recording:
    """The frames of the touch repeat its tenth."""
    frames = recording.frames.copy()
    first = touched_from(recording) + 10
    frames[first:] = frames[first]
    return replace(recording, frames=frames)


def slower(recording: Recording) -> Recording:
    """All at half of the speed, at the same rate."""
    t = recording.t
    times = np.linspace(t[0], t[-1], 2 * len(t) - 1)
    places = np.searchsorted(t, times + 1e-9, side="right") - 1
    return replace(
        recording,
        t=2.0 * times,
        frames=recording.frames[places],
        joints=np.column_stack([np.interp(times, t, q) for q in recording.joints.T]),
    )


SHIFTS: Mapping[str, Shift] = {
    "none": lambda recording: recording,
    "two of three frames lost": late,
    "half of the taxels dead": counts(half_dead),
    "counts doubled": counts(lambda frames: 2.0 * frames),
    "counts tenfold": counts(lambda frames: 10.0 * frames),
    "a tenth of the counts": counts(lambda frames: 0.1 * frames),
    "60 counts on all taxels": counts(lambda frames: frames + 60.0),
    "a sleeve: 100 counts less": counts(lambda frames: frames - 100.0),
    "half of the speed": slower,
    "skin one column round": counts(lambda frames: np.roll(frames, 1, axis=2)),
    "skin a quarter round": counts(lambda frames: np.roll(frames, 6, axis=2)),
    "skin upside down": counts(lambda frames: frames[:, ::-1]),
    "a taxel stuck at 2,000": counts(stuck),
    "a pause of 0.25 s": paused,
    "frozen frames": frozen,
    "joint angles constant": joints(lambda q: np.repeat(q[:1], len(q), axis=0)),
    "joint angles of the other sign": joints(lambda q: -q),
    "joints in reversed order": joints(lambda q: q[:, ::-1].copy()),
}


@dataclass(frozen=True)
class Answer:
    """An answer to a task, judged.

    Attributes:
        right: the label is the recording's.
        doubtful: it has a flag, or is less likely right than wrong.
        sure: it has no flag and a high confidence.
    """

    right: bool
    doubtful: bool
    sure: bool


def answers(
    model: Model, recordings: Sequence[Recording], shift: Shift
) -> dict[str, list[Answer]]:
    """{task: the answers to shifted touches}; a touch that is not felt has none."""
    judged: dict[str, list[Answer]] = {task: [] for task in model.info.tasks}
    classifier = Classifier(model)
    for recording in recordings:
        for event in classifier.classify(shift(recording)):
            if isinstance(event, Decided):
                likely = event.confidence or 0.0
                doubtful = bool(event.flags) or likely < UNSURE
                judged[event.task].append(
                    Answer(
                        right=event.label == recording.labels[event.task],
                        doubtful=doubtful,
                        sure=not doubtful and likely >= SURE,
                    )
                )
    return judged


def share(facts: Sequence[bool]) -> float:
    """The share that is true; 0 of none."""
    return sum(facts) / len(facts) if facts else 0.0


def row(
    name: str, task: str, judged: Sequence[Answer], usual: float
) -> dict[str, object]:
    """The row of a shift and a task, beside the accuracy on usual touches."""
    plain = [answer.right for answer in judged if not answer.doubtful]
    doubt = share([answer.doubtful for answer in judged])
    trusted = share(plain)
    held = doubt >= ENOUGH or trusted >= usual - WORSE
    return {
        "shift": name,
        "task": task,
        "answers": len(judged),
        "right": f"{share([answer.right for answer in judged]):.0%}",
        "in doubt": f"{doubt:.0%}",
        "right without doubt": f"{trusted:.0%}" if plain else "-",
        "wrong and sure": sum(a.sure and not a.right for a in judged),
        "held": "yes" if held else "no",
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, and write the table."""
    parser = argparse.ArgumentParser(prog="shifts", description=__doc__)
    parser.add_argument("--model", type=Path, required=True, help="model.onnx")
    parser.add_argument("--trials", type=int, default=5, help="of each object")
    arguments = parser.parse_args(argv)
    model = Model(arguments.model)
    scene = scenes.load(SCENE, seed=FRESH_SEED, count=arguments.trials)
    fresh = [recording for _, recording in simulate(scene)]
    rows = []
    usual: dict[str, float] = {}
    for name, shift in bar(SHIFTS.items(), desc="shifts", total=len(SHIFTS)):
        for task, judged in answers(model, fresh, shift).items():
            accuracy = share([a.right for a in judged if not a.doubtful])
            rows.append(row(name, task, judged, usual.setdefault(task, accuracy)))
    tables.write("shifts", [rows], "make shifts")
    return 0


if __name__ == "__main__":
    sys.exit(main())
