"""Values as counts: their rest, their scale, and what is no count."""

import argparse

import numpy as np
import pytest

from edge.errors import InputError
from train.importers.counts import Rest, Samples, rest_of
from train.importers.options import ValueOptions, shape_of_skin

NAN = float("nan")


def trial(*rows, shear=None) -> Samples:
    """A frame of some taxels each 10 ms."""
    t = 5.0 + 0.01 * np.arange(len(rows))
    values = np.array(rows, dtype=float)[..., None]
    if shear is not None:
        values = np.concatenate([values, shear], axis=2)
    return Samples("a.csv", t, values)


def recorded(rest, trial):
    """A recording of one row of taxels."""
    return rest.recording(trial, (1, trial.values.shape[1]), {})


def signed(trial):
    """The recording of a trial whose values rise and fall."""
    return recorded(rest_of([trial], ValueOptions(signed=True)), trial)


def test_counts_stay_as_they_are():
    counted = recorded(rest_of([trial([0, 5], [7, 9])], ValueOptions()), trial([0, 5]))
    assert counted.frames.tolist() == [[[0, 5]]]
    assert counted.valid is None
    assert counted.shear is None
    assert counted.t.tolist() == [0.0]
    assert counted.meta == {"skin": {"rows": 1, "cols": 2}}


def test_values_that_fall_are_subtracted_from_the_quietest_start(capsys):
    quiet = trial([100, 90], [100, 90], [100, 90], [60, 90], [100, 120])
    touched = trial([50, 90], [50, 90], [50, 90], [40, 90])
    rest = rest_of([touched, quiet], ValueOptions(falls=True))
    assert rest.values.tolist() == [[100], [90]]
    assert "by up to 30, count as 0; see --signed" in capsys.readouterr().out
    assert recorded(rest, quiet).frames[3].tolist() == [[40, 0]]


@pytest.mark.parametrize("kind", ["falls", "signed"])
def test_a_start_with_a_missing_value_is_not_the_quietest(kind, capsys):
    incomplete = trial([100, NAN], [100, 90], [100, 90])
    complete = trial([90, 80], [90, 80], [90, 80])
    rest = rest_of([incomplete, complete], ValueOptions(**{kind: True}))
    assert rest.values.tolist() == [[90], [80]]
    output = capsys.readouterr().out
    assert "missing: 1 value" in output
    assert "at rest, which is never" not in output


def test_signed_values_count_their_distance_with_all_their_digits():
    counted = signed(trial([0.5, -1.0], [0.5, -1.0], [0.5, -1.0], [0.25, -1.5]))
    assert counted.frames[3].tolist() == [[25, 50]]
    values = {"counts_per_unit": 100.0, "rest": [0.5, -1.0]}
    assert counted.meta["values"] == values


def test_shear_loses_its_rest_where_the_normal_does():
    """A taxel whose shear is 3 and -4 at rest."""
    shear = np.full((4, 1, 2), [3.0, -4.0])
    shear[3] = [5.0, -10.0]
    counted = signed(trial([1], [1], [1], [2], shear=shear))
    assert counted.shear[3].tolist() == [[[2, -6]]]
    assert counted.meta["skin"]["axes"] == 3


@pytest.mark.parametrize("unknown", [NAN, np.inf])
def test_a_taxel_without_one_of_its_axes_is_not_valid(unknown):
    shear = np.arange(1.0, 7.0).reshape(1, 3, 2)
    shear[0, 1, 0] = unknown
    counted = recorded(Rest(), trial([7, 8, 9], shear=shear))
    assert counted.valid.tolist() == [[[True, False, True]]]
    assert counted.frames.tolist() == [[[7, 0, 9]]]
    assert counted.shear.tolist() == [[[[1, 2], [0, 0], [5, 6]]]]


def test_a_taxel_without_a_value_at_rest_is_never_valid():
    rest = Rest(np.array([[1.0], [NAN]]))
    counted = recorded(rest, trial([3, 4], [5, 6]))
    assert counted.valid[:, 0].tolist() == 2 * [[True, False]]
    assert counted.frames[:, 0].tolist() == [[2, 0], [4, 0]]


def test_values_that_are_all_missing_at_rest_have_no_scale(capsys):
    counted = signed(trial([1.0], [NAN], [5.0]))
    assert "1 taxel without a value at rest" in capsys.readouterr().out
    assert counted.meta["values"] == {"counts_per_unit": 1.0, "rest": [None]}
    assert not counted.valid.any()


@pytest.mark.parametrize(
    ("values", "options"),
    [
        ([-1.0, 5.0], "--missing -1"),
        ([-1.5, 2.0], "--signed"),
        ([0.5], "--scale 10"),
        ([7e4], "--scale 0.936214"),
        ([0.25, 1.0, -999.0, 4095.0], "--missing 4095 --missing -999 --scale 100"),
    ],
)
def test_the_options_that_values_lack_are_named_at_once(values, options):
    with pytest.raises(InputError, match=rf"a.csv: .*; add {options}, or see --falls"):
        rest_of([trial(values)], ValueOptions())


def test_a_trial_that_is_unlike_most_is_refused_by_itself():
    odd = trial([-1, 900])
    rest = rest_of([odd, trial([0, 5]), trial([7, 9])], ValueOptions())
    with pytest.raises(InputError, match="add --missing -1, or see"):
        recorded(rest, odd)


def test_a_number_that_stands_for_missing_values_is_named_and_may_be_told(capsys):
    touch = trial([0, 65535], [900, 5], [-1, 7])
    rest_of([touch, trial([65534, 3]), trial([4, 3])], ValueOptions())
    assert "--missing -1" in capsys.readouterr().out
    touch = trial([0, 65535], [900, 5])
    rest_of([touch], ValueOptions())
    assert "--missing 65535" in capsys.readouterr().out
    rest_of([touch], ValueOptions(missing=[65535.0]))
    assert np.isnan(touch.values[..., 0]).tolist() == [[False, True], [False, False]]


@pytest.mark.parametrize("text", ["16", "axb", f"{'1' * 5000}x2", "²x2"])
def test_another_text_is_no_shape(text):
    with pytest.raises(argparse.ArgumentTypeError, match="must be ROWSxCOLS"):
        shape_of_skin(text)


def raw(rest, touch, n=40):
    """A trial of three taxels with some noise, of which one is touched."""
    values = rest + np.random.default_rng(1).integers(-1, 2, (n, 3))
    values[n // 2 :, 0] += touch
    return trial(*values)


@pytest.mark.parametrize(
    ("rest", "touch", "option"),
    [
        (245, -15, "--falls"),
        (700, 3000, "--signed"),
    ],
)
def test_values_that_rest_away_from_0_are_refused_with_the_option(rest, touch, option):
    trials = [raw(rest, touch), raw(rest + 5, touch)]
    with pytest.raises(InputError) as error:
        rest_of(trials, ValueOptions())
    assert f"add {option}," in str(error.value)
    assert rest_of(trials, ValueOptions(counts=True)).values is None
    assert rest_of(trials, ValueOptions(**{option[2:]: True})).values is not None


@pytest.mark.parametrize(
    "trials",
    [
        [raw(3, 900), raw(4, 900)],
        [raw(30, 900)],
        [raw(100, 150), raw(300, 150), raw(500, 150)],  # in contact from the start
        [trial([700, 700])],
    ],
)
def test_counts_that_rest_near_0_or_begin_in_contact_are_taken(trials):
    assert rest_of(trials, ValueOptions()).values is None
