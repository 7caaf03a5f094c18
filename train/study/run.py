"""The study: one data set in, one report out."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from edge.errors import InputError
from train.cluster import on_cluster
from train.dataset import load_trials
from train.feature_sets import expand
from train.progress import bar
from train.report.page import write
from train.report.section import Numbers, Section, counted
from train.report.work import Workers
from train.simulate import scene as scenes
from train.simulate.run import write as simulate
from train.simulate.scene_model import Scene
from train.study import methods, paper, robust, sweeps
from train.study.context import Context

COMPARED = (sweeps.resolution, sweeps.scaling, sweeps.features)
"""The analyses of which the paper has numbers."""
ANALYSES: tuple[Callable[[Context], Section | None], ...] = (
    methods.section,
    sweeps.confusion,
    sweeps.resolution,
    sweeps.window,
    sweeps.scaling,
    sweeps.features,
    robust.section,
)
"""Each analyses the data set; None where it has nothing to say of it."""
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
        out: folder of the report.
        scene: the scene that they were simulated from; without it, analyses that simulate are
            left out.
        jobs: processes on this machine.
        address: address of a Dask scheduler that runs the sweeps instead.
        seeds: number of data sets of the scene, these recordings among them, whose mean is
            compared with the paper's numbers.

    Raises:
        InputError: the data set cannot be used, or there is no scheduler.
    """
    for option, value in (("--seeds", seeds), ("--jobs", jobs)):
        if value < 1:
            raise InputError(f"{option} must be at least 1, not {value}")
    source = None if scene is None else scenes.load(scene)
    names = expand([name for name, _ in methods.OURS])
    dataset = load_trials(data, horizon_s=LONGEST_S, features=names, progress=True)
    if len(dataset.trials) < FEWEST:
        raise InputError(
            f"{counted(len(dataset.trials), 'trial')} are too few to study; give {FEWEST} or more"
        )
    context = Context(dataset, source, Workers(jobs, None if address is None else "dask"))
    constant = [task for task in dataset.tasks if task not in context.labels]
    if not context.labels:
        raise InputError(
            f"every trial has the same {' and the same '.join(constant)}: there is nothing to "
            "distinguish; give recordings of two classes or more"
        )
    with nullcontext() if address is None else on_cluster(address):
        # The last first: it notices when the recordings are of another scene.
        sections = [analysis(context) for analysis in reversed(ANALYSES)][::-1]
        shown = [section for section in sections if section]
        if source is not None:
            numbers = [_numbers(shown)]
            numbers += [_again(context, source, i) for i in bar(range(1, seeds), desc="data sets")]
            shown.insert(1, paper.comparison(numbers, seeds * len(dataset.trials)))
    name = source.name if source is not None else Path(data[0]).name
    return write(out, f"What a touch reveals: {name}", _lead(context, constant), shown)


def _lead(context: Context, constant: Sequence[str]) -> list[str]:
    """The paragraphs below the title: the data set, and what is left out of it."""
    dataset, scene, layout = context.dataset, context.scene, context.dataset.layout
    tasks = ", ".join(f"{task} ({len(set(y))} classes)" for task, y in context.labels.items())
    frame = "skin" if dataset.chain is None else "world"
    source = "Recorded, or simulated elsewhere."
    if scene is not None:
        source = f"Simulated: scene {scene.name}, seed {scene.seed}."
    lead = [
        f"{counted(len(dataset.trials), 'trial')}, {layout.rows} x {layout.cols} taxels, tasks "
        f"{tasks}; force in {layout.force_unit}s, motion in {layout.length_unit}s in the {frame}'s "
        f"frame. {source} Accuracies below the findings are of leave-one-out cross-validation, "
        "with 95 % binomial (Wilson) intervals."
    ]
    if constant:
        lead.append(f"Left out, as every trial has the same label: {', '.join(constant)}.")
    if dataset.untouched:
        lead.append(f"Left out: {counted(len(dataset.untouched), 'recording')} without a contact.")
    return lead


def _numbers(sections: Sequence[Section]) -> Numbers:
    return {key: percent for section in sections for key, percent in section.numbers.items()}


def _again(context: Context, scene: Scene, i: int) -> Numbers:
    """The numbers beside the paper's on the `i`-th further seed of the scene."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(replace(scene, seed=scene.seed + i), folder, jobs=context.workers.jobs)
        dataset = load_trials([folder], horizon_s=LONGEST_S)
    quiet = replace(context, dataset=dataset, workers=replace(context.workers, progress=False))
    return _numbers([analysis(quiet) for analysis in COMPARED])
