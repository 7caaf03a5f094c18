"""`python -m export`: recordings to model.onnx and golden.npz (`make export`)."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from edge.cli import dispatch
from edge.commands.options import add_arm, open_arm
from edge.errors import InputError
from edge.touch import measures
from edge.touch.feature_sets import SETS
from edge.touch.features import SAMPLES, WINDOW_S
from export.api import measure, report, save
from train import operating_points
from train.choose import LEAVE_OUT, TRIAL
from train.crossval import jobs_here
from train.fitting import MOST_TRIALS, fit
from train.projection import KINDS
from train.scaling import SCALINGS
from train.stopping import FEWEST

FRONTS = Path("build/tradeoff/front.json")
DECISION_POINTS = "0.2:1.2:0.1"


def parser() -> argparse.ArgumentParser:
    """The command line."""
    top = argparse.ArgumentParser(
        prog="export",
        description="Fits a model for every task that the recordings' labels share, and writes "
        "OUT/model.onnx and OUT/golden.npz. What is not given is chosen per task: the features and "
        "projection of the fewest weights whose accuracy on trials that their fits have not seen "
        "is within a standard error of the best, with the numbers that are best there.",
    )
    top.add_argument(
        "--data", nargs="+", required=True, metavar="REC", help=".npz recordings or folders"
    )
    top.add_argument(
        "--out", type=Path, default=Path("build"), help="folder (default: %(default)s)"
    )
    top.add_argument("--tasks", nargs="+", metavar="TASK", help="only these keys of the labels")
    top.add_argument(
        "--features",
        nargs="+",
        metavar="NAME",
        help=f"what is measured on a contact, instead of choosing: sets ({', '.join(SETS)}) and "
        f"single features, ZONE_QUANTITY of {', '.join(measures.ZONES)} and "
        f"{', '.join(measures.QUANTITIES)}, or {', '.join(measures.ALONE)}",
    )
    top.add_argument(
        "--projection",
        choices=KINDS,
        help="fix the projection: principal components or discriminants",
    )
    top.add_argument(
        "--samples", type=int, default=SAMPLES, help="values of each feature (default: %(default)s)"
    )
    top.add_argument("--scaling", choices=SCALINGS, help="fix the scaling (paper, Eqs. 1 to 5)")
    top.add_argument("--components", type=int, help="fix the number of principal components")
    top.add_argument("-k", "--k", type=int, help="fix the number of neighbours")
    top.add_argument(
        "--leave-out",
        default=LEAVE_OUT,
        metavar="KEY",
        help="label of which whole groups are left out to choose and to score a task, where each "
        f"of its classes has several ({LEAVE_OUT}); `{TRIAL}` leaves out single trials",
    )
    top.add_argument(
        "--quick", action="store_true", help="for a first look: few candidates, five folds"
    )
    top.add_argument(
        "--window",
        type=float,
        help=f"seconds from onset to decide on (default: {WINDOW_S:g}, or more where touches last "
        "longer and the rest of them tells much more)",
    )
    top.add_argument(
        "--decision-points",
        metavar="A:B:STEP",
        help="calibrate decisions before the full window (edge-classify run --error), at these "
        f"seconds from onset or at a list a,b,c; `none` for none (default: {DECISION_POINTS}, or "
        f"fewer in a model that would exceed 1 MB, with {FEWEST} to {MOST_TRIALS} trials)",
    )
    top.add_argument("--threshold", type=int, help="counts above which a taxel is in contact")
    top.add_argument("--onset", type=int, help="counts above which a contact begins")
    top.add_argument(
        "--front",
        metavar="WHAT",
        help="window, features and scaling of a point of `make tradeoff`: fast, balanced, "
        "accurate, milliseconds to decide within, or an accuracy (0 to 1) to reach",
    )
    top.add_argument(
        "--fronts",
        type=Path,
        metavar="front.json",
        help="the file with the points (default: build/tradeoff/front.json, or else those of the "
        "simulated set)",
    )
    add_arm(top, "for recordings whose joint angles name no arm (default: Cody's)")
    top.add_argument("--jobs", type=int, default=jobs_here(), help="processes (default: all cores)")
    top.set_defaults(run=run)
    return top


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and report."""
    window_s, features, scaling = arguments.window, arguments.features, arguments.scaling
    if arguments.front is not None:
        front, point = _of_front(arguments)
        window_s, features = point.window_s, list(point.features)
        scaling = scaling or point.scaling
    points = arguments.decision_points
    if window_s is None and points not in (None, "none"):
        window_s = WINDOW_S
    _check_fixed(arguments, window_s)
    fitted = fit(
        arguments.data,
        features=features,
        projection=arguments.projection,
        scaling=scaling,
        components=arguments.components,
        k=arguments.k,
        window_s=window_s,
        samples=arguments.samples,
        tasks=arguments.tasks,
        leave_out=arguments.leave_out,
        decision_points_s=None
        if points is None
        else parse_decision_points(points, window_s or WINDOW_S),
        threshold=arguments.threshold,
        onset=arguments.onset,
        arm=open_arm(arguments),
        quick=arguments.quick,
        jobs=arguments.jobs,
        progress=True,
    )
    if arguments.front is not None and front.digest != fitted.dataset.digest:
        print(
            "warning: the operating points were measured on other recordings, so their accuracy "
            "and time may not be those of these; `make tradeoff DATA=...` measures yours",
            file=sys.stderr,
        )
    path = arguments.out / "model.onnx"
    size = save(path, fitted)
    print(report(fitted, measure(fitted)), file=sys.stderr)
    print(f"{path} ({size / 1024:.0f} kB)\n{path.with_name('golden.npz')}")
    return 0


