"""The whole study: one data set in, one report out."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from edge.errors import InputError
from train.cluster import on_cluster
from train.dataset import load_trials
from train.report import html as report
from train.report.tables import Section
from train.simulate import scene as scenes
from train.simulate.run import write as simulate
from train.simulate.scene_model import Scene
from train.study import beyond, classify, findings, honest, paper, readings, resolution, robust
from train.study.context import Context

SECTIONS: tuple[Callable[[Context], Section], ...] = (
    classify.confusion,
    resolution.section,
    classify.window,
    classify.scaling,
    classify.features,
    honest.section,
    beyond.section,
)
LONGEST_S = 2.0
FEWEST = 20
"""Trials below which a grid of 20 components makes no sense."""


def study(
    data: Sequence[str],
    out: Path,
    *,
    scene: str | None = None,
    jobs: int = 1,
    address: str | None = None,
    seeds: int = 1,
) -> Path:
    """Run every analysis and write the report; its path.

    Args:
        data: recordings and folders of them.
        out: folder.
        scene: what they were simulated from; without it, what needs simulating is left out.
        jobs: processes on this machine.
        address: of a Dask scheduler that runs the sweeps instead.
        seeds: data sets of the scene, these among them, whose mean stands beside the paper's
            numbers.

    Raises:
        InputError: the data set cannot be used, or there is no scheduler.
    """
    began = time.perf_counter()
    if seeds < 1:
        raise InputError(f"--seeds must be at least 1, not {seeds}")
    if jobs < 1:
        raise InputError(f"--jobs must be at least 1, not {jobs}")
    source = None if scene is None else scenes.load(scene)
    dataset = load_trials(data, horizon_s=LONGEST_S, progress=True)
    if len(dataset.trials) < FEWEST:
        raise InputError(
            f"{len(dataset.trials)} trials are too few to study; give {FEWEST} or more"
        )
    context = Context(dataset, source, jobs)
    alike = [task for task in dataset.tasks if task not in context.labels]
    if not context.labels:
        raise InputError(
            f"every trial has the same {' and the same '.join(alike)}: there is nothing to tell "
            "apart; give recordings of two classes or more"
        )
    backend = None if address is None else "dask"
    with nullcontext() if address is None else on_cluster(address):
        context.cluster = backend
        # First, as it is what finds out whether the scene is that of the recordings.
        others = robust.section(context)
        sections = [part(context) for part in SECTIONS]
        if source is not None and seeds > 1:
            context.others = _again(source, seeds - 1, context)
    # After all that the paper's numbers are set beside.
    compared = []
    if source is not None:
        theirs_too = {(e.table, e.setting, e.task): e.percent for e in paper.entries()}
        read = readings.compare(paper.mean_of(context.every), theirs_too, context.tested)
        compared = [paper.section(context.every, context.tested), read]
    own, theirs = sections[-2:], sections[:-2]
    sections = [*own, *compared, *theirs, *([] if others is None else [others])]
    sections.insert(0, findings.section(sections))
    took = time.perf_counter() - began
    layout = dataset.layout
    lead = [
        f"{len(dataset.trials)} trials, {layout.rows} x {layout.cols} taxels, tasks "
        + ", ".join(f"{task} ({len(set(y))} classes)" for task, y in context.labels.items())
        + f"; force in {layout.force_unit}s, motion in {layout.length_unit}s in the "
        + f"{'skin' if dataset.chain is None else 'world'}'s frame. "
        + (
            f"Simulated: scene {source.name}, seed {source.seed}."
            if source is not None
            else "Recorded, or simulated elsewhere."
        ),
        "Accuracies are of leave-one-out cross-validation unless said otherwise, with 95 % "
        "binomial (Wilson) intervals.",
    ]
    if alike:
        lead.append(f"Left out, as every trial has the same: {', '.join(alike)}.")
    if dataset.untouched:
        lead.append(f"{len(dataset.untouched)} recordings without a contact are left out.")
    title = "What a touch tells: " + (source.name if source is not None else Path(data[0]).name)
    written = report.write(out, title, lead, sections)
    print(f"study: {len(sections)} sections in {took:.0f} s", file=sys.stderr)
    return written


def _again(scene: Scene, count: int, like: Context) -> list[paper.Numbers]:
    """What the sections that the paper's numbers are set beside find on other seeds."""
    found = []
    for i in tqdm(range(1, count + 1), desc=f"{'further data sets':<22}"):
        with tempfile.TemporaryDirectory() as folder:
            simulate(replace(scene, seed=scene.seed + i), folder, jobs=like.jobs)
            dataset = load_trials([folder], horizon_s=LONGEST_S)
        context = Context(dataset, scene, like.jobs, like.cluster, progress=False)
        for part in (resolution.section, classify.scaling, classify.features):
            part(context)
        found.append(context.ours)
    return found
