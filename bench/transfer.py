"""`make transfer`: does a model trained on a simulated scene hold in another physics engine?

MuJoCo makes trials of the paper's kind with parameters of its own (`bench/mujoco_touch.py`), and
the model is scored on them. They are a test set: nothing in train/ reads them, and nothing may be
tuned to one set of them; `--seed` makes another.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from joblib import Parallel, cpu_count, delayed

import edge
from bench.mujoco_touch import ONSET_COUNTS, PLACE_M, RATE_HZ, Thing, Touch, Touched, simulate
from edge.commands.summary import wilson
from edge.errors import InputError
from edge.recording import load, save
from train.progress import bar
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
EACH = 6
"""Trials of each object; every other trial is fixed."""
SLIDES_M, WINDOW_S = 0.02, 1.2
"""A movable object has moved this far by the end of the window, as in the scenes and the paper."""
DRAWS = 50
FALSE_ALARMS = (0.02, 0.05, 0.1)


def draw_object(rng: np.random.Generator) -> Thing:
    """One object's properties, from other ranges than those of any scene in train/."""
    kind = str(rng.choice(["box", "drum", "foam", "cushion", "plant", "bale"]))
    soft = {"foam": (3e3, 18e3), "cushion": (1.2e3, 5e3), "bale": (5e3, 12e3)}

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    return Thing(
        kind=kind,
        mass_kg=between(0.25, 2.2),
        floor=float(rng.uniform(0.25, 0.6)),
        skin=float(rng.uniform(0.25, 0.65)),
        height_m=float(rng.uniform(0.12, 0.45)),
        breadth_m=float(rng.uniform(0.06, 0.4)),
        stems=int(rng.integers(5, 12)),
        stem_n_m=between(3.0, 25.0),
        thick_m=float(rng.uniform(0.06, 0.16)),
        modulus_pa=between(*soft.get(kind, (1.0, 2.0))),
        seed=int(rng.integers(2**31)),
    )


def draw_touch(thing: Thing, fixed: bool, rng: np.random.Generator) -> Touch:
    """One touch: how the object stands before the arm, and how the arm begins."""
    return Touch(
        thing=thing,
        fixed=fixed,
        start_rad=tuple(np.radians(rng.normal(0.0, (0.5, 1.0, 1.0, 3.0, 3.0)))),
        place_m=PLACE_M + float(rng.normal(0.0, 0.015)),
        aside_m=float(rng.normal(0.0, 0.01)),
        yaw_rad=float(rng.normal(0.0, 0.03)),
        slope_rad=math.radians(rng.normal(0.0, 0.7)),
        taxel_n_m=float(np.exp(rng.uniform(np.log(5e3), np.log(1.5e4)))),
        noise=(6.0, rng),
    )


def moved(touched: Touched) -> float:
    """Metres that the thing has moved at the end of the window."""
    onset = int(np.argmax(touched.recording.frames.max(axis=(1, 2)) > ONSET_COUNTS))
    last = min(onset + round(WINDOW_S * RATE_HZ), len(touched.moved_m) - 1)
    return float(touched.moved_m[last])


def make_trials(folder: Path, count: int, seed: int) -> tuple[list[Path], int]:
    """`count` recordings, six of each object, and how many objects had to be drawn again.

    An object is drawn again where a trial that is called movable did not move. Recordings that an
    earlier run has made are used again.

    Raises:
        InputError: an object did not move, however often it was drawn.
    """
    folder.mkdir(parents=True, exist_ok=True)
    objects = [range(first, min(first + EACH, count)) for first in range(0, count, EACH)]
    work = (delayed(_touch_object)(folder, i, numbers, seed) for i, numbers in enumerate(objects))
    done = Parallel(n_jobs=cpu_count(), return_as="generator")(work)
    made = list(bar(done, total=len(objects), unit=" objects", desc="MuJoCo"))
    return [path for paths, _ in made for path in paths], sum(again for _, again in made)


