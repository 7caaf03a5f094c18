"""Parts of a report: percent as the paper prints it, a result with its interval."""

import pytest

from train.report.tables import SCORE, percent, score
from train.study.score import Result


@pytest.mark.parametrize(
    ("share", "printed"), [(0.0, 0.0), (1.0, 100.0), (0.98571, 98.57), (2 / 3, 66.67)]
)
def test_percent_has_two_places(share, printed):
    assert percent(share) == printed


def test_a_score_has_a_cell_for_each_column_of_its_heading():
    searched, plain = score(Result(10, 20, components=3, k=2)), score(Result(10, 20))
    assert len(searched) == len(plain) == len(SCORE)
    assert searched[0] == 50.0
    assert searched[1] < 50.0 < searched[2]
    assert (searched[3:], plain[3:]) == ((2, 3), ("", ""))
