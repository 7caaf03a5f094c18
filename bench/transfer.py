"""Does a model trained on a simulated scene hold in another engine? `make transfer`.

MuJoCo makes trials of the paper's kind with parameters of its own, written as recordings, and the
model is scored on them. They are a test: nothing in train/ reads them, and nothing may be tuned
to one set of them; `--seed` makes another.

How MuJoCo makes them is in `bench/mujoco_touch.py`.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from tqdm import tqdm

import edge
from bench.mujoco_touch import ONSET_COUNTS, PLACE_M, RATE_HZ, Thing, Touch, Touched, simulate
from edge.errors import InputError
from edge.recording import load, save
from train.crossval import jobs_here
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
EACH = 6
"""Trials of an object, every other one fixed."""
SLIDES_M, WINDOW_S = 0.02, 1.2
"""What is called movable has moved so far by then, as in the scenes and in the paper."""
DRAWS = 50
FALSE_ALARMS = (0.02, 0.05, 0.1)


def draw_object(rng: np.random.Generator) -> Thing:
    """One object's properties, from ranges that are no scene's of train/."""
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
    """How a hand puts it before the arm."""
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
    """`count` trials, six an object, into a folder; and how many objects were drawn again
    because a trial that is called movable had not moved.

    Raises:
        InputError: no object could be drawn that moves.
    """
    folder.mkdir(parents=True, exist_ok=True)
    objects = [range(first, min(first + EACH, count)) for first in range(0, count, EACH)]
    work = (delayed(_touch_object)(folder, i, numbers, seed) for i, numbers in enumerate(objects))
    done = Parallel(n_jobs=jobs_here(), return_as="generator")(work)
    bar = tqdm(done, total=len(objects), unit=" objects", desc="MuJoCo")
    parts = list(bar)
    return [path for paths, _ in parts for path in paths], sum(again for _, again in parts)


def _touch_object(folder: Path, index: int, numbers: range, seed: int) -> tuple[list[Path], int]:
    """The trials of one object, but for those that an earlier run has made."""
    found = sorted(folder.glob(f"*-{index:02d}-*.npz"))
    if len(found) == len(numbers):
        return found, 0
    for attempt in range(DRAWS):
        thing = draw_object(streams.stream(seed, f"object.{attempt}", "transfer", index))
        done: list[tuple[Path, Touched]] = []
        for number in sorted(numbers, key=lambda n: n % 2 == 0):
            rng = streams.stream(seed, f"trial.{attempt}", "transfer", number)
            touched = simulate(draw_touch(thing, number % 2 == 0, rng))
            if number % 2 == 1 and moved(touched) < SLIDES_M:
                break
            condition = touched.recording.labels["mobility"]
            done.append(
                (folder / f"{thing.kind}-{index:02d}-{condition}-{number:03d}.npz", touched)
            )
        else:
            for path, touched in done:
                save(path, touched.recording)
            return [path for path, _ in done], attempt
    raise InputError(f"transfer: object {index} was drawn {DRAWS} times and never moved")


def interval(right: int, count: int) -> tuple[float, float]:
    """95 % of the share `right / count` (Wilson)."""
    p, z = right / count, 1.96
    centre = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return centre - half, centre + half


def score(model: edge.Model, paths: list[Path]) -> dict[str, list[tuple[str, str]]]:
    """{task: (true, decided) of each trial}; a contact that was never decided counts as wrong."""
    answers: dict[str, list[tuple[str, str]]] = {
        task: [] for task in TASKS if task in model.info.tasks
    }
    for path in paths:
        recording = load(path)
        decided: dict[str, str] = {}
        for event in edge.Classifier(model).classify(recording):
            if isinstance(event, edge.Decided) and event.task not in decided:
                decided[event.task] = str(event.label)
        for task, pairs in answers.items():
            pairs.append((recording.labels[task], decided.get(task, "no decision")))
    return answers


def unknown(model: edge.Model, paths: list[Path]) -> list[str]:
    """How many of the trials a model calls unknown, at each rate of false alarms."""
    novelty = model.info.novelty
    if novelty is None:
        return ["the model has no decision points, and so calls nothing unknown"]
    rates = []
    for path in paths:
        for event in edge.Classifier(model).classify(load(path)):
            if isinstance(event, edge.Decided) and event.task == novelty.task and event.decision:
                distance = float(event.decision.distances[0])
                rates.append(novelty.rate(len(novelty.limits) - 1, distance))
    lines = ["called unknown, where so many trained contacts would be:"]
    for false in FALSE_ALARMS:
        count = sum(rate <= false for rate in rates)
        low, high = interval(count, len(rates))
        share = f"{100 * count / len(rates):6.1f} %  ({100 * low:.0f} to {100 * high:.0f})"
        lines.append(f"{100 * false:>8.0f} %{share}")
    return lines


def report(answers: dict[str, list[tuple[str, str]]]) -> str:
    """Accuracies with intervals, and the confusion of categories."""
    lines = []
    for task, pairs in answers.items():
        right = sum(a == b for a, b in pairs)
        low, high = interval(right, len(pairs))
        lines.append(
            f"{task:<10}{100 * right / len(pairs):6.1f} %  ({100 * low:.0f} to {100 * high:.0f}, "
            f"{len(pairs)} trials)"
        )
    for task, pairs in answers.items():
        seen = Counter(pairs)
        names = sorted({name for pair in pairs for name in pair})
        lines += ["", f"{task}: true in rows, decided in columns"]
        lines.append(" " * 16 + "".join(f"{n[:14]:>15}" for n in names))
        lines += [
            f"{a:<16}" + "".join(f"{seen[a, b]:>15}" for b in names)
            for a in names
            if any(seen[a, b] for b in names)
        ]
    return "\n".join(lines)


def draw_curves(ours: list[Path], theirs: list[Path], out: Path) -> None:
    """The paper's features over time, both engines side by side, one line a category."""
    from matplotlib.figure import Figure

    from train.dataset import load_trials

    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey="col")
    for row, (name, paths) in enumerate((("our simulator", ours), ("MuJoCo", theirs))):
        data = load_trials([str(p) for p in paths])
        x, labels = data.features(), data.labels("category")
        t = np.linspace(0.0, 1.2, x.shape[1] // 3)
        for category in sorted(set(labels)):
            mean = np.median(x[labels == category], axis=0).reshape(3, -1)
            low, high = (
                np.quantile(x[labels == category], q, axis=0).reshape(3, -1) for q in (0.25, 0.75)
            )
            for axis, m, a, b in zip(axes[row], mean, low, high, strict=True):
                (line,) = axis.plot(t, m, label=category)
                axis.fill_between(t, a, b, color=line.get_color(), alpha=0.15)
        for axis, what in zip(
            axes[row], ("largest force, N", "area, taxels", "motion, m"), strict=True
        ):
            axis.set_ylabel(what)
            axis.set_title(f"{name}")
    for axis in axes[1]:
        axis.set_xlabel("seconds from onset")
    axes[0, 0].legend(fontsize=8)
    figure.suptitle("Median and middle half of the features, by category")
    figure.savefig(out, dpi=110)


def main(arguments: list[str] | None = None) -> int:
    """Make the trials, score the model on them, print and draw."""
    parser = argparse.ArgumentParser(prog="bench.transfer", description=__doc__.split("\n\n")[0])
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("build/transfer"))
    parser.add_argument("--trials", type=int, default=120)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--ours", type=Path, help="folder of simulated trials to draw beside")
    options = parser.parse_args(arguments)
    try:
        paths, again = make_trials(
            options.out / f"seed{options.seed}", options.trials, options.seed
        )
        model = edge.Model(options.model)
        text = "\n".join([report(score(model, paths)), "", *unknown(model, paths)])
    except InputError as error:
        print(f"transfer: {error}", file=sys.stderr)
        return 2
    text += f"\n\n{again} objects were drawn again: called movable, and did not move"
    print(text)
    (options.out / "transfer.txt").write_text(text + "\n")
    if options.ours is not None:
        draw_curves(sorted(options.ours.glob("*.npz")), paths, options.out / "curves.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
