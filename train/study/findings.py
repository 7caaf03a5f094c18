"""The study's first section: what its other sections found, in a few sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from train.report.tables import Section, Table

UNSEEN = "objects not met before"


def _rows(sections: Sequence[Section], name: str) -> list[dict[str, Any]]:
    """The rows of a table by its name, as {column: cell}; none where it is not there."""
    for section in sections:
        for table in section.tables:
            if table.name == name:
                return [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    return []


def section(sections: Sequence[Section]) -> Section:
    """The findings; first what an owner needs most: how well objects never met are recognised."""
    honest = _rows(sections, "honest")
    beyond = _rows(sections, "beyond_sets")
    table = Table(
        "findings",
        "In short",
        (
            "task",
            "a new contact %",
            "an object never met %",
            "best found %",
            "most frequent label %",
        ),
        narrow=5,
    )
    text = []
    for task in dict.fromkeys(row["task"] for row in honest):
        by = {row["how"]: row["accuracy %"] for row in honest if row["task"] == task}
        best = max(
            (row for row in beyond if row["task"] == task),
            key=lambda row: row["accuracy %"],
            default=None,
        )
        unseen = by.get(UNSEEN, "")
        top = "" if best is None else best["accuracy %"]
        table.rows.append((task, by["nested"], unseen, top, by["majority"]))
        sentence = (
            f"{task}: with the paper's features a new contact with a known object is right "
            f"{by['nested']:.0f} % of the time"
        )
        if unseen != "":
            sentence += f", one with an object never met {unseen:.0f} %"
        if best is not None:
            sentence += (
                f"; the best found here is {best['accuracy %']:.0f} %, {best['what decides']}"
            )
            if best["objects not met %"] != "":
                sentence += f" ({best['objects not met %']:.0f} % for objects never met)"
        text.append(sentence + ".")
    for part in sections:
        for found in part.text:
            if " numbers lie within the" in found:
                text.append(found.split(". ")[0] + " (see below).")
    return Section("Findings", text, [table])
