"""A scene's trials in batches: on this machine, on several cores, or on a Dask cluster."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge import recording
from edge.errors import InputError
from edge.recording import Recording
from train.cluster import on_cluster
from train.simulate.assemble import make_plan
from train.simulate.convergence import Convergence, measure
from train.simulate.engine import (
    Kind,
    PhysicsRun,
    begin,
    check_start,
    kind_of,
    readings,
    values_of,
)
from train.simulate.plan import Plan
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SOFT_FAMILIES
from train.simulate.truth import true_runs

BATCH = 256
"""Trials in a batch: enough to spread numpy's cost a call, few enough to stay in the cache."""


@dataclass(frozen=True)
class Simulated:
    """One trial's recording: its file's name, how often it was drawn again, whether a taxel rises
    above the skin's onset, and itself where it has not been written yet."""

    name: str
    redrawn: int
    felt: bool
    recording: Recording | None


@dataclass(frozen=True)
class Written:
    """What `write` has done.

    Attributes:
        paths: the files.
        redrawn: how many of the trials were drawn again.
        unfelt: in how many of them no taxel rises above the skin's onset.
        rough: {a kind's first trials: what its step costs, as a part of the peak force} where
            that is measured and no step is within the scene's tolerance.
    """

    paths: list[Path]
    redrawn: int
    unfelt: int
    rough: dict[str, float]


def kinds(scene: Scene) -> dict[Kind, list[TrialSpec]]:
    """The scene's trials by kind, in the scene's order."""
    out: dict[Kind, list[TrialSpec]] = {}
    for item in scene.objects:
        for condition in item.conditions:
            trials = out.setdefault(kind_of(scene, item, condition), [])
            trials += [TrialSpec(item, condition, number) for number in range(scene.count)]
    return out


def measured(scene: Scene) -> dict[Kind, Convergence]:
    """What halving the step does to each kind of trials; empty where the scene gives its steps.

    Raises:
        InputError: an object touches the arm from the start: told before anything takes long.
    """
    if scene.step_s:
        return {}
    for kind, trials in kinds(scene).items():
        plan = make_plan(scene, kind.effects)
        for i in range(0, len(trials), BATCH):
            some = tuple(trials[i : i + BATCH])
            check_start(begin(scene, plan, some, 1.0, values_of(scene, some)), plan)
    return {kind: measure(scene, tuple(trials)) for kind, trials in kinds(scene).items()}


def steps(
    scene: Scene,
    found: dict[Kind, Convergence] | None = None,
    every: Iterable[Kind] | None = None,
) -> dict[Kind, float]:
    """The physics' step of each kind of trials: the smallest that the scene's `step_s` gives
    its effects, or the measured one where the scene gives none (`found` and `every` kind, if they
    are at hand)."""
    if not scene.step_s:
        found = measured(scene) if found is None else found
        return {kind: convergence.step_s for kind, convergence in found.items()}
    return {
        kind: min(scene.step_s[name] for name in ("base", *kind.effects) if name in scene.step_s)
        for kind in every or kinds(scene)
    }


def file_name(scene: Scene, trial: TrialSpec) -> str:
    """The file name of a trial's recording."""
    return f"{trial.key}-{trial.number:0{len(str(max(scene.count - 1, 10)))}d}.npz"


def recordings(
    physics: PhysicsRun,
    plan: Plan,
    scene: Scene,
    step_s: float,
    which: NDArray[np.intp] | None = None,
) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a run, or of some, as a scene's plan shows them."""
    arm, skin = scene.arm.to_dict(), scene.skin.to_dict()
    values = {name: value.tolist() for name, value in physics.state.values.items()}
    for seen in readings(physics, plan, which):
        trial, kept = seen.trial, slice(None) if seen.kept is None else seen.kept
        t = seen.t if seen.times is None else seen.times
        drawn = {name: value[seen.which] for name, value in values.items()}
        soft = "soft" if trial.object.family in SOFT_FAMILIES else "rigid"
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
                "step_s": step_s,
                "family": trial.object.family,
                "redrawn": trial.attempt,
                "effects": list(plan.effects),
                "values": {k: v for k, v in drawn.items() if math.isfinite(v)},
            },
        }
        frames, joints = seen.frames()[kept], seen.joints[kept]
        yield file, Recording(t=t[kept], frames=frames, joints=joints, valid=seen.valid, meta=meta)


