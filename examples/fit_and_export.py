"""Fit and export: `python examples/fit_and_export.py RECORDINGS MODEL`, from the checkout."""

import sys

import export
import train

export.save(sys.argv[2], train.fit(sys.argv[1]))
