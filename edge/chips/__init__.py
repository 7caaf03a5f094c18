"""Drivers, one module a chip."""
