"""The sample of small changes: as many of each kind, and the same ones while edge/ changes."""

from collections import Counter
from dataclasses import replace

from tests.mutation import sample


def test_a_change_elsewhere_draws_at_most_itself_anew(monkeypatch):
    every = sample.changes()
    before = sample.drawn(200, 2012)
    assert Counter(change.kind for change in before) == dict.fromkeys(sample.KINDS, 50)
    moved = [replace(one, line=one.line + 3) for one in every if one.file != "edge/cli.py"]
    monkeypatch.setattr(sample, "changes", lambda: moved)
    kept = {(one.file, one.old, one.new) for one in sample.drawn(200, 2012)}
    assert {(one.file, one.old, one.new) for one in before if one.file != "edge/cli.py"} <= kept
