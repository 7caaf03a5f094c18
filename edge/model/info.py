"""The metadata of a model file, which the board reads beside the graph."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from edge.config import ConfigTable, parse_json, shown
from edge.errors import InputError
from edge.model.calibration import Novelty, Stopping
from edge.touch.contact import FeatureSeries, feature_types
from edge.touch.feature import KERNELS
from edge.touch.features import feature_vector, widths
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import WatchfulTracker

if TYPE_CHECKING:
    from edge.touch.arm import Chain
    from edge.touch.kernels import KernelTable

METADATA_KEY = "edge-classify"
FORMAT = 7


@dataclass(frozen=True)
class Task:
    """A question that the model answers, and how it was fitted.

    Attributes:
        labels: the answers, in the order of the scores.
        k: neighbours that vote.
        components: coordinates that distances are measured in.
        scaling: "none" or "I" to "V" (paper, Eqs. 1 to 5).
        accuracy: nested accuracy of the whole choice at export, 0 to 1.
        projection: "pca" (principal components) or "lda" (discriminants).
        features: the features that it takes, in the model's order; empty for all.
        left_out: the groups left out to score the accuracy: "trial", or a label such as
            "object".
        no_contact: the answer for a recording that ends without a contact, or None.
        factors: of a task that is decided together with two others; see
            `edge.model.agreement`.
    """

    labels: tuple[str, ...]
    k: int
    components: int
    scaling: str
    accuracy: float
    projection: str = "pca"
    features: tuple[str, ...] = ()
    left_out: str = "trial"
    no_contact: str | None = None
    factors: Mapping[str, Sequence[int]] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelInfo:
    """A model's metadata: all that the board needs besides the weights."""

    tasks: dict[str, Task]
    layout: SkinLayout
    debounce: int
    """Frames in a row that confirm a contact."""
    window_s: float
    samples: int
    features: tuple[str, ...]
    units: dict[str, str]
    motion_frame: str
    """`world` (with joint angles) or `skin`."""
    chain: Chain | None
    rows: int
    """Training trials."""
    data_digest: str
    versions: dict[str, str] = field(default_factory=dict)
    decision_points_s: tuple[float, ...] = ()
    """Windows for which the model can decide, the full one last; empty without
    calibration."""
    stopping: dict[str, Stopping] = field(default_factory=dict)
    """The stopping rules of each task; empty without decision points."""
    novelty: Novelty | None = None
    """The limits of novelty; None without decision points."""
    joints: int = 0
    """Number of joint angles in a frame, if a feature is made of them; else 0."""
    kernels: Mapping[str, KernelTable] = field(default_factory=dict)
    """{feature: its table} of the features that are made of kernels."""
    name: str = ""
    """The model's name."""
    trials: tuple[str, ...] = ()
    """(rows,) names of the training trials; empty where they were too many to be
    kept."""
    usual: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """{feature: the least and the greatest mean over the full window of nearly all
    training trials}; empty without decision points."""
    several: float = 1.0
    """Share of the training trials with a second region beside the contact."""
    taught: int = 0
    """Number of the last trials, which were added on a board
    (`edge.tools.teaching`)."""

    @property
    def widths(self) -> tuple[int, ...]:
        """Number of values of each feature in a feature vector, in their order."""
        return widths(self.features, self.samples, self.layout, self.joints)

    def trial(self, row: int) -> str:
        """The name of a training trial, or its number where the file holds no names."""
        return self.trials[row] if self.trials else f"trial {row}"

    @property
    def width(self) -> int:
        """Length of a feature vector."""
        return sum(self.widths)

    def vector(
        self,
        series: FeatureSeries,
        window_s: float | None = None,
    ) -> NDArray[np.float64]:
        """The model's `feature_vector` of a contact, by default at the full window."""
        window_s = window_s or self.window_s
        return feature_vector(
            series,
            window_s,
            self.samples,
            self.features,
            self.kernels,
        )

    def unusual(self, vector: NDArray[np.float64]) -> str | None:
        """The property of a vector of the full window that is most unlike training, as a
        phrase."""
        if not self.usual:
            return None
        from edge.model.unusual import unusual  # few contacts are unknown

        ends = np.cumsum(self.widths)[:-1]
        means = [float(part.mean()) for part in np.split(vector, ends)]
        return unusual(means, self.usual)

    @property
    def products(self) -> dict[str, Mapping[str, Sequence[int]]]:
        """{task: its factors} of tasks that are decided together with two others."""
        return {name: task.factors for name, task in self.tasks.items() if task.factors}

    @property
    def has_label_distances(self) -> bool:
        """Whether the graph gives the distances of the labels."""
        return bool(self.decision_points_s or self.products)

    @property
    def dof(self) -> int | None:
        """Number of joint angles that a frame must have; None if the model needs
        none."""
        return (self.joints or None) if self.chain is None else self.chain.dof

    def tracker(self, layout: SkinLayout, *, max_contacts: int = 1) -> WatchfulTracker:
        """A new tracker for a skin, with the model's rules and features.

        Raises:
            InputError: the skin is not the one that the model was made for.
        """
        return WatchfulTracker(
            for_device(self.layout, layout),
            self.debounce,
            chain=self.chain,
            horizon_s=self.window_s,
            features=self.features,
            joints=self.joints,
            max_contacts=max_contacts,
        )

    @classmethod
    def from_json(cls, text: str, name: str) -> Self:
        """Read the text that `edge.model.metadata.to_json` wrote.

        Raises:
            InputError: something is missing or of the wrong kind; the sentence names
                `name`.
        """
        where = f"{name}: its metadata"
        try:
            meta = ConfigTable(parse_json(text, where), where)
            if meta.whole("format") != FORMAT:
                raise InputError(
                    f"{where} is of format {shown(meta.raw['format'])}, but this "
                    f"edge-classify reads {FORMAT}"
                )
            info = cls._read(meta)
        except InputError as error:
            raise InputError(f"{error}; export it again") from None
        _check_features(info, name)
        _check(info, name)
        return info

    @classmethod
    def _read(cls, meta: ConfigTable) -> Self:
        """Read the table of a model's metadata."""
        where = meta.where
        tasks = {}
        for task in meta.table("tasks").raw:
            tasks[str(task)] = _task(meta.table("tasks").table(task))
        tracking = meta.table("tracking")
        points = meta.numbers("decision_points_s", default=())
        names = meta.texts("features")
        units = meta.table("units")
        layout = SkinLayout.from_dict(meta.get("skin"), where=where)
        versions = {}
        for program, version in meta.table("versions", {}).raw.items():
            versions[str(program)] = str(version)
        info = cls(
            tasks=tasks,
            layout=layout,
            debounce=tracking.whole("debounce", allowed=range(1, 1001)),
            window_s=meta.number("window_s", low=0.0, high=3600.0, open_low=True),
            samples=meta.whole("samples", allowed=range(2, 10_001)),
            features=names,
            units={name: units.text(name) for name in names},
            motion_frame=meta.choice("motion_frame", ("world", "skin")),
            chain=_chain(meta),
            rows=meta.whole("rows"),
            data_digest=meta.text("data_digest", empty=True),
            versions=versions,
            decision_points_s=points,
            stopping=_stopping(meta, len(points)),
            novelty=_novelty(meta, len(points)),
            joints=meta.whole("joints", 0, allowed=range(0, 1001)),
            kernels=_kernels(meta, names, layout),
            name=meta.text("name", "", empty=True),
            trials=meta.texts("trials", ()),
            usual=_usual(meta, names),
            several=meta.number("several", 1.0, low=0.0, high=1.0),
            taught=meta.whole("taught", 0, allowed=range(1 << 31)),
        )
        tracking.done()
        return info


