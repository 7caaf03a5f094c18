"""The settings that a fit holds fixed."""

from dataclasses import fields

from export.cli import parser
from train.choose.options import FitOptions
from train.fitting import fit


def test_the_last_decision_point_is_the_window_where_none_is_asked_for():
    points_s = (0.6, 1.2)
    assert FitOptions().fixed_window_s is None
    assert FitOptions(decision_points_s=points_s).fixed_window_s == 1.2
    assert FitOptions(window_s=2.4, decision_points_s=points_s).fixed_window_s == 2.4


def test_the_docstring_of_a_fit_lists_every_option():
    lines = fit.__doc__.splitlines()
    named = {line.split(":")[0].strip() for line in lines}
    assert {option.name for option in fields(FitOptions)} <= named
    assert parser().get_default("leave_out") == FitOptions().leave_out