def _of_front(
    arguments: argparse.Namespace,
) -> tuple[operating_points.ParetoFront, operating_points.OperatingPoint]:
    """The front, and the operating point of it that was asked for."""
    path = arguments.fronts or FRONTS
    if arguments.fronts is None and not path.exists():
        path = operating_points.SHIPPED
    front = operating_points.ParetoFront.read(path)
    point = front.pick(arguments.front)
    print(
        f"{path}: {arguments.front} is {point.window_s:g} s of {' '.join(point.features)}, scaling "
        f"{point.scaling}: {front.task} {point.accuracy:.1%} in {point.milliseconds:.0f} ms there",
        file=sys.stderr,
    )
    return front, point


def _check_fixed(arguments: argparse.Namespace, window_s: float | None) -> None:
    for name in ("components", "k", "jobs"):
        value = getattr(arguments, name)
        if value is not None and value < 1:
            raise InputError(f"--{name} must be at least 1, not {value}")
    for name in ("threshold", "onset"):
        value = getattr(arguments, name)
        if value is not None and not 0 <= value < 65535:
            raise InputError(f"--{name} must be 0 to 65534 counts, not {value}")
    if not 2 <= arguments.samples <= 1000:
        raise InputError(f"--samples must be 2 to 1000, not {arguments.samples}")
    if window_s is not None and not 0.0 < window_s <= 60.0:
        raise InputError(f"--window must be above 0 and at most 60 seconds, not {window_s}")


def parse_decision_points(text: str, window_s: float) -> tuple[float, ...]:
    """Seconds from onset out of `a:b:step`, `a,b,c` or `none`; the full window comes last.

    Raises:
        InputError: it is none of them, or a decision point is not above 0.
    """
    if text == "none":
        return ()
    wrong = InputError(
        f"--decision-points must be like {DECISION_POINTS} or 0.3,0.6,1.2 (seconds above 0) "
        f"or none, not {text!r}"
    )
    try:
        if ":" in text:
            first, last, step = map(float, text.split(":"))
            if not (0.0 < first <= last <= 60.0 and step >= 0.01):
                raise wrong
            count = int((last - first) / step + 1e-9) + 1
            decision_points = {round(first + i * step, 9) for i in range(count)}
        else:
            decision_points = {float(part) for part in text.split(",")}
    except ValueError:
        raise wrong from None
    if not all(0.0 < decision_point <= 60.0 for decision_point in decision_points):
        raise wrong
    return (
        *sorted(decision_point for decision_point in decision_points if decision_point < window_s),
        window_s,
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 2 bad usage or input."""
    return dispatch(parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
