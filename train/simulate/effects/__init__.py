"""One module for each effect; a scene that does not call for an effect never loads its module.

A module has functions named after the stages of `train.simulate.plan`. Those of the physics take
the trials and the index of the trials concerned, `clock` and `sensor` take the readings of one
trial.
"""
