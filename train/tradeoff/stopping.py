"""The report's sections on deciding early and on contacts unlike any that was trained."""

from __future__ import annotations

from train.report.score import percent, points
from train.report.section import Row, Section, Table
from train.stopping import finest
from train.tradeoff.early import FOLDS
from train.tradeoff.measured import Measured


def section(measured: Measured) -> Section:
    """Deciding early in every task, beside waiting for the full window."""
    board, count = measured.board, len(measured.points)
    decision_us = sum(board.stages_us[stage][0] for stage in ("features", "decision"))
    rows: list[Row] = [
        {
            "task": task,
            "at most wrong %": percent(rule.asked),
            "right %": percent(1.0 - rule.wrong),
            "mean time s": round(rule.mean_s, 3),
            "points beside waiting": points(rule.gain),
            "names nothing %": percent(rule.unknown),
            "decided early %": percent(rule.early),
            "certified in folds": f"{rule.folds} of {FOLDS}",
            "contacts": len(rule.right),
        }
        for task, compared in measured.comparisons.items()
        for rule in compared.certified
        if rule.folds
    ]
    off = (f"{t} {100 * own.calibration_error:.1f}" for t, own in measured.comparisons.items())
    return Section(
        "As soon as it is sure",
        [
            f"{FOLDS} folds are held out in turn; the others choose, train and calibrate. An error "
            "rate is certified where the calibration trials show, with 90 % confidence, that "
            f"decisions are wrong at most this often. {finest(measured.y)} names nothing where a "
            "contact is unlike all trained ones, which counts as wrong; the other tasks are always "
            "decided. Rates that no fold certifies have no row. Some rows hold in some folds only, "
            "so rows of different rates are of different contacts.",
            f"Each decision point is one run of the same graph, {decision_us:.0f} us of features "
            f"and decision on {board.name}. All {count} together take "
            f"{1e-3 * count * decision_us:.1f} ms of arithmetic for a contact, while the program "
            "waits anyway.",
            f"Confidences differ from the share that is right by so many points on average: "
            f"{', '.join(off)}.",
        ],
        [Table("early", "Asked for an error rate", rows, narrow=4)],
    )


def unknown(measured: Measured) -> Section:
    """How often contacts with known and with new objects are called unknown."""
    task = finest(measured.y)
    rows: list[Row] = [
        {
            "novelty rate %": percent(count.novelty_rate),
            "trained trials": count.known,
            "trials of objects left out": count.strange,
            "of them unknown %": percent(count.unknown / count.strange),
        }
        for count in measured.novelty
    ]
    text = (
        f"A third of the labels of {task} is left out entirely, in turn. A contact is unknown "
        "where it lies farther from all training trials, in the space that separates these labels, "
        "than all but a given share of the trained contacts that were held out."
    )
    return Section("Unlike anything trained", [text], [Table("unknown", "Called unknown", rows)])
