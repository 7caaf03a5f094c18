"""The options of a fit, each written once: its name, type, range and help."""

import argparse
import re
from collections.abc import Sequence
from dataclasses import Field, dataclass, field, fields
from typing import Any

from joblib import cpu_count

from edge.app.options import within
from edge.features.quantities import ALONE, OF_ZONES
from edge.features.vector import SAMPLES, WINDOW_S
from edge.features.zones import ZONES
from edge.touch.arm import Chain
from train.data.feature_sets import SETS
from train.data.groups import LEAVE_OUT, TRIAL
from train.model.projection import KINDS
from train.model.scaling import SCALINGS
from train.model.stopping import FEWEST

SECOND_WORTH = 0.005
"""Accuracy that is worth a second of waiting."""
DECISION_POINTS = "0.2:1.2:0.1"
LONGEST_S = 60.0
"""Longest window, and longest time that a contact may be away."""
count = within(int, 1, 1_000_000)
counts = within(int, 0, 65534)
seconds = within(float, 0.01, LONGEST_S)
"""The types of options that take a whole number, counts of a taxel, or seconds."""


def taxel(text: str) -> tuple[int, int]:
    """The row and column of a taxel.

    Raises:
        ArgumentTypeError: the text is no taxel.
    """
    place = re.fullmatch(r"([0-9]{1,4}),([0-9]{1,4})", text)
    if place is None:
        raise argparse.ArgumentTypeError(
            f"must be ROW,COL, such as 3,5, not {text[:40]!r}"
        )
    return int(place[1]), int(place[2])


def option(default: Any, text: str, flags: str | None = "", **how: Any) -> Any:
    """A field with its help, and how argparse takes it: by its own name, or by other
    `flags`; None for an option of `train.fit` alone."""
    return field(default=default, metadata={"help": text, "flags": flags, **how})


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """Settings that a fit holds fixed; it chooses those that are None."""

    tasks: Sequence[str] | None = option(
        None,
        "keys of the labels to decide (default: all that the recordings share)",
        nargs="+",
        metavar="TASK",
    )
    features: Sequence[str] | None = option(
        None,
        f"features to measure, instead of a choice: sets ({', '.join(SETS)}) and single "
        f"features, ZONE_QUANTITY of {', '.join(ZONES)} and "
        f"{', '.join(OF_ZONES)}, or {', '.join(ALONE)}",
        nargs="+",
        metavar="NAME",
    )
    projection: str | None = option(
        None, "projection: principal components or discriminants", choices=KINDS
    )
    scaling: str | None = option(
        None, "scaling (paper, Eqs. 1 to 5; or by column)", choices=SCALINGS
    )
    components: int | None = option(None, "number of principal components", type=count)
    k: int | None = option(None, "number of neighbours", "-k --k", type=count)
    leave_out: str = option(
        LEAVE_OUT,
        "label whose groups are held out to choose the settings of a task and to "
        "measure its accuracy, where each of its classes has several groups (default: "
        f"{LEAVE_OUT}); `{TRIAL}` holds out single trials",
        metavar="KEY",
    )
    quick: bool = option(
        False, "few candidates and five folds, for a first look", action="store_true"
    )
    skip_damaged: bool = option(
        False,
        "recordings that cannot be read are named and left out",
        action="store_true",
    )
    window_s: float | None = option(
        None,
        "seconds from onset that a decision is based on (default: "
        f"{WINDOW_S:g}, or more if touches last longer and the gain is worth the wait)",
        "--window",
        type=seconds,
    )
    second_worth: float = option(
        SECOND_WORTH,
        "accuracy that a second of waiting is worth where the window is chosen "
        f"(default: {SECOND_WORTH:g})",
        type=within(float, 0.0, 1.0),
    )
    decision_points_s: Sequence[float] | None = option(
        None,
        "seconds from onset at which decisions before the full window are calibrated "
        "(edge-classify run --error), as a range or a list a,b,c, or `none` (default: "
        f"{DECISION_POINTS} from {FEWEST} trials on, and fewer points if the model would "
        "exceed 2 MB)",
        "--decision-points",
        metavar="A:B:STEP",
    )
    threshold: int | None = option(
        None, "counts above which a taxel is in contact", type=counts
    )
    onset: int | None = option(None, "counts above which a contact begins", type=counts)
    release: float | None = option(
        None,
        "seconds that a contact may be away and go on (default: the skin's, or longer "
        "if many touches are fragmented and that is much more accurate)",
        type=seconds,
    )
    dead: Sequence[tuple[int, int]] = option(
        (),
        "broken taxels that are ignored, counted from 0",
        nargs="+",
        type=taxel,
        metavar="ROW,COL",
    )
    jobs: int | None = option(None, "processes (default: all cores)", type=count)
    samples: int = option(SAMPLES, "values of a feature", None)
    arm: Chain | None = option(None, "arm of joint angles that name none", None)  # noqa: RUF009
    progress: bool = option(False, "progress bars on stderr", None)

    @property
    def asks(self) -> bool:
        """Whether features or a projection are asked for."""
        return self.features is not None or self.projection is not None

    def thorough(self, kind: str) -> bool:
        """Whether more numbers are tried, as features are asked for by name."""
        return self.features is not None and kind == "pca"

    @property
    def processes(self) -> int:
        """Number of processes."""
        return self.jobs or cpu_count()

    @property
    def fixed_window_s(self) -> float | None:
        """The window that is asked for; None where it is to be chosen."""
        if self.window_s is None and self.decision_points_s:
            return self.decision_points_s[-1]
        return self.window_s


OF_COMMAND: tuple[Field[Any], ...] = tuple(
    of_fit for of_fit in fields(FitOptions) if of_fit.metadata["flags"] is not None
)
"""The options of a fit that `edge-classify export` takes."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a fit, under the names of their fields."""
    for of_fit in OF_COMMAND:
        how = dict(of_fit.metadata)
        flags = how.pop("flags") or f"--{of_fit.name.replace('_', '-')}"
        how |= {"dest": of_fit.name, "default": of_fit.default}
        parser.add_argument(*flags.split(), **how)


def described() -> str:
    """A line of a docstring for each option."""
    lines = (f"    {of.name}: {of.metadata['help']}." for of in fields(FitOptions))
    return "\n".join(lines)