def _chain(meta: ConfigTable) -> Chain | None:
    """The arm, where the model has one."""
    arm = meta.get("arm", None)
    if arm is None:
        return None
    from edge.touch.arm import Chain

    return Chain.from_dict(arm, where=f"{meta.where}: arm")


def _stopping(meta: ConfigTable, points: int) -> dict[str, Stopping]:
    """The stopping rules of each task, where the model has decision points."""
    if not points:
        return {}
    rules = meta.table("stopping")
    return {task: Stopping.from_table(rules.table(task), points) for task in rules.raw}


def _novelty(meta: ConfigTable, points: int) -> Novelty | None:
    """The limits of novelty, where the model has decision points."""
    return Novelty.from_table(meta.table("novelty"), points) if points else None


def _usual(meta: ConfigTable, names: Sequence[str]) -> dict[str, Sequence[float]]:
    """The usual range of each feature, where the model has them."""
    if not meta.has("usual"):
        return {}
    table = meta.table("usual")
    usual: dict[str, Sequence[float]] = {}
    for name in names:
        least, greatest = table.numbers(name, 2)
        if least > greatest:
            raise table.fail(name, "two numbers that rise")
        usual[name] = least, greatest
    return usual


def _kernels(
    meta: ConfigTable,
    names: Sequence[str],
    layout: SkinLayout,
) -> dict[str, KernelTable]:
    """{feature: its table} of convolution features."""
    tables = {}
    for name in names:
        if name in KERNELS:
            from edge.touch.kernels import KernelTable

            table = meta.table("kernels").table(name)
            tables[name] = KernelTable.from_table(table, name, layout)
    return tables


