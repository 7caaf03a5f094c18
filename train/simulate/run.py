"""Recordings of a scene's trials."""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from edge.record import saving
from edge.record.recording import Recording
from edge.writing import check_writable
from train.simulate.arm import Array, Places
from train.simulate.engine import PhysicsRun, batch_size, readings
from train.simulate.plan import kinds
from train.simulate.readings import Readings
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import FAMILIES
from train.simulate.truth import true_runs


@dataclass(frozen=True)
class Written:
    """The files that `write` has made.

    Attributes:
        paths: the files.
        redrawn: {reason: number of trials that were drawn again for it at first}.
        unfelt: number of trials in which no taxel rises above the skin's onset.
    """

    paths: list[Path]
    redrawn: dict[str, int]
    unfelt: int


def file_name(scene: Scene, trial: TrialSpec) -> str:
    """The file name of a trial's recording."""
    return f"{trial.key}-{trial.number:0{len(str(max(scene.count - 1, 10)))}d}.npz"


def recordings(
    physics: PhysicsRun,
    which: Places | None = None,
) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a run, or of some; arguments as of
    `readings`."""
    for reading in readings(physics, which):
        frames = slice(None) if reading.arrives is None else reading.arrives
        t = reading.t if reading.times is None else reading.times
        shear = reading.shear()
        file = file_name(reading.scene, reading.trial)
        yield (
            file,
            Recording(
                t=t[frames],
                frames=reading.frames()[frames],
                joints=reading.joints[frames],
                valid=reading.valid,
                meta=_meta(reading, physics.trials.values, Path(file).stem),
                shear=None if shear is None else shear[frames],
            ),
        )


def _meta(reading: Readings, values: dict[str, Array], name: str) -> dict[str, Any]:
    """The metadata of a trial's recording, with the values of its batch."""
    scene = reading.scene
    trial = reading.trial
    soft = "soft" if FAMILIES[trial.object.family].thickness else "rigid"
    of_trial = {key: float(numbers[reading.which]) for key, numbers in values.items()}
    return {
        "labels": {
            "category": f"{soft}-{trial.condition}",
            "mobility": trial.condition,
            "softness": soft,
            "object": trial.object.name,
        },
        "skin": scene.skin.to_dict(),
        "arm": scene.arm.to_dict(),
        "source": f"simulated: {scene.name}",
        "trial": name,
        "simulation": {
            "seed": scene.seed,
            "step_s": trial.step_s,
            "family": trial.object.family,
            "redrawn": trial.attempt,
            "effects": list(reading.effects),
            "values": {k: v for k, v in of_trial.items() if math.isfinite(v)},
        },
    }


def simulate_trials(
    scene: Scene, specs: tuple[TrialSpec, ...]
) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of trials, each drawn until it fits its label."""
    for run in true_runs(scene, specs):
        yield from recordings(run.physics, run.which)


def batches_of(scene: Scene) -> list[tuple[TrialSpec, ...]]:
    """Batches of the scene's trials, of about equal work."""
    specs = list(chain.from_iterable(kinds(scene).values()))
    count = math.ceil(len(specs) / batch_size(scene))
    return [tuple(specs[i::count]) for i in range(count)]


def simulate(scene: Scene) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a scene, simulated in this process."""
    for specs in batches_of(scene):
        yield from simulate_trials(scene, specs)


def write(
    scene: Scene,
    folder: str | Path,
    *,
    progress: Callable[[int], Any] = lambda count: None,
) -> Written:
    """Write the recordings of a scene into a folder.

    The files' bytes depend on the scene and its seed alone.

    Args:
        progress: called with the number of trials just written.

    Raises:
        InputError: a file cannot be written.
    """
    target = Path(folder)
    check_writable(target)
    paths = []
    redrawn: Counter[str] = Counter()
    unfelt = 0
    for run in chain.from_iterable(
        true_runs(scene, specs) for specs in batches_of(scene)
    ):
        redrawn.update(run.redrawn)
        for name, trial in recordings(run.physics, run.which):
            saving.save(target / name, trial, lasting=False)
            paths.append(target / name)
            unfelt += trial.frames.max(initial=0) <= scene.skin.onset
            progress(1)
    return Written(sorted(paths), dict(redrawn), int(unfelt))


def total_trials(scene: Scene) -> int:
    """The number of a scene's trials."""
    return scene.count * len(scene.kinds)
