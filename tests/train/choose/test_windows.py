"""The windows that a fit tries."""

import pytest

from train.choose.windows import windows_of


@pytest.mark.parametrize(
    ("seconds", "windows"),
    [
        ([1.0] * 10, (1.2,)),
        ([12.0] * 10, (1.2, 2.4, 4.8, 9.6, 12.0)),
        ([3.0] * 8 + [10.0] * 2, (1.2, 2.4, 4.8, 9.6)),
        ([1.0] * 6 + [10.0] * 4, (1.2,)),
        ([1e4] * 10, (1.2, 2.4, 4.8, 9.6, 19.2, 38.4, 60.0)),
    ],
)
def test_windows_reach_as_far_as_a_tenth_of_the_touches(seconds, windows):
    assert windows_of(seconds) == pytest.approx(windows)