def _check_features(info: ModelInfo, name: str) -> None:
    """Refuse features that do not exist, or contradict the joints."""
    try:
        types = feature_types(info.features)
    except InputError as error:
        raise InputError(
            f"{name}: was made for the features {', '.join(info.features)}; {error}; "
            "export it with this version of edge-classify"
        ) from None
    of_joints = any(feature.of_joints for feature in types)
    dof = info.joints if info.chain is None else info.chain.dof
    expected = dof if of_joints else 0
    if info.joints != expected or (of_joints and not info.joints):
        features = "joint features" if of_joints else "no joint features"
        raise InputError(
            f"{name}: names {features} but gives {info.joints} joints; export it again"
        )


def _check(info: ModelInfo, name: str) -> None:
    """Refuse metadata that contradict themselves."""
    for contradiction in _contradictions(info):
        raise InputError(f"{name}: {contradiction}; export it again")


def _contradictions(info: ModelInfo) -> Iterator[str]:
    """Contradictions in the metadata, as sentences."""
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


def _unprintable(info: ModelInfo) -> Iterator[str]:
    without_contact = [task.no_contact or "" for task in info.tasks.values()]
    if not "".join([info.name, *info.tasks, *without_contact]).isprintable():
        yield "its name, its tasks' names and its answers must be printable"
    if not "".join(info.trials).isprintable():
        yield "its trials' names must be printable"


def _contradictions_of_tasks(info: ModelInfo) -> Iterator[str]:
    """Contradictions in the tasks, as sentences."""
    for name, task in info.tasks.items():
        if task.components > info.width:
            yield (
                f"task {name!r} has {task.components} components of {info.width} "
                "features"
            )
    labels = {name: task.labels for name, task in info.tasks.items()}
    for name, factors in info.products.items():
        from edge.model.agreement import factors_fit  # few models have products

        if not factors_fit(factors, labels, name):
            yield f"task {name!r} is not the product of its factors"


def _points_fit(info: ModelInfo) -> bool:
    """Whether decision points rise to the window, and each task has its rules."""
    points = info.decision_points_s
    rising = (0.0, *points) == tuple(sorted({0.0, *points}))
    if not rising or points[-1] != info.window_s:
        return False
    named = info.novelty is not None and info.novelty.task in info.tasks
    return named and info.stopping.keys() == info.tasks.keys()


def _task(table: ConfigTable) -> Task:
    labels = table.texts("labels")
    bare = {label.strip() for label in labels} - {""}
    if not bare or len(bare) < len(labels) or not "".join(labels).isprintable():
        raise table.fail("labels", "a list of different, printable texts")
    factors = table.table("factors")
    task = Task(
        labels,
        k=table.whole("k", allowed=range(1, 1 << 31)),
        components=table.whole("components", allowed=range(1 << 31)),
        scaling=table.text("scaling"),
        accuracy=table.number("accuracy", low=0.0, high=1.0),
        projection=table.text("projection"),
        features=table.texts("features"),
        left_out=table.text("left_out"),
        no_contact=table.text("no_contact") if table.has("no_contact") else None,
        factors={f: factors.wholes(f) for f in factors.raw},
    )
    table.done()
    return task
