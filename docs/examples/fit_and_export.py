"""Fit and export: `PYTHONPATH=. python docs/examples/fit_and_export.py DATA MODEL`."""

import sys

import export
import train

export.save(sys.argv[2], train.fit(sys.argv[1]))
