"""A fit summed up for a terminal."""

from dataclasses import replace

from edge.decide.summary import UNDOUBTED
from train.report.summary import candidates, details, summary


def test_each_candidate_has_a_row_with_its_accuracies_and_prices(fitted):
    table = candidates(fitted, [(162.04, 31.46)] * len(fitted.candidates))
    heads = ["features", "projection", *fitted.chosen, "us per decision", "kB"]
    assert list(table.frame) == heads
    (row,) = table.rows
    assert (row["us per decision"], row["kB"]) == (162.0, 31.5)
    assert sum("*" in str(cell) for cell in row.values()) == len(fitted.chosen)
    assert UNDOUBTED in summary(fitted)
    lines = details(fitted, [(1.0, 1.0)])
    assert "in newton: max_force" in lines


def test_warnings_come_first_and_what_has_no_room_is_counted(fitted):
    notes = (*(f"note {i}" for i in range(30)), "warning: odd")
    lines = summary(replace(fitted, notes=notes), 12)
    assert len(lines) == 12
    assert lines.index("warning: odd") < lines.index("note 0")
    shown = sum(line.startswith("note ") for line in lines)
    assert lines[-1].startswith(f"{30 - shown} notes more")
