"""The fault campaign in short (`python -m bench.faults` runs all of it and prints the table)."""

import errno
import math

import pytest

from bench.faults import Fault, positions, run, scripts
from edge import skinfile

ROWS = {name: (file, faults, more) for name, file, faults, more in scripts()}
UNKNOWABLE = [name for name in ROWS if name.endswith("*")]
"""The protocol has nothing that would tell these."""
TIMEOUT_TICKS = 3
"""Ticks that one timeout of 20 ms can cost at 100 Hz."""


@pytest.mark.parametrize("name", [n for n in ROWS if n not in UNKNOWABLE])
def test_a_fault_loses_no_more_than_it_must(name):
    file, faults, more = ROWS[name]
    outcome = run(name, file, faults, seconds=2.2, **more)
    assert outcome.escaped == ""
    assert outcome.met > 0
    assert outcome.wrong == 0
    assert outcome.others == 0
    hangs = [f for f in faults if f.code == errno.ETIMEDOUT and f.kind == "error"]
    if not hangs:
        assert (outcome.missed, outcome.late_s) == (0, pytest.approx(0.0, abs=1e-9))
        assert outcome.recovery_s < 0.15
    else:
        assert outcome.missed <= TIMEOUT_TICKS * outcome.met
        assert outcome.recovery_s < 1.05


@pytest.mark.parametrize("name", ["NACK on one chip", "EIO on one chip", "a hung chip (ETIMEDOUT)"])
def test_one_bad_chip_costs_its_own_taxels_only(name):
    file, faults, more = ROWS[name]
    assert run(name, file, faults, seconds=1.2, **more).missing == 12


def test_a_hung_chip_costs_its_timeout_and_is_then_tried_less_and_less():
    file, faults, more = ROWS["a hung chip (ETIMEDOUT)"]
    outcome = run("", file, faults, seconds=1.2, **more)
    assert outcome.met <= 4
    assert outcome.missed <= 2 * outcome.met


@pytest.mark.parametrize("code", [errno.EREMOTEIO, errno.EIO, errno.EAGAIN])
def test_a_passing_error_anywhere_in_a_frame_is_made_good_within_it(code):
    outcome = positions(code, skinfile.load(skinfile.shipped("cody")), every=31)
    assert (outcome.wrong, outcome.missing, outcome.missed, outcome.escaped) == (0, 0, 0, "")


@pytest.mark.parametrize(("code", "most"), [(errno.ETIMEDOUT, 12), (errno.ENODEV, 144)])
def test_an_error_that_lasts_costs_one_chip_or_one_bus(code, most):
    outcome = positions(code, skinfile.load(skinfile.shipped("cody")), every=47)
    assert (outcome.wrong, outcome.missing, outcome.escaped) == (0, most, "")


def test_without_reading_back_a_wrong_channel_gives_wrong_values():
    """The campaign can see them: the 20 bits of reading back are not for nothing."""
    name = "the same without reading back *"
    file, faults, more = ROWS[name]
    assert run(name, file, faults, seconds=1.2, **more).wrong > 100


def test_the_same_seed_gives_the_same_outcome():
    file, faults, _ = ROWS["random errors, 1.0% of transactions"]
    first, again, other = (run("", file, faults, seed=s, seconds=1.2) for s in (3, 3, 4))
    assert first == again or (math.isnan(first.recovery_s) and first.met == again.met)
    assert first.met != other.met


def test_a_chip_that_never_comes_back_stays_out_and_costs_nothing():
    cody = skinfile.load(skinfile.shipped("cody"))
    forever = Fault(bus=cody.buses[0].device, channel=0, address=0x2C)
    outcome = run("", cody, [forever], seconds=1.5)
    assert (outcome.missing, outcome.missed, outcome.escaped) == (12, 0, "")
    assert math.isnan(outcome.recovery_s)
