"""Taxels that read nothing in a trial: known ones are marked invalid as well."""

from __future__ import annotations

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Zero the counts of dead taxels."""
    settings = readings.settings("dead_taxels")
    valid = readings.stream("dead_taxels").random(readings.shape) >= settings["part"]
    readings.counts *= valid.reshape(-1)[readings.taxels]
    if settings["known"]:
        readings.valid = valid
