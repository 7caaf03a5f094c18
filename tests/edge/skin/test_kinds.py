"""What a skin file need not say about its chips."""

import pytest

from edge.skin import file as skinfile
from edge.skin.file import parse
from edge.skin.kinds import Usual, usual

MPR121 = """[skin]
rows = 3
cols = 4
{skin}
[signal]
{signal}
[[bus]]
device = 1
kind = "mpr121"
chips = [{{ address = 0x5A, first = [0, 0], block = [3, 4] }}]
"""


def mpr121(skin="", signal=""):
    return parse(MPR121.format(skin=skin, signal=signal))


def test_an_mpr121_that_says_nothing_works():
    """Its values fall with a touch, and a touch takes some tens of its 10 bits."""
    file = mpr121()
    assert file.chips[0].sign == -1
    assert (file.layout.threshold_counts, file.layout.onset) == (8, 16)
    shipped = skinfile.load(skinfile.shipped("mpr121"))
    assert file.signal == shipped.signal
    assert (file.layout.threshold_counts, file.layout.onset) == (
        shipped.layout.threshold_counts,
        shipped.layout.onset,
    )


def test_what_the_file_says_counts():
    file = mpr121("threshold_counts = 20", "sign = 1\ndead_band_counts = 1")
    assert file.chips[0].sign == 1
    assert (file.layout.threshold_counts, file.layout.onset) == (20, 20)
    assert file.signal.dead_band_counts == 1


def test_kinds_that_differ_leave_only_what_holds_for_any():
    chips = [{"kind": "mpr121"}, {"kind": "ad7147"}]
    assert usual({"bus": [{"chips": chips}]}) == Usual()


@pytest.mark.parametrize("raw", [{}, {"bus": 1}, {"bus": [1]}, {"bus": [{"chips": [1, {}]}]},
                                 {"bus": [{"kind": [], "chips": [{}]}]}])  # fmt: skip
def test_a_file_that_makes_no_sense_is_left_to_its_reader(raw):
    assert usual(raw) == Usual()


def test_chips_of_two_kinds_have_each_its_own_sign():
    text = MPR121.format(skin="threshold_counts = 5", signal="").replace("rows = 3", "rows = 6")
    more = '[[bus]]\ndevice = 2\nkind = "block"\n'
    file = parse(text + more + "chips = [{ address = 0x28, first = [3, 0], block = [3, 4] }]")
    assert [chip.sign for chip in file.chips] == [-1, 1]
