"""Several contacts at once: which region continues which."""

from collections.abc import Sequence

from edge.touch.active import Region


def shared(followed: Sequence[Region], regions: Sequence[Region]) -> dict[int, int]:
    """{contact: the region that continues it}, as indices.

    Most taxels in common come first, then the older contact, then the larger region.
    """
    pairs = []
    for i, former in enumerate(followed):
        for j, region in enumerate(regions):
            if former.touches(region):
                pairs.append((-(former.bits & region.bits).bit_count(), i, j))
    shares: dict[int, int] = {}
    for _, i, j in sorted(pairs):
        if i not in shares and j not in shares.values():
            shares[i] = j
    return shares
