"""`python -m export`: recordings to model.onnx and golden.npz (`make export`)."""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np

from edge import __version__
from edge.cli import dispatch
from edge.commands.options import add_arm, open_arm
from edge.errors import InputError
from edge.files import write_whole
from edge.model.model import Model, ModelInfo, Task
from edge.touch import measures
from edge.touch.features import FEATURES, SAMPLES, WINDOW_S
from export import golden
from export.graph import to_onnx
from train import operating_points
from train.crossval import Chosen, choose, jobs_here
from train.dataset import DataSet, load_trials
from train.pipeline import ContactClassifier
from train.projection import CLOSE_EIGENVALUES, SCALINGS, check_columns
from train.stopping import FEWEST, SequentialClassifier

FRONTS = Path("build/tradeoff/front.json")
DECISION_POINTS = "0.2:1.2:0.1"
MOST_TRIALS = 2000
"""Beyond them calibration takes minutes, and must be asked for."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    top = argparse.ArgumentParser(
        prog="export",
        description="Fits scaler, PCA and k-NN for every task that the recordings' labels share, "
        "and writes OUT/model.onnx and OUT/golden.npz. What is not given is chosen per task by "
        "leave-one-out accuracy, the smallest model where several are equal.",
    )
    top.add_argument(
        "--data", nargs="+", required=True, metavar="REC", help=".npz recordings or folders"
    )
    top.add_argument("--out", type=Path, default=Path("build"), help="folder (build)")
    top.add_argument("--tasks", nargs="+", metavar="TASK", help="only these keys of the labels")
    top.add_argument(
        "--features",
        nargs="+",
        default=list(FEATURES),
        metavar="NAME",
        help="what is measured on a contact (the paper's max_force contact_area contact_motion); "
        f"others: PLACE_QUANTITY, of {', '.join(measures.ZONES)} and "
        f"{', '.join(measures.QUANTITIES)}; regions, force_motion; with _rate: a second's change",
    )
    top.add_argument(
        "--samples", type=int, default=SAMPLES, help=f"values a feature has ({SAMPLES})"
    )
    top.add_argument("--scaling", choices=SCALINGS, help="fix the scaling (paper, Eqs. 1 to 5)")
    top.add_argument("--components", type=int, help="fix the number of principal components")
    top.add_argument("-k", "--k", type=int, help="fix the number of neighbours")
    top.add_argument("--window", type=float, default=WINDOW_S, help="seconds from onset (1.2)")
    top.add_argument(
        "--decision-points",
        metavar="A:B:STEP",
        help="calibrate decisions before the full window (edge-classify run --error), at these "
        f"seconds from onset or at a list a,b,c; `none` for none (default: {DECISION_POINTS} with "
        f"{FEWEST} to {MOST_TRIALS} trials, else none)",
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
        help="where the points are (build/tradeoff/front.json; where there is none, those of the "
        "simulated set)",
    )
    add_arm(top, "for recordings whose joint angles name no arm (default: Cody's)")
    top.add_argument("--jobs", type=int, default=jobs_here(), help="processes (all cores)")
    top.set_defaults(run=run)
    return top


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and report."""
    if arguments.front is not None:
        _take_front(arguments)
    _check_fixed(arguments)
    dataset = load_trials(
        arguments.data,
        threshold=arguments.threshold,
        onset=arguments.onset,
        horizon_s=arguments.window,
        features=arguments.features,
        arm=open_arm(arguments),
        progress=True,
    )
    tasks = _tasks(dataset, arguments.tasks)
    X = dataset.features(arguments.window, arguments.samples)
    y = {task: dataset.labels(task) for task in tasks}
    chosen = choose(
        X,
        y,
        scalings=SCALINGS if arguments.scaling is None else [arguments.scaling],
        components=arguments.components,
        k=arguments.k,
        features=dataset.names,
        jobs=arguments.jobs,
        progress=True,
    )
    choices = {task: found.choice for task, found in chosen.items()}
    decision_points = _decision_points(arguments, len(dataset.trials))
    if decision_points:
        at_decision_points = np.stack(
            [dataset.features(s, arguments.samples) for s in decision_points]
        )
        sequential = SequentialClassifier(
            choices, decision_points, dataset.names, jobs=arguments.jobs
        ).fit(at_decision_points, y)
        classifier = sequential.decision_points_[-1]
    else:
        sequential = None
        classifier = ContactClassifier(choices, dataset.names).fit(X, y)
    info = describe(dataset, classifier, chosen, arguments.window, arguments.samples, sequential)
    data = to_onnx(sequential or classifier, info)
    path = arguments.out / "model.onnx"
    with write_whole(path) as file:
        file.write(data)
    golden.write(arguments.out / "golden.npz", Model(path), dataset, X)
    print(report(dataset, classifier, chosen), file=sys.stderr)
    print(f"{path} ({len(data) / 1024:.0f} kB)\n{arguments.out / 'golden.npz'}")
    return 0


