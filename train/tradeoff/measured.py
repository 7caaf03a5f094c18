"""The measurements that the trade-off's sections show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from edge.touch.features import FEATURES
from train.dataset import DataSet
from train.evaluate import Labels, Result
from train.pipeline import Choice
from train.tradeoff.board import Board
from train.tradeoff.early import NoveltyCount, StoppingComparison
from train.tradeoff.prices import Prices

PAPER = ("none", 1.2)
"""The paper's setting: no scaling, 1.2 s, its three features, all taxels (section IV-A)."""


@dataclass(frozen=True)
class MeasuredPoint:
    """One setting of one task, with its time and its accuracy.

    Attributes:
        task: the task.
        taxels: number of taxels, of the skin itself or of a pooled one.
        wire: name of the wiring.
        features: names of the features.
        scaling: of the features.
        components, k: those most often chosen.
        window_s: time waited from onset.
        wire_s: half a frame's period until the next frame, and that frame on the wire.
        arithmetic_s: from that frame to the decision.
        result: nested accuracy.
        own_skin: whether it is the recordings' own skin, not a pooled one.
    """

    task: str
    taxels: int
    wire: str
    features: tuple[str, ...]
    scaling: str
    components: int
    k: int
    window_s: float
    wire_s: float
    arithmetic_s: float
    result: Result
    own_skin: bool

    @property
    def seconds(self) -> float:
        """Seconds from onset to decision."""
        return self.window_s + self.wire_s + self.arithmetic_s

    @property
    def paper(self) -> bool:
        """Whether it is the paper's setting, on the wire that carries its 100 frames a second."""
        return (
            self.own_skin
            and (self.scaling, self.window_s) == PAPER
            and self.features == FEATURES
            and self.wire.startswith("AD7147, 3")
        )


@dataclass(frozen=True)
class Measured:
    """Accuracies and times of one data set on one board.

    Attributes:
        dataset: contacts followed for the features of `paper` and `contact`.
        y: {task: (n,) labels}, the main task first.
        main: the main task: that of the settings' picture and of front.json.
        board: figures of the machine that decides.
        prices: figures of models of other sizes, if they were measured.
        breakaways: {object: seconds} until static friction breaks; empty without a scene.
        comparisons: {task: deciding early beside fixed windows}.
        choices: {task: features, projection and k chosen by all trials}.
        novelty: how often contacts are called unknown.
        points: every setting of every task.
    """

    dataset: DataSet
    y: Labels
    main: str
    board: Board
    prices: Prices | None
    breakaways: Mapping[str, float]
    comparisons: Mapping[str, StoppingComparison]
    choices: Mapping[str, Choice]
    novelty: Sequence[NoveltyCount]
    points: Sequence[MeasuredPoint]

    @property
    def types(self) -> int:
        """Number of feature types that are measured."""
        return len(self.dataset.names)

    @property
    def arithmetic_s(self) -> float:
        """Seconds of arithmetic of a decision with all the features."""
        return self.board.arithmetic_s(self.types)

    @property
    def wire_s(self) -> float:
        """Seconds from the end of the window until its last frame is read.

        On the wire of the paper's setting, or on the fastest where the skin cannot have that.
        """
        fastest = min(point.wire_s for point in self.points if point.own_skin)
        return next((point.wire_s for point in self.points if point.paper), fastest)
