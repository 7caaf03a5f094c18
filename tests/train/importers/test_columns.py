"""What the columns of a table are taken for, and what is asked instead of guessed."""

import numpy as np
import pandas as pd
import pytest

from edge.errors import InputError
from train.importers.columns import meaning, times_of
from train.importers.options import TableOptions
from train.importers.table import Table

COUNTS = np.arange(5)


def table(*names, **columns):
    data = pd.DataFrame(dict.fromkeys(names, COUNTS) | columns)
    return Table("a.csv", data)


def sense_of(source, **words):
    return meaning(source, TableOptions(**words))


@pytest.mark.parametrize(
    "form", ["taxel_{}_{}", "taxel{}x{}", "taxel[{}][{}]", "taxel[{}, {}]"]
)
def test_taxels_with_a_row_and_a_column_tell_the_shape(form):
    names = [form.format(row, col) for col in range(3) for row in range(2)]
    sense = sense_of(table(*names), rate=10)
    assert sense.shape == (2, 3)
    assert sense.taxels[:3] == [form.format(0, col) for col in range(3)]


@pytest.mark.parametrize("names", [["taxel_0_0"], ["tactile1", "tactile2"]])
def test_columns_that_are_called_taxels_are_taken_beside_other_running_numbers(names):
    joints = ["joint_1", "joint_2"]
    sense = sense_of(table(*joints, *names), rate=10)
    assert sense.taxels == names
    assert sense.left_out == joints


@pytest.mark.parametrize(
    ("wishes", "sentence"),
    [
        ({"taxels": "s3"}, r"a.csv: has no column s3; it has \['t', 's1', 's2'\]"),
        ({"taxels": "s1,s1"}, "named twice"),
        ({"taxels": "s1-s2", "joints": "s2"}, "both as a taxel and as time"),
        ({"time": "s1,s2"}, "--time names several columns"),
    ],
)
def test_contradictions_are_refused(wishes, sentence):
    with pytest.raises(InputError, match=sentence):
        sense_of(table("t", "s1", "s2"), time_unit="s", **wishes)


def test_a_rate_is_taken_before_a_column_and_one_of_them_is_needed():
    sense = sense_of(table("t", "s1"), rate=10)
    assert sense.time is None
    assert sense.left_out == ["t"]
    with pytest.raises(InputError, match="give --rate"):
        sense_of(table("s1"))


@pytest.mark.parametrize(
    ("name", "step", "unit"),
    [
        ("t", 0.01, "s"),
        ("t", 10.0, "ms"),
        ("t", 1e7, "ns"),
        ("time_ms", 0.5, "ms"),
        ("timestamp (us)", 1.0, "us"),
        ("millis", 0.01, "ms"),
        ("Elapsed Time (s)", 0.01, "s"),
        ("ts", 0.01, "s"),
    ],
)
def test_a_time_and_its_unit_come_from_a_name_or_steps(name, step, unit):
    sense = sense_of(table("s1", **{name: COUNTS * step}))
    assert sense.time == name
    assert sense.unit == unit
    seconds = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    times = times_of(table("s1", **{name: COUNTS * step}), sense, TableOptions())
    assert times == pytest.approx(COUNTS * step * seconds)


@pytest.mark.parametrize("start", ["01.03.2024 9:", "12:", ""])
def test_times_of_the_day_are_times_whatever_their_column_is_called(start):
    dates = [f"{start}00:00.{i}00" for i in range(5)]
    source = table("s1", zeit=dates)
    sense = sense_of(source)
    assert sense.unit == "iso"
    assert times_of(source, sense, TableOptions()) == pytest.approx(0.1 * COUNTS)


def test_what_is_no_date_is_named():
    source = table("s1", t=["2024-03-01T10:00", "noon", None, None, None])
    with pytest.raises(
        InputError, match=r"'noon' in column t is no time of the day \(row 2"
    ):
        times_of(source, sense_of(source, time_unit="iso"), TableOptions())


def test_a_line_says_what_was_taken():
    source = table("t", *(f"p{i}" for i in range(1, 17)), "label", "column 3")
    sense = sense_of(source, time_unit="ms")
    assert sense.text((4, 4)) == (
        'time: "t" in ms (as said), taxels: "p1" to "p16" (16, as 4 x 4)'
    )


def test_of_two_times_the_finer_is_taken():
    assert sense_of(table("s1", time=COUNTS // 3, millis=10 * COUNTS)).time == "millis"
