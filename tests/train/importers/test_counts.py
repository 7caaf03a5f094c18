"""Values as counts: their rest, their scale, and what is no count."""

import argparse

import numpy as np
import pytest

from edge.errors import InputError
from train.importers.counts import Rest, Trial, rest_of, shape_of_skin


def options(**given):
    usual = {"falls": False, "signed": False, "scale": 1.0}
    return argparse.Namespace(**{**usual, **given})


def trial(*rows, shear=None) -> Trial:
    """A frame of some taxels each 10 ms."""
    t = 5.0 + 0.01 * np.arange(len(rows))
    values = np.array(rows, dtype=float)[..., None]
    if shear is not None:
        values = np.concatenate([values, shear], axis=2)
    return Trial("a.csv", t, values)


def recorded(rest, trial):
    """A recording of one row of taxels."""
    return rest.recording(trial, (1, trial.values.shape[1]), {})


def test_counts_stay_as_they_are():
    counted = recorded(rest_of([trial([0, 5], [7, 9])], options()), trial([0, 5]))
    assert counted.frames.tolist() == [[[0, 5]]]
    assert counted.valid is None
    assert counted.shear is None
    assert counted.t.tolist() == [0.0]
    assert counted.meta == {"skin": {"rows": 1, "cols": 2}}


def test_values_that_fall_are_subtracted_from_the_quietest_start():
    first = trial([100, 90], [100, 90], [100, 90], [60, 90])
    touched = trial([50, 90], [50, 90], [50, 90], [40, 90])
    rest = rest_of([touched, first], options(falls=True))
    assert rest.values.tolist() == [[100], [90]]
    assert recorded(rest, first).frames[3].tolist() == [[40, 0]]


def test_signed_values_count_their_distance_with_all_their_digits():
    values = trial([0.5, -1.0], [0.5, -1.0], [0.5, -1.0], [0.25, -1.5])
    rest = rest_of([values], options(signed=True))
    assert rest.scale == 100.0
    assert recorded(rest, values).frames[3].tolist() == [[25, 50]]
    assert recorded(rest, values).meta["values"] == {
        "counts_per_unit": 100.0,
        "rest": [0.5, -1.0],
    }


def test_shear_loses_its_rest_where_the_normal_does():
    shear = np.array([[[3.0, -4.0]]] * 3 + [[[5.0, -10.0]]])
    values = trial([1], [1], [1], [2], shear=shear)
    signed = recorded(rest_of([values], options(signed=True)), values)
    assert signed.shear[3].tolist() == [[[2, -6]]]
    assert signed.meta["skin"]["axes"] == 3
    plain = recorded(rest_of([values], options()), values)
    assert plain.shear[3].tolist() == [[[5, -10]]]


def test_a_missing_value_is_not_valid():
    counted = recorded(Rest(), trial([1, np.nan]))
    assert counted.valid.tolist() == [[[True, False]]]
    assert counted.frames.tolist() == [[[1, 0]]]


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
def test_a_taxel_without_one_of_its_axes_is_not_valid(unknown):
    shear = np.array([[[1.0, 2.0], [unknown, 4.0], [5.0, 6.0]]])
    values = trial([7, 8, 9], shear=shear)
    counted = recorded(Rest(), values)
    assert counted.valid.tolist() == [[[True, False, True]]]
    assert counted.frames.tolist() == [[[7, 0, 9]]]
    assert counted.shear.tolist() == [[[[1, 2], [0, 0], [5, 6]]]]


def test_a_taxel_without_a_value_at_rest_is_never_valid():
    rest = Rest(np.array([[1.0], [np.nan]]))
    counted = recorded(rest, trial([3, 4], [5, 6]))
    assert counted.valid.tolist() == [[[True, False]], [[True, False]]]
    assert counted.frames.tolist() == [[[2, 0]], [[4, 0]]]


@pytest.mark.parametrize(
    ("values", "hint"),
    [([-1.0], "see --signed, --falls"), ([0.5], "see --falls"), ([7e4], "see --falls")],
)
def test_what_is_no_count_is_refused(values, hint):
    with pytest.raises(InputError, match=rf"a.csv: .* are no counts .*; {hint}"):
        recorded(Rest(), trial(values))


def test_values_cannot_fall_and_be_signed():
    with pytest.raises(InputError, match="exclude each other"):
        rest_of([trial([1])], options(falls=True, signed=True))


def test_a_taxel_without_a_shear_at_rest_is_never_valid():
    shear = np.array([[[1.0, 2.0], [np.nan, 4.0]]] + 3 * [[[3.0, 4.0], [5.0, 6.0]]])
    values = trial([1, 1], [1, 1], [1, 1], [2, 2], shear=shear)
    counted = recorded(rest_of([values], options(signed=True)), values)
    assert counted.valid.tolist() == [[[True, False]]] * 4
    assert counted.shear[3].tolist() == [[[0, 0], [0, 0]]]


def test_values_that_are_all_missing_at_rest_have_no_scale():
    values = trial([1.0], [np.nan], [5.0])
    rest = rest_of([values], options(signed=True))
    assert rest.scale == 1.0
    assert recorded(rest, values).valid.tolist() == [[[False]]] * 3


def test_a_shape_is_rows_and_columns():
    assert shape_of_skin("16x24") == (16, 24)


@pytest.mark.parametrize("text", ["16", "x", "axb", "16x", f"{'1' * 5000}x2", "²x2"])
def test_another_text_is_no_shape(text):
    with pytest.raises(argparse.ArgumentTypeError, match="must be ROWSxCOLS"):
        shape_of_skin(text)
