"""The study's first section: its conclusions in a few sentences."""

from __future__ import annotations

from collections.abc import Sequence

from train.report.section import Numbers, Section, Table
from train.study import beyond, honest
from train.study.context import Context


def section(context: Context, every: Sequence[Numbers]) -> Section:
    """The findings, first among them how well objects never met are recognised."""
    ours = every[0]
    rows, text = [], []
    for task in context.labels:
        nested, majority = (
            ours[honest.TABLE, how, task] for how in (honest.NESTED, honest.MAJORITY)
        )
        unseen = ours.get((honest.TABLE, honest.UNSEEN, task))
        methods = {m: x for (table, m, t), x in ours.items() if (table, t) == (beyond.TABLE, task)}
        best = max(methods, key=methods.__getitem__)
        best_unseen = ours.get((beyond.UNSEEN, best, task))
        rows.append(
            {
                "task": task,
                "a new contact %": nested,
                "an object never met %": "" if unseen is None else unseen,
                "best method %": methods[best],
                "most frequent label %": majority,
            }
        )
        never = "" if unseen is None else f", and one with an object never met {unseen:.0f} %"
        beside = "" if best_unseen is None else f" ({best_unseen:.0f} % for objects never met)"
        better = (
            f"The best of the methods below reaches {methods[best]:.0f} %{beside}: {best}."
            if methods[best] > nested
            else "No method below is better."
        )
        text.append(
            f"{task}: with the paper's features, a new contact with a known object is classified "
            f"correctly {nested:.0f} % of the time{never}. {better}"
        )
    return Section("Findings", text, [Table("findings", "In short", rows, narrow=5)])
