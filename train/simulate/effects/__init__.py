"""One module for each effect, loaded only for a scene that calls for it.

A module has hooks: functions named after the stages of `train.simulate.plan`. Hooks of
the physics take the trials that call for the effect; `clock` and `sensor` take one
trial's readings.
"""
