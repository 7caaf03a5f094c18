"""Drivers of the chips, one class each, which a skin file names."""
