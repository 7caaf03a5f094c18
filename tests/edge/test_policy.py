"""When and how a task is decided."""

from edge.policy import flags_of


def test_only_doubts_that_hold_become_flags_in_their_order():
    doubts = {"short": True, "gap": False, "missing_taxels": True}
    assert flags_of(doubts) == ("short", "missing_taxels")
