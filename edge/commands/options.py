"""Command-line options that several commands share, and the checks that go with them."""

from __future__ import annotations

import argparse
import logging
import math

from edge.classifier import stopping_rules
from edge.errors import InputError
from edge.model.model import Model
from edge.touch.arm import Chain

LOG = logging.getLogger(__name__)


def seconds(text: str) -> float:
    """The type of an option that takes a duration: a finite number of seconds above 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0, not {text!r}")
    return value


def add_skin(parser: argparse.ArgumentParser) -> None:
    """Add the options that name the skin, real or fake; `source.open_skin` opens it."""
    parser.add_argument("--skin", metavar="skin.toml", help="the file that describes the skin")
    parser.add_argument(
        "--fake",
        metavar="REC.npz",
        help="use no hardware: play this recording onto fake chips, in virtual time; without "
        "--skin, the chips are chosen to suit the recording",
    )
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="play the recording at the speed at which it was recorded",
    )
    parser.add_argument("--loop", action="store_true", help="play the recording over and over")
    parser.add_argument(
        "--seconds",
        type=seconds,
        default=math.inf,
        help="stop after this many seconds (default: never)",
    )


def add_joints(parser: argparse.ArgumentParser) -> None:
    """Add the options that say where joint angles come from; `source.open_joints` opens it."""
    from edge.runtime.joint_stream import OLDEST_S  # a replay needs no sockets

    parser.add_argument(
        "--joints",
        metavar="stdin|udp:[HOST:]PORT",
        help='read joint angles as JSON lines {"t": seconds, "q": [radians]}, with "names": '
        "[joints] if they are not in the arm's order; a port without a host is bound to the "
        "loopback interface",
    )
    parser.add_argument(
        "--joints-oldest",
        type=seconds,
        default=OLDEST_S,
        metavar="SECONDS",
        help="do not use a pose that is older than this (default: %(default)s)",
    )
    parser.add_argument(
        "--joints-shared-clock",
        action="store_true",
        help="the times in the lines are those of this machine's monotonic clock",
    )


def add_arm(parser: argparse.ArgumentParser, use: str) -> None:
    """Add `--arm` and, for a URDF, its two links; `use` completes "the arm that ...".

    `open_arm` reads it.
    """
    parser.add_argument(
        "--arm",
        metavar="arm.toml|arm.urdf",
        help=f"the joints of the arm that carries the skin, {use}",
    )
    parser.add_argument(
        "--base", metavar="LINK", help="in a URDF, the link at which the arm begins"
    )
    parser.add_argument("--tip", metavar="LINK", help="in a URDF, the link that carries the skin")


def open_arm(arguments: argparse.Namespace) -> Chain | None:
    """The arm that the options name, or None.

    Raises:
        InputError: the file describes no chain of joints, or `--base` and `--tip` do not suit it.
    """
    if arguments.arm is None:
        for name in ("base", "tip"):
            if getattr(arguments, name) is not None:
                raise InputError(f"--{name} needs --arm arm.urdf")
        return None
    return Chain.from_file(arguments.arm, arguments.base, arguments.tip)


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option that asks for an error rate; `check_error` checks it against the model."""
    parser.add_argument(
        "--error",
        type=float,
        metavar="RATE",
        help="decide as soon as labels are wrong at most this often (0.1: one in ten); without "
        "it, decide at the end of the window",
    )


def check_error(model: Model, error: float | None) -> None:
    """Refuse an error rate that no task is certified for; warn where a single task is not.

    Raises:
        InputError: it is outside (0, 1), or the model cannot hold it.
    """
    if error is None:
        return
    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            LOG.warning(
                f"{task}: an error of {error:g} cannot be certified, so it is "
                f"decided at the full window: {model.info.stopping[task].refusal(error)}"
            )
        else:
            how = (
                f"always after {model.decision_points_s[rule.last]:g} s"
                if rule.fixed
                else f"at a confidence of {rule.confidence:g} or more, after {rule.mean_s:.2f} s "
                "on average in training"
            )
            LOG.info(f"{task}: decided {how}; at most {rule.error:.1%} wrong")
