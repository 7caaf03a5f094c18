"""One module an effect; a scene that does not call for an effect never loads its module.

Each has `add(build)`, which puts the effect's functions into the plan: those of the setup work on
a whole batch in numpy, those of frames, steps and samples are compiled and work on one trial's
record (`trial`), and those of the sensor and its clock on a few trials' frames at once.
"""