def simulate_trials(
    scene: Scene, trials: tuple[TrialSpec, ...], step_s: float
) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of trials of one kind, each drawn until it does as its label says."""
    first = trials[0]
    plan = make_plan(scene, kind_of(scene, first.object, first.condition).effects)
    for physics, true in true_runs(scene, trials, step_s, plan):
        yield from recordings(physics, plan, scene, step_s, np.flatnonzero(true))


def simulate_part(
    scene: Scene, trials: tuple[TrialSpec, ...], step_s: float, folder: str | None
) -> list[Simulated]:
    """Simulate one batch; write it where `folder` is given, else give the recordings back."""
    out: list[Simulated] = []
    for name, trial in simulate_trials(scene, trials, step_s):
        if folder is not None:
            recording.save(f"{folder}/{name}", trial, lasting=False)
        redrawn = int(trial.meta["simulation"]["redrawn"])
        felt = bool(trial.frames.max(initial=0) > scene.skin.onset)
        out.append(Simulated(name, redrawn, felt, trial if folder is None else None))
    return out


def parts(
    scene: Scene, batch: int = BATCH, found: dict[Kind, Convergence] | None = None
) -> list[tuple[tuple[TrialSpec, ...], float]]:
    """The scene cut into batches: (trials, step) each; `found` as for `steps`."""
    if batch < 1:
        raise InputError(f"--batch must be at least 1, not {batch}")
    every = kinds(scene)
    step = steps(scene, found, every)
    return [
        (tuple(trials[i : i + batch]), step[kind])
        for kind, trials in every.items()
        for i in range(0, len(trials), batch)
    ]


def simulate(scene: Scene, batch: int = BATCH) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial, simulated here, in the order of the batches."""
    for trials, step_s in parts(scene, batch):
        yield from simulate_trials(scene, trials, step_s)


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
    """Simulate a scene into a folder of recordings.

    The files' bytes depend on the scene and its seed alone.

    Args:
        batch: trials simulated together.
        jobs: processes on this machine (joblib).
        backend: `local`, or `dask`: the scheduler at `address` runs the batches, and the
            recordings come back to be written here.
        progress: called with the number of trials that have just been written.

    Raises:
        InputError: a file cannot be written, or there is no scheduler at `address`.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made: {error.strerror or error}") from None
    found = measured(scene)
    work = parts(scene, batch, found)
    done: Iterable[list[Simulated]]
    if backend == "dask":
        done = _on_dask(scene, work, address)
    elif backend == "local":
        done = _on_cores(scene, work, str(target), jobs)
    else:
        raise InputError(f"--backend must be local or dask, not {backend!r}")
    made: list[Simulated] = []
    for part in done:
        for trial in part:
            if trial.recording is not None:
                recording.save(target / trial.name, trial.recording, lasting=False)
                trial = replace(trial, recording=None)
            made.append(trial)
        progress(len(part))
    return Written(
        paths=[target / name for name in sorted(trial.name for trial in made)],
        redrawn=sum(1 for trial in made if trial.redrawn),
        unfelt=sum(1 for trial in made if not trial.felt),
        rough={
            kinds(scene)[kind][0].key: convergence.error
            for kind, convergence in found.items()
            if not convergence.within
        },
    )


def _on_cores(
    scene: Scene, work: list[tuple[tuple[TrialSpec, ...], float]], folder: str, jobs: int
) -> Iterable[list[Simulated]]:
    if jobs == 1:
        return (simulate_part(scene, trials, step_s, folder) for trials, step_s in work)
    from joblib import Parallel, delayed

    run = Parallel(n_jobs=jobs, return_as="generator_unordered")
    found: Iterable[list[Simulated]] = run(
        delayed(simulate_part)(scene, trials, step_s, folder) for trials, step_s in work
    )
    return found


def _on_dask(
    scene: Scene, work: list[tuple[tuple[TrialSpec, ...], float]], address: str | None
) -> Iterator[list[Simulated]]:
    from joblib import Parallel, delayed

    with on_cluster(address):
        run = Parallel(n_jobs=-1, return_as="generator_unordered")
        yield from run(
            delayed(simulate_part)(scene, trials, step_s, None) for trials, step_s in work
        )


def total_trials(scene: Scene) -> int:
    """How many trials a scene has."""
    return int(np.sum([len(t) for t in kinds(scene).values()]))
