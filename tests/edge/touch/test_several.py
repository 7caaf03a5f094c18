"""Which region continues which contact, where several are followed."""

import numpy as np
import pytest

from edge.touch.region import find_regions
from edge.touch.several import shared


class Followed:
    """A contact, of which only the region counts."""

    def __init__(self, region):
        self.region = region


def regions(row):
    counts = np.array([[100 * int(taxel) for taxel in row]])
    return find_regions(counts, 50, wraps=False)


@pytest.mark.parametrize(
    ("before", "after", "shares"),
    [
        pytest.param("111111", "110111", {0: 0}, id="most taxels in common"),
        pytest.param("110011", "111111", {0: 0}, id="the older of two keeps it"),
        pytest.param("110000", "001100", {0: 0}, id="touching is enough"),
        pytest.param("110000", "000110", {}, id="apart"),
    ],
)
def test_a_contact_goes_on_in_the_region_that_it_shares_most_with(
    before,
    after,
    shares,
):
    contacts = [Followed(region) for region in regions(before)]
    candidates = regions(after)
    assert {
        contacts.index(contact): candidates.index(region)
        for contact, region in shared(contacts, candidates).items()
    } == shares
