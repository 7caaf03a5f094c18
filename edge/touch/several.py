"""Several contacts at once: which region continues which."""

from collections.abc import Sequence
from operator import itemgetter

from edge.touch.active import Region
from edge.touch.contact import Contact


def shared(
    contacts: Sequence[Contact], regions: Sequence[Region]
) -> dict[Contact, Region]:
    """{contact: the region that continues it}.

    Most taxels in common come first, then the older contact, then the larger region.

    Args:
        contacts: the oldest first.
        regions: the largest first.
    """
    pairs = []
    for contact in contacts:
        for region in regions:
            former = contact.region
            if former is not None and former.touches(region):
                common = (former.bits & region.bits).bit_count()
                pairs.append((common, contact, region))
    shares: dict[Contact, Region] = {}
    for _, contact, region in sorted(pairs, key=itemgetter(0), reverse=True):
        if contact not in shares and region not in shares.values():
            shares[contact] = region
    return shares
