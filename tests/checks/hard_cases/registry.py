"""All hard cases, in the order of the table."""

from importlib import import_module

GROUPS = "neighbours outputs scaling frames touches calibration simulator"
CASES = [
    case
    for name in GROUPS.split()
    for case in import_module(f"tests.checks.hard_cases.{name}").CASES
]
