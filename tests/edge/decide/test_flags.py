"""The table of flags: the flags of decisions, and the page of formats."""

import pytest

from edge.decide.events import Decided
from edge.decide.flags import FLAGS, in_order
from tests.conftest import ROOT

DECIDED = Decided("mobility", "fixed", 1.0, 1.2, 0.2, 0.3, flags=("tie",))


def test_only_doubts_that_hold_are_flags_in_the_order_of_the_table():
    flagged = DECIDED.flagged(missing_taxels=True, gap=False, short=True)
    assert flagged.flags == ("short", "missing_taxels", "tie")
    assert flagged.flagged(tie=False).flags == ("short", "missing_taxels")


def test_a_flag_that_the_table_lacks_is_no_flag():
    with pytest.raises(ValueError, match="tired"):
        in_order({"tired"})


def test_the_page_of_formats_has_the_table():
    rows = "".join(f"| `{flag}` | {meaning} |\n" for flag, meaning in FLAGS.items())
    assert rows in (ROOT / "docs/formats.md").read_text()
