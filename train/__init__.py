"""The workstation: recordings to a fitted pipeline."""
