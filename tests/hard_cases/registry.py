"""All hard cases, in the order of the table."""

from __future__ import annotations

from tests.hard_cases import (
    everywhere,
    frames,
    kinematics,
    limits,
    moments,
    neighbours,
    refusals,
    scaling,
    simulator,
)
from tests.hard_cases.cases import Case

CASES: list[Case] = [
    *neighbours.CASES,
    *scaling.CASES,
    *frames.CASES,
    *kinematics.CASES,
    *moments.CASES,
    *limits.CASES,
    *refusals.CASES,
    *everywhere.CASES,
    *simulator.CASES,
]
