"""Normal noise on each reading: a model of ours; a scene says where its size is from."""

from train.simulate import streams
from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Counts + size * N(0, 1)."""
    deviation = readings.scene.setting("noise", "counts")
    streams.add_normal(readings.stream("noise"), deviation, readings.counts)