def _take_front(arguments: argparse.Namespace) -> None:
    """Set what a point of the front says, where the options do not."""
    path = arguments.fronts or FRONTS
    if arguments.fronts is None and not path.exists():
        path = operating_points.SHIPPED
    front = operating_points.ParetoFront.read(path)
    point = front.pick(arguments.front)
    arguments.window, arguments.features = point.window_s, list(point.features)
    print(
        f"{path}: {arguments.front} is {point.window_s:g} s of {' '.join(point.features)}, scaling "
        f"{point.scaling}: {front.task} {point.accuracy:.1%} in {point.milliseconds:.0f} ms there",
        file=sys.stderr,
    )
    if arguments.scaling is None:
        arguments.scaling = point.scaling


def _check_fixed(arguments: argparse.Namespace) -> None:
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
    check_columns(len(arguments.features) * arguments.samples)
    if not 0.0 < arguments.window <= 60.0:
        raise InputError(f"--window must be above 0 and at most 60 seconds, not {arguments.window}")


def _decision_points(arguments: argparse.Namespace, trials: int) -> tuple[float, ...]:
    """The decision points asked for, or the default ones where they can be calibrated."""
    if arguments.decision_points is not None:
        return parse_decision_points(arguments.decision_points, arguments.window)
    if FEWEST <= trials <= MOST_TRIALS:
        return parse_decision_points(DECISION_POINTS, arguments.window)
    print(
        f"no decision points before the full window: {trials} trials are not the {FEWEST} "
        f"to {MOST_TRIALS} that --decision-points takes by default",
        file=sys.stderr,
    )
    return ()


def parse_decision_points(text: str, window_s: float) -> tuple[float, ...]:
    """Seconds from onset out of `a:b:step`, `a,b,c` or `none`; the full window comes last.

    Raises:
        InputError: it is none of them, or a look is not above 0.
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


def _tasks(dataset: DataSet, wanted: list[str] | None) -> tuple[str, ...]:
    if wanted is None:
        return dataset.tasks
    missing = [task for task in wanted if task not in dataset.tasks]
    if missing:
        raise InputError(
            f"not every recording has a label {missing[0]!r}; all have {', '.join(dataset.tasks)}"
        )
    return tuple(wanted)


def describe(
    dataset: DataSet,
    classifier: ContactClassifier,
    chosen: dict[str, Chosen],
    window_s: float,
    samples: int = SAMPLES,
    sequential: SequentialClassifier | None = None,
) -> ModelInfo:
    """The metadata that makes the model file describe itself."""
    return ModelInfo(
        tasks={
            task: Task(
                labels=tuple(map(str, classifier.classes_[task])),
                k=found.choice.k,
                components=classifier.components_[task],
                scaling=found.choice.scaling,
                accuracy=found.accuracy,
            )
            for task, found in chosen.items()
        },
        layout=dataset.layout,
        tracking=dataset.tracking,
        window_s=window_s,
        samples=samples,
        features=dataset.names,
        units=dataset.units,
        motion_frame="skin" if dataset.chain is None else "world",
        chain=dataset.chain,
        joints=dataset.joints,
        rows=len(dataset.trials),
        data_digest=dataset.digest,
        versions={
            "edge-classify": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scikit-learn", "skl2onnx", "onnx")},
        },
        decision_points_s=() if sequential is None else tuple(sequential.decision_points_s),
        stopping={} if sequential is None else sequential.stopping_,
        novelty=None if sequential is None else sequential.novelty_,
    )


def report(dataset: DataSet, classifier: ContactClassifier, chosen: dict[str, Chosen]) -> str:
    """What was fitted, a line a task, and what deserves a warning."""
    lines = [f"{'task':<12} classes trials scaling components   k  leave-one-out"]
    lines += [
        f"{task:<12} {len(classifier.classes_[task]):>7} {len(dataset.trials):>6} "
        f"{found.choice.scaling:>7} {classifier.components_[task]:>10} {found.choice.k:>3} "
        f"{found.accuracy:>14.2%}"
        for task, found in chosen.items()
    ]
    lines.append(", ".join(f"{name} in {unit}" for name, unit in dataset.units.items()))
    if any(measures.feature(name).moves for name in dataset.names):
        lines.append(f"motion in the {'skin' if dataset.chain is None else 'world'}'s frame")
    if dataset.untouched:
        lines.append(
            f"left out: {len(dataset.untouched)} recordings without a contact above "
            f"{dataset.layout.onset} counts, the first {dataset.untouched[0]}"
        )
    for task, found in chosen.items():
        dropped = found.choice.components - classifier.components_[task]
        if dropped > 0:
            lines.append(
                f"warning: {task}: the trials span {classifier.components_[task]} components, "
                f"{dropped} fewer than asked for"
            )
        projection = classifier.projections_[found.choice.space(task)]
        if projection.gap_ < CLOSE_EIGENVALUES:
            lines.append(
                f"warning: {task}: two components explain the same variance to within "
                f"{projection.gap_:.1e}; which of them is kept is arbitrary"
            )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 2 bad usage or input."""
    return dispatch(parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
