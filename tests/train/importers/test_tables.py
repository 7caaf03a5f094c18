"""Cells as numbers; one that is no number is named with its place."""

import pytest

from edge.errors import InputError
from tests.train.importers.test_reading import read
from train.importers.tables import numbers_of


@pytest.mark.parametrize("content", ["t,p1\n0,1\n1,off\n", "t;p1\n0;0,5\n1;off\n"])
def test_a_text_among_numbers_is_named(tmp_path, content):
    table = read(tmp_path, content)
    with pytest.raises(InputError, match=r"'off' in column p1 is no number \(line 3\)"):
        numbers_of(table, "p1")


def test_a_number_beyond_measure_is_named(tmp_path):
    table = read(tmp_path, "t,p1\n0,1\n1," + "9" * 400 + "\n")
    with pytest.raises(InputError, match=r"999' in column p1 is no number \(line 3\)"):
        numbers_of(table, "p1")
