"""Recordings of a scene's trials, made on this machine's cores or on a Dask cluster."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from os import cpu_count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge import recording
from edge.errors import InputError
from edge.recording import Recording
from train.cluster import on_cluster
from train.simulate.convergence import Convergence, measure
from train.simulate.engine import PhysicsRun, begin, readings
from train.simulate.plan import required_effects
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import FAMILIES
from train.simulate.truth import true_runs

BATCH = 400
"""Most trials simulated side by side. Larger batches save little, as their arrays no longer fit
into a processor's cache; each trial takes about 0.4 MB of memory."""


@dataclass(frozen=True)
class Simulated:
    """A simulated trial.

    Attributes:
        name: the name of its file.
        redrawn: how often it was drawn again.
        felt: whether a taxel rises above the skin's onset.
        recording: the recording, or None once it has been written.
    """

    name: str
    redrawn: int
    felt: bool
    recording: Recording | None


@dataclass(frozen=True)
class Written:
    """The files that `write` has made.

    Attributes:
        paths: the files.
        redrawn: number of trials that were drawn again.
        unfelt: number of trials in which no taxel rises above the skin's onset.
        rough: {the first object and condition of a kind: the error of its step, as a part of the
            peak force} where the step was measured and none is within the scene's tolerance.
    """

    paths: list[Path]
    redrawn: int
    unfelt: int
    rough: dict[str, float]


Kind = tuple[str, ...]
"""The effects that trials call for, which name a kind of trials."""


def kinds(scene: Scene) -> dict[Kind, list[TrialSpec]]:
    """{effects: the trials that call for them}, at the steps that the scene gives.

    A kind's step is the smallest that `step_s` gives its effects, or a frame where it is empty.
    """
    out: dict[Kind, list[TrialSpec]] = {}
    for item in scene.objects:
        for condition in item.conditions:
            effects = tuple(required_effects(scene, item, condition))
            given = [scene.step_s[name] for name in ("base", *effects) if name in scene.step_s]
            step_s = min(given, default=1.0 / scene.trials["rate_hz"])
            trials = out.setdefault(effects, [])
            trials += [TrialSpec(item, condition, k, step_s) for k in range(scene.count)]
    return out


def measured(scene: Scene) -> dict[Kind, Convergence]:
    """{kind: the errors of the steps tried}; empty where the scene gives its steps.

    Raises:
        InputError: an object touches the arm from the start. This is checked before anything else.
    """
    if scene.step_s:
        return {}
    every = kinds(scene)
    begin(scene, tuple(spec for specs in every.values() for spec in specs))
    return dict(zip(every, measure(scene, list(every.values())), strict=True))


def file_name(scene: Scene, trial: TrialSpec) -> str:
    """The file name of a trial's recording."""
    return f"{trial.key}-{trial.number:0{len(str(max(scene.count - 1, 10)))}d}.npz"


def recordings(
    physics: PhysicsRun,
    which: NDArray[np.intp] | None = None,
    scene: Scene | None = None,
) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a run, or of some; arguments as of `readings`."""
    trials = physics.trials
    scene = scene or trials.scene
    arm, skin = scene.arm.to_dict(), scene.skin.to_dict()
    values = {name: value.tolist() for name, value in trials.values.items()}
    for seen in readings(physics, which, scene):
        trial, kept = seen.trial, slice(None) if seen.kept is None else seen.kept
        t = seen.t if seen.times is None else seen.times
        drawn = {name: value[seen.which] for name, value in values.items()}
        soft = "soft" if FAMILIES[trial.object.family].thickness else "rigid"
        file = file_name(scene, trial)
        meta: dict[str, Any] = {
            "labels": {
                "category": f"{soft}-{trial.condition}",
                "mobility": trial.condition,
                "softness": soft,
                "object": trial.object.name,
            },
            "skin": skin,
            "arm": arm,
            "source": f"simulated: {scene.name}",
            "trial": file.removesuffix(".npz"),
            "simulation": {
                "seed": scene.seed,
                "step_s": trial.step_s,
                "family": trial.object.family,
                "redrawn": trial.attempt,
                "effects": list(seen.effects),
                "values": {k: v for k, v in drawn.items() if math.isfinite(v)},
            },
        }
        frames, joints = seen.frames()[kept], seen.joints[kept]
        yield file, Recording(t=t[kept], frames=frames, joints=joints, valid=seen.valid, meta=meta)


def simulate_trials(scene: Scene, specs: tuple[TrialSpec, ...]) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of trials, each drawn until it fits its label."""
    for physics, true in true_runs(scene, specs):
        yield from recordings(physics, true)


