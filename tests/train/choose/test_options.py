"""The settings that a fit holds fixed."""

from train.choose.options import FitOptions


def test_the_last_decision_point_is_the_window_where_none_is_asked_for():
    points_s = (0.6, 1.2)
    assert FitOptions().fixed_window_s is None
    assert FitOptions(decision_points_s=points_s).fixed_window_s == 1.2
    assert FitOptions(window_s=2.4, decision_points_s=points_s).fixed_window_s == 2.4
