"""Normal noise on each reading."""

from train.simulate import streams
from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Counts + size * N(0, 1)."""
    table = streams.quantiles(readings.scene.setting("noise", "counts"))
    band = readings.scene.setting("dead_band", "counts") if "dead_band" in readings.effects else 0.0
    # Noise within the dead band need not be added to a taxel without load.
    if float(table[-1]) >= band:
        readings.everywhere()
    rows, cols = readings.shape
    generator = readings.stream("noise")
    streams.add_drawn(generator, table, readings.counts, readings.taxels, rows * cols)
