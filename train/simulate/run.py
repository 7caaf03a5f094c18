"""A scene's trials in batches: on this machine, on several cores, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from edge import recording
from edge.errors import InputError
from edge.recording import Recording
from train.simulate.convergence import choose_step
from train.simulate.engine import Batch, Kind, kind_of, run_batch
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import SOFT_FAMILIES

BATCH = 256
"""Trials in a batch: enough to spread numpy's cost a call, few enough to stay in the cache."""
Named = tuple[str, Recording | None]


def kinds(scene: Scene) -> dict[Kind, list[TrialSpec]]:
    """The scene's trials by kind, in the scene's order."""
    out: dict[Kind, list[TrialSpec]] = {}
    for item in scene.objects:
        for condition in item.conditions:
            trials = out.setdefault(kind_of(scene, item, condition), [])
            trials += [TrialSpec(item, condition, number) for number in range(scene.count)]
    return out


def steps(scene: Scene) -> dict[Kind, float]:
    """The physics' step of each kind of trials: the smallest that the scene's `step_s` gives
    its effects, or the measured one where the scene gives none."""
    if not scene.step_s:
        return {k: choose_step(scene, tuple(t)).step_s for k, t in kinds(scene).items()}
    return {
        kind: min(scene.step_s[name] for name in ("base", *kind.effects) if name in scene.step_s)
        for kind in kinds(scene)
    }


def recordings(batch: Batch, scene: Scene, step_s: float) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial of a batch."""
    arm, skin = scene.arm.to_dict(), scene.skin.to_dict()
    values = batch.state.values
    for i, trial in enumerate(batch.trials):
        kept = slice(None) if batch.kept is None else batch.kept[i]
        t = batch.t if batch.times is None else batch.times[i]
        soft = "soft" if trial.object.family in SOFT_FAMILIES else "rigid"
        name = f"{trial.key}-{trial.number:0{len(str(max(scene.count - 1, 10)))}d}"
        meta: dict[str, Any] = {
            "labels": {
                "category": f"{soft}-{trial.condition}",
                "mobility": trial.condition,
                "object": trial.object.name,
            },
            "skin": skin,
            "arm": arm,
            "source": f"simulated: {scene.name}",
            "trial": name,
            "simulation": {
                "seed": scene.seed,
                "step_s": step_s,
                "family": trial.object.family,
                "effects": list(kind_of(scene, trial.object, trial.condition).effects),
                "values": {k: float(v[i]) for k, v in values.items() if np.isfinite(v[i])},
            },
        }
        yield (
            f"{name}.npz",
            Recording(
                t=t[kept],
                frames=batch.counts[i][kept],
                joints=batch.joints[i][kept],
                valid=None if batch.valid is None else batch.valid[i],
                meta=meta,
            ),
        )


def simulate_part(
    scene: Scene, trials: tuple[TrialSpec, ...], step_s: float, folder: str | None
) -> list[Named]:
    """Simulate one batch; write it where `folder` is given, else give the recordings back."""
    batch = run_batch(scene, trials, step_s)
    out: list[Named] = []
    for name, trial in recordings(batch, scene, step_s):
        if folder is None:
            out.append((name, trial))
        else:
            recording.save(Path(folder) / name, trial)
            out.append((name, None))
    return out


def parts(scene: Scene, batch: int = BATCH) -> list[tuple[tuple[TrialSpec, ...], float]]:
    """The scene cut into batches: (trials, step) each."""
    if batch < 1:
        raise InputError(f"--batch must be at least 1, not {batch}")
    step = steps(scene)
    return [
        (tuple(trials[i : i + batch]), step[kind])
        for kind, trials in kinds(scene).items()
        for i in range(0, len(trials), batch)
    ]


def simulate(scene: Scene, batch: int = BATCH) -> Iterator[tuple[str, Recording]]:
    """(file name, recording) of each trial, simulated here, in the order of the batches."""
    for trials, step_s in parts(scene, batch):
        yield from recordings(run_batch(scene, trials, step_s), scene, step_s)


def write(
    scene: Scene,
    folder: str | Path,
    *,
    batch: int = BATCH,
    jobs: int = 1,
    backend: str = "local",
    address: str | None = None,
    progress: Callable[[int], Any] = lambda done: None,
) -> list[Path]:
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
    work = parts(scene, batch)
    done: Iterable[list[Named]]
    if backend == "dask":
        done = _on_dask(scene, work, address)
    elif backend == "local":
        done = _on_cores(scene, work, str(target), jobs)
    else:
        raise InputError(f"--backend must be local or dask, not {backend!r}")
    written: list[Path] = []
    for named in done:
        for name, trial in named:
            if trial is not None:
                recording.save(target / name, trial)
            written.append(target / name)
        progress(len(named))
    return sorted(written)


def _on_cores(
    scene: Scene, work: list[tuple[tuple[TrialSpec, ...], float]], folder: str, jobs: int
) -> Iterable[list[Named]]:
    if jobs == 1:
        return (simulate_part(scene, trials, step_s, folder) for trials, step_s in work)
    from joblib import Parallel, delayed

    run = Parallel(n_jobs=jobs, return_as="generator_unordered")
    found: Iterable[list[Named]] = run(
        delayed(simulate_part)(scene, trials, step_s, folder) for trials, step_s in work
    )
    return found


def _on_dask(
    scene: Scene, work: list[tuple[tuple[TrialSpec, ...], float]], address: str | None
) -> Iterator[list[Named]]:
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise InputError(
            "--backend dask needs Dask: pip install 'edge-classify[cluster]'"
        ) from None
    try:
        client = distributed.Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise InputError(f"--address {address}: no Dask scheduler answers there: {error}") from None
    with closing(client):
        spread = client.scatter(scene, broadcast=True)
        futures = [
            client.submit(simulate_part, spread, trials, step_s, None, pure=False)
            for trials, step_s in work
        ]
        for future in distributed.as_completed(futures):
            yield future.result()
            future.release()


def total_trials(scene: Scene) -> int:
    """How many trials a scene has."""
    return int(np.sum([len(t) for t in kinds(scene).values()]))
