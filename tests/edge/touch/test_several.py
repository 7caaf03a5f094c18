"""Which region continues which contact, where several are followed."""

import numpy as np

from edge.touch.region import find_regions
from edge.touch.several import shared


def regions(*rows):
    counts = np.array([[100 * int(taxel) for taxel in row] for row in rows])
    return find_regions(counts, 50, wraps=False)


def test_a_contact_goes_on_in_the_region_of_most_taxels_in_common():
    assert shared(regions("111111"), regions("110111")) == {0: 0}


def test_of_two_contacts_that_grow_into_one_the_older_keeps_it():
    assert shared(regions("110011"), regions("111111")) == {0: 0}


def test_a_region_that_only_touches_a_contact_continues_it():
    assert shared(regions("110000"), regions("001100")) == {0: 0}


def test_regions_apart_continue_nothing():
    assert shared(regions("110000"), regions("000110")) == {}
