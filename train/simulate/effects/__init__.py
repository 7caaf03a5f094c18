"""One module an effect; a scene that does not call for an effect never loads its module.

Each has `add(build)`, which puts the effect's functions into the plan. They work on whole batches
in numpy, and put new arrays into the state in place of changing old ones, so that a step can be
recorded and replayed (`tape`).
"""
