"""Taxels that read nothing in a trial: known ones are marked invalid, unknown ones read zero."""

from __future__ import annotations

from train.simulate import streams
from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    settings = build.settings("dead_taxels")

    def kill(readings: Readings) -> None:
        """Zero where dead."""
        trial = readings.trial
        generator = streams.stream(readings.seed, "dead_taxels", trial.key, trial.number)
        valid = generator.random(readings.shape) >= settings["part"]
        readings.counts *= valid.reshape(-1)[readings.taxels]
        if settings["known"]:
            readings.valid = valid

    build.read("sensor", 80, kill)