def simulate_part(
    scene: Scene, specs: tuple[TrialSpec, ...], folder: str | None
) -> list[Simulated]:
    """Simulated trials, written to `folder`; with their recordings if that is None."""
    out: list[Simulated] = []
    for name, trial in simulate_trials(scene, specs):
        if folder is not None:
            recording.save(f"{folder}/{name}", trial, lasting=False)
        redrawn = int(trial.meta["simulation"]["redrawn"])
        felt = bool(trial.frames.max(initial=0) > scene.skin.onset)
        out.append(Simulated(name, redrawn, felt, trial if folder is None else None))
    return out


def parts(
    scene: Scene,
    batch: int = BATCH,
    convergences: dict[Kind, Convergence] | None = None,
    jobs: int = 1,
) -> list[tuple[TrialSpec, ...]]:
    """Batches of the scene's trials, of about equal work.

    Args:
        batch: most trials in each.
        convergences: the measured steps of a scene that gives none, as of `measured`.
        jobs: least number of batches, if there are as many trials.
    """
    if batch < 1:
        raise InputError(f"--batch must be at least 1, not {batch}")
    if convergences is None:
        convergences = measured(scene)
    every = [
        replace(spec, step_s=convergences[kind].step_s) if kind in convergences else spec
        for kind, specs in kinds(scene).items()
        for spec in specs
    ]
    count = min(max(-(-len(every) // batch), jobs), len(every))
    return [tuple(every[i::count]) for i in range(count)]


def simulate(scene: Scene, batch: int = BATCH) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a scene, simulated in this process."""
    for specs in parts(scene, batch):
        yield from simulate_trials(scene, specs)


def write(
    scene: Scene,
    folder: str | Path,
    *,
    batch: int = BATCH,
    jobs: int = 1,
    backend: str = "local",
    address: str | None = None,
    progress: Callable[[int], Any] = lambda done: None,
) -> Written:
    """Write the recordings of a scene into a folder.

    The files' bytes depend on the scene and its seed alone.

    Args:
        batch: most trials simulated side by side.
        jobs: processes on this machine (joblib).
        backend: `local`, or `dask` where the scheduler at `address` runs the batches and sends
            the recordings back.
        progress: called with the number of trials just written.

    Raises:
        InputError: a file cannot be written, or there is no scheduler at `address`.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{target}: the folder cannot be made: {error.strerror or error}"
        ) from None
    if backend not in ("local", "dask"):
        raise InputError(f"--backend must be local or dask, not {backend!r}")
    convergences = measured(scene)
    work = parts(scene, batch, convergences, jobs if jobs > 0 else cpu_count() or 1)
    made: list[Simulated] = []
    for part in _simulated(scene, work, str(target), jobs, backend, address):
        for trial in part:
            if trial.recording is not None:
                recording.save(target / trial.name, trial.recording, lasting=False)
            made.append(replace(trial, recording=None))
        progress(len(part))
    return Written(
        paths=[target / name for name in sorted(trial.name for trial in made)],
        redrawn=sum(1 for trial in made if trial.redrawn),
        unfelt=sum(1 for trial in made if not trial.felt),
        rough={
            kinds(scene)[kind][0].key: convergence.error
            for kind, convergence in convergences.items()
            if not convergence.within
        },
    )


def _simulated(
    scene: Scene,
    work: list[tuple[TrialSpec, ...]],
    folder: str,
    jobs: int,
    backend: str,
    address: str | None,
) -> Iterator[list[Simulated]]:
    """Each batch once it is simulated; those from a cluster have not been written yet."""
    if backend == "local" and jobs == 1:
        yield from (simulate_part(scene, specs, folder) for specs in work)
        return
    from joblib import Parallel, delayed

    remote = backend == "dask"
    with on_cluster(address) if remote else nullcontext():
        run = Parallel(n_jobs=-1 if remote else jobs, return_as="generator_unordered")
        call, place = delayed(simulate_part), None if remote else folder
        yield from run(call(scene, specs, place) for specs in work)


def total_trials(scene: Scene) -> int:
    """The number of a scene's trials."""
    return scene.count * sum(len(item.conditions) for item in scene.objects)
