"""One module an effect; a scene that does not call for an effect never loads its module.

Each has `add(build)`, which puts the effect's functions into the plan.
"""