def _touch_object(folder: Path, index: int, numbers: range, seed: int) -> tuple[list[Path], int]:
    """The recordings of one object, and how often it was drawn again."""
    earlier = sorted(folder.glob(f"*-{index:02d}-*.npz"))
    if len(earlier) == len(numbers):
        return earlier, 0
    for attempt in range(DRAWS):
        thing = draw_object(streams.stream(seed, f"object.{attempt}", "transfer", index))
        touches: dict[Path, Touched] = {}
        for number in sorted(numbers, key=lambda n: n % 2 == 0):
            rng = streams.stream(seed, f"trial.{attempt}", "transfer", number)
            touched = simulate(draw_touch(thing, number % 2 == 0, rng))
            if number % 2 == 1 and moved(touched) < SLIDES_M:
                break
            condition = touched.recording.labels["mobility"]
            name = f"{thing.kind}-{index:02d}-{condition}-{number:03d}.npz"
            touches[folder / name] = touched
        else:
            for path, touched in touches.items():
                save(path, touched.recording)
            return list(touches), attempt
    raise InputError(f"transfer: object {index} was drawn {DRAWS} times and never moved")


def decide(
    model: edge.Model, paths: list[Path]
) -> tuple[dict[str, list[tuple[str, str]]], list[float]]:
    """({task: (true, decided) of each trial}, rate of false alarms at which each is unknown).

    A contact without a decision counts as wrong. The rates are empty where the model has no
    decision points, and so calls nothing unknown.
    """
    answers: dict[str, list[tuple[str, str]]] = {t: [] for t in TASKS if t in model.info.tasks}
    novelty, rates = model.info.novelty, []
    for path in paths:
        recording = load(path)
        decided: dict[str, str] = {}
        for event in edge.Classifier(model).classify(recording):
            if not isinstance(event, edge.Decided) or event.task in decided:
                continue
            decided[event.task] = str(event.label)
            if novelty is not None and event.task == novelty.task and event.decision:
                distance = float(event.decision.distances[0])
                rates.append(novelty.rate(len(novelty.limits) - 1, distance))
        for task, pairs in answers.items():
            pairs.append((recording.labels[task], decided.get(task, "no decision")))
    return answers, rates


def share(count: int, total: int) -> str:
    """A percentage with its 95 % interval."""
    low, high = wilson(count, total)
    return f"{100 * count / total:6.1f} %  ({100 * low:.0f} to {100 * high:.0f})"


def report(answers: dict[str, list[tuple[str, str]]], rates: list[float]) -> str:
    """Accuracies, shares called unknown, and the confusion of each task."""
    lines = []
    for task, pairs in answers.items():
        right = sum(true == decided for true, decided in pairs)
        lines.append(f"{task:<10}{share(right, len(pairs))} of {len(pairs)} trials")
    for alarms in FALSE_ALARMS if rates else ():
        count = sum(rate <= alarms for rate in rates)
        lines.append(f"unknown   {share(count, len(rates))} at {alarms:.0%} false alarms")
    for task, pairs in answers.items():
        counts = Counter(pairs)
        names = sorted({name for pair in pairs for name in pair})
        lines += ["", f"{task}: true in rows, decided in columns"]
        lines.append(" " * 16 + "".join(f"{name[:14]:>15}" for name in names))
        for true in sorted({true for true, _ in pairs}):
            lines.append(f"{true:<16}" + "".join(f"{counts[true, name]:>15}" for name in names))
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Make the trials, score the model on them and print."""
    parser = argparse.ArgumentParser(prog="bench.transfer", description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("build/transfer"))
    parser.add_argument("--trials", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    try:
        paths, again = make_trials(
            options.out / f"seed{options.seed}", options.trials, options.seed
        )
        model = edge.Model(options.model)
        text = report(*decide(model, paths))
    except InputError as error:
        print(f"transfer: {error}", file=sys.stderr)
        return 2
    text += f"\n\n{again} objects drawn again, because a movable one did not move"
    print(text)
    (options.out / "transfer.txt").write_text(text + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
