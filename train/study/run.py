"""The study: every analysis of the paper, repeated on one data set and written as a
report."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

from edge.errors import InputError, counted
from train.data.dataset import DataSet, Measurement, load_trials
from train.report.page import write
from train.report.section import Section
from train.report.work import Workers
from train.simulate import scene as scenes
from train.simulate.run import write as simulate
from train.simulate.scene_model import Scene
from train.study import paper, sweeps
from train.study.sweeps import Context

TABLES = {"resolution": "I", "scaling": "II", "features": "III"}
"""{our table: the paper's table of the same settings}."""
ANALYSES: tuple[Callable[[Context], Section], ...] = (
    sweeps.resolution,
    sweeps.scaling,
    sweeps.features,
)
"""The report's analyses, in its order."""
LONGEST_S = 2.0
FEWEST = 20
"""Smallest number of trials, because the grid has 20 components."""


def _studied(data: Sequence[str]) -> DataSet:
    """The recordings, with the features of every analysis.

    Raises:
        InputError: they are too few.
    """
    measurement = Measurement(horizon_s=LONGEST_S)
    dataset = load_trials(data, measurement, progress=True)
    if len(dataset.trials) < FEWEST:
        raise InputError(
            f"a study needs at least {FEWEST} trials, not {len(dataset.trials)}; "
            "record more"
        )
    return dataset


def require_scene(dataset: DataSet, scene: Scene) -> None:
    """Refuse trials that were not simulated from a scene.

    Raises:
        InputError: the sentence names the first of them.
    """
    for trial in dataset.trials:
        meta = trial.recording.meta
        simulation = meta.get("simulation")
        seed = simulation.get("seed") if isinstance(simulation, dict) else None
        is_of_seed = seed in (None, scene.seed)  # early recordings name no seed
        if meta.get("source") != f"simulated: {scene.name}" or not is_of_seed:
            raise InputError(
                f"{trial.path}: was not simulated from the scene {scene.name} with seed "
                f"{scene.seed}; give its scene, or study the recordings without a scene"
            )


def study(
    data: Sequence[str],
    out: Path,
    *,
    scene: str | None = None,
    jobs: int = 1,
    seeds: int = 1,
) -> Path:
    """Run every analysis and write the report; its path.

    Args:
        data: recordings and folders of them.
        out: folder of the report.
        scene: the scene that the recordings were simulated from; without it, the
            paper's numbers are left out.
        jobs: processes on this machine.
        seeds: number of data sets of the scene, including these recordings, whose mean
            is compared with the paper's numbers.

    Raises:
        InputError: the data set cannot be used, or its trials are not of the scene.
    """
    workers = Workers(jobs)
    source = None if scene is None else scenes.load(scene)
    dataset = _studied(data)
    if source is not None:
        require_scene(dataset, source)
    context = Context(dataset, source, workers)
    constant = [task for task in dataset.tasks if task not in context.labels]
    if not context.labels:
        raise InputError(
            f"every trial has the same {' and the same '.join(constant)}: there is "
            "nothing to distinguish; give recordings of two classes or more"
        )
    sections = _analysed(context, seeds)
    name = Path(data[0]).absolute().name if source is None else source.name
    title = f"The paper's analyses, repeated on {name}"
    return write(out, title, _lead(context, constant), sections)


def _analysed(context: Context, seeds: int) -> list[Section]:
    """The sections of the analyses, after their comparison with the paper's where the
    trials are simulated."""
    sections = [analysis(context) for analysis in ANALYSES]
    scene = context.scene
    if scene is None:
        return sections
    numbers = [_numbers(sections)]
    numbers += [_of_another_seed(context, scene, i) for i in range(1, seeds)]
    trials = seeds * len(context.dataset.trials)
    return [paper.comparison(numbers, trials), *sections]


def _lead(context: Context, constant: Sequence[str]) -> list[str]:
    """The paragraphs below the title: the data set, and the labels and recordings that
    are ignored."""
    dataset = context.dataset
    scene = context.scene
    layout = dataset.layout
    tasks = ", ".join(
        f"{task} ({len(set(y))} classes)" for task, y in context.labels.items()
    )
    frame = "skin" if dataset.chain is None else "world"
    source = "The trials were recorded, or simulated elsewhere."
    if scene is not None:
        source = f"The trials were simulated from the scene {scene.name} with seed {scene.seed}."
    lead = [
        f"{counted(len(dataset.trials), 'trial')} on {layout.rows} x {layout.cols} "
        f"taxels, with the tasks {tasks}. Force is in {layout.force_unit}s; motion is "
        f"in {layout.length_unit}s, in the frame of the {frame}. {source} "
        "Accuracies come from leave-one-out cross-validation, with 95 % "
        "binomial (Wilson) intervals."
    ]
    if constant:
        lead.append(
            f"Ignored, because every trial has the same label: {', '.join(constant)}."
        )
    if dataset.untouched:
        lead.append(
            f"Ignored: {counted(len(dataset.untouched), 'recording')} without a "
            "contact."
        )
    return lead


def _numbers(sections: Sequence[Section]) -> paper.Numbers:
    """Our accuracies in percent, under the names of the paper's tables."""
    numbers = {}
    for table in chain.from_iterable(section.tables for section in sections):
        if table.name in TABLES:
            for row in table.rows:
                setting = str(next(iter(row.values())))
                key = TABLES[table.name], setting, row["task"]
                numbers[key] = row["accuracy %"]
    return numbers


def _of_another_seed(context: Context, scene: Scene, i: int) -> paper.Numbers:
    """The accuracies to compare with the paper's, on the scene simulated with another
    seed."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(replace(scene, seed=scene.seed + i), folder)
        dataset = load_trials([folder], Measurement(horizon_s=LONGEST_S))
    another = replace(context, dataset=dataset)
    return _numbers([analysis(another) for analysis in ANALYSES])
