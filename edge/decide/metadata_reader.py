"""Reads the metadata of a model file, and refuses those that contradict themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from edge.config import ConfigTable, parse_json, short_text
from edge.decide.agreement import factors_fit
from edge.decide.info import (
    FORMAT,
    KnownDistance,
    ModelInfo,
    OutlierLimits,
    Stopping,
    StoppingRule,
    Task,
)
from edge.errors import InputError, about
from edge.features.kernels import read_tables
from edge.features.names import feature_types
from edge.features.quantities import KERNELS
from edge.touch.arm import Chain
from edge.touch.frame import ONSETS
from edge.touch.layout import SkinLayout


def from_json(text: str, name: str) -> ModelInfo:
    """Read the text that `edge.decide.metadata.to_json` wrote.

    Raises:
        InputError: something is missing, of the wrong kind or a contradiction; the
            sentence names `name`.
    """
    where = f"{name}: its metadata"
    try:
        meta = ConfigTable(parse_json(text, where), where)
        if meta.whole("format") != FORMAT:
            raise InputError(
                f"{where} is of format {short_text(meta.raw['format'])}, but this "
                f"edge-classify reads {FORMAT}"
            )
        info = _read(meta)
        with about(where):
            feature_types(info.features)
    except InputError as error:
        raise InputError(f"{error}; export it again") from None
    for contradiction in _contradictions(info):
        raise InputError(f"{name}: {contradiction}; export it again")
    return info


def _read(meta: ConfigTable) -> ModelInfo:
    """Read the table of a model's metadata."""
    tasks = meta.table("tasks")
    tracking = meta.table("tracking")
    names = meta.texts("features")
    units = meta.table("units")
    layout = SkinLayout.from_dict(meta.get("skin"), where=meta.where)
    versions = meta.table("versions", {}).raw
    arm = meta.get("arm", None)
    chain = None
    if arm is not None:
        chain = Chain.from_dict(arm, where=f"{meta.where}: arm")
    stopping = {}
    outlier_score = None
    count = len(meta.numbers("decision_points_s", default=()))
    if count:
        rules = meta.table("stopping")
        stopping = {task: read_stopping(rules.table(task), count) for task in rules.raw}
        outlier_score = OutlierLimits(
            **meta.table("outlier_score").values(OutlierLimits, count)
        )
    kernels = {}
    if not KERNELS.keys().isdisjoint(names):
        kernels = read_tables(meta.table("kernels"), names, layout)
    others: dict[str, Any] = {
        "tasks": {str(task): _task(tasks.table(task)) for task in tasks.raw},
        "layout": layout,
        "debounce": tracking.whole("debounce", allowed=range(1, 101)),
        "units": {name: units.text(name) for name in names},
        "motion_frame": meta.choice("motion_frame", ("world", "skin")),
        "chain": chain,
        "versions": {str(key): str(version) for key, version in versions.items()},
        "stopping": stopping,
        "outlier_score": outlier_score,
        "kernels": kernels,
        "usual": _usual(meta, names),
        "onset": meta.choice("onset", ("", *ONSETS), ""),
    }
    tracking.refuse_unknown()
    return ModelInfo(**meta.values(ModelInfo, **others))


def _task(table: ConfigTable) -> Task:
    labels = table.texts("labels")
    bare = {label.strip() for label in labels} - {""}
    if not bare or len(bare) < len(labels) or not "".join(labels).isprintable():
        raise table.fail("labels", "a list of different, printable texts")
    factors = table.table("factors")
    by_factor = {factor: factors.wholes(factor) for factor in factors.raw}
    task = Task(**table.values(Task, factors=by_factor))
    table.refuse_unknown()
    return task


def read_stopping(table: ConfigTable, points: int) -> Stopping:
    """The calibration of a task, of a model with this number of decision points.

    Raises:
        InputError: the table is damaged.
    """
    trials = table.whole("trials", allowed=range(1, 1 << 31))
    rules = []
    for rule in table.tables("rules", f"{table.prefix}rules"):
        last = rule.whole("last", allowed=range(points))
        rules.append(StoppingRule(**rule.values(StoppingRule, last=last)))
    others: dict[str, Any] = {
        "rules": tuple(rules),
        "wrong": table.whole("wrong", allowed=range(trials + 1)),
        "known_distance": None,
    }
    if table.has("known_distance"):
        others["known_distance"] = read_known_distance(
            table.table("known_distance"), points
        )
    return Stopping(**table.values(Stopping, points, **others))


def read_known_distance(table: ConfigTable, points: int) -> KnownDistance:
    """The doubt about names, of a model with this number of decision points.

    Raises:
        InputError: the table is damaged.
    """
    shares = table.table("worth")
    worth = {name: shares.number(name, low=0.0, high=1.0) for name in shares.raw}
    return KnownDistance(**table.values(KnownDistance, points, worth=worth))


def _usual(meta: ConfigTable, names: Sequence[str]) -> dict[str, Sequence[float]]:
    """The usual range of each feature, where the model has them."""
    if not meta.has("usual"):
        return {}
    table = meta.table("usual")
    usual: dict[str, Sequence[float]] = {}
    for name in names:
        lowest, highest = table.numbers(name, 2)
        if lowest > highest:
            raise table.fail(name, "two numbers that rise")
        usual[name] = lowest, highest
    return usual


def _contradictions(info: ModelInfo) -> Iterator[str]:
    """Contradictions in the metadata, as sentences."""
    yield from _contradictions_of_joints(info)
    if not info.tasks:
        yield "its metadata names no task"
    if info.decision_points_s and not _points_fit(info):
        yield "its decision points are impossible"
    if info.trials and len(info.trials) != info.rows:
        yield f"names {len(info.trials)} of {info.rows} trials"
    if (info.motion_frame == "world") != (info.chain is not None):
        yield "its motion frame contradicts its arm"
    yield from _unprintable(info)
    yield from _contradictions_of_tasks(info)


def _contradictions_of_joints(info: ModelInfo) -> Iterator[str]:
    of_joints = any(
        feature.quantity.of_joints for feature in feature_types(info.features)
    )
    if info.joints != ((info.dof or None) if of_joints else 0):
        features = "joint features" if of_joints else "no joint features"
        yield f"names {features} but gives {info.joints} joints"


def _unprintable(info: ModelInfo) -> Iterator[str]:
    answers = [task.no_contact or "" for task in info.tasks.values()]
    if not "".join([info.name, *info.tasks, *answers, *info.trials]).isprintable():
        yield "its name, tasks, answers and trials must be printable"


def _contradictions_of_tasks(info: ModelInfo) -> Iterator[str]:
    """Contradictions in the tasks, as sentences."""
    for name, task in info.tasks.items():
        if task.components > info.width:
            yield (
                f"task {name!r} has {task.components} components of {info.width} "
                "features"
            )
        if task.features != tuple(f for f in info.features if f in task.features):
            yield f"task {name!r} takes other features, or in another order"
    labels = {name: task.labels for name, task in info.tasks.items()}
    for name, factors in info.joint_tasks.items():
        if not factors_fit(factors, labels, name):
            yield f"task {name!r} is not the joint task of its factors"


def _points_fit(info: ModelInfo) -> bool:
    """Whether decision points rise to the window, and each task has its rules."""
    points = info.decision_points_s
    rising = sorted({0.0, *points}) == [0.0, *points]
    ends = points[-1] == info.window_s
    return rising and ends and info.stopping.keys() == info.tasks.keys()
