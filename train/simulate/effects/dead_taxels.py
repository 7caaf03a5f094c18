"""Taxels that read nothing in a trial: known ones are marked invalid as well. Each is
drawn by itself, which is a model of ours."""

from train.simulate.readings import Readings


def sensor(readings: Readings) -> None:
    """Zero the counts of dead taxels."""
    scene = readings.scene
    shares = readings.stream("dead_taxels").random(scene.skin.shape)
    valid = shares >= scene.setting("dead_taxels", "part")
    readings.counts *= valid
    if scene.setting("dead_taxels", "known"):
        readings.valid = valid
