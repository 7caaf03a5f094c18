"""Several contacts at once, each region followed on its own."""

from __future__ import annotations

from typing import Any

from edge.touch.frame import Frame
from edge.touch.region import Region, find_regions
from edge.touch.track import Contact, Follower, Tracker


class Tracks(Tracker):
    """Follows several regions at once, each as a contact of its own.

    A region goes on with the contact that it shares the most taxels with; where it shares none,
    with one that it touches. Where two contacts grow into one region, the
    older one keeps it and the other ends; where a region parts in two, the larger share goes on
    and the other part begins anew.
    """

    AT_MOST = 8
    """Contacts at once, the largest first: a skin that flickers must not stall the loop."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Take the same arguments as `Tracker`."""
        super().__init__(*arguments, **options)
        self._followers: list[Follower] = []

    def follow(self, frame: Frame) -> list[Contact]:
        """Take in a frame.

        Returns:
            The contacts under way, oldest first, with those that the frame ended.

        Raises:
            InputError: as `Tracker.push`.
        """
        self._take(frame)
        regions = find_regions(
            frame.counts,
            self.layout.threshold_counts,
            valid=frame.valid,
            wraps=self.layout.wraps,
            connectivity=self.settings.connectivity,
        )
        self.region = regions[0] if regions else None
        shares = _shared(self._followers, regions)
        free = [region for i, region in enumerate(regions) if i not in shares.values()]
        room = self.AT_MOST - len(self._followers)
        begins = [region for region in free if region.peak > self.layout.onset][: max(room, 0)]
        pushed = [
            (follower, regions[shares[i]] if i in shares else None)
            for i, follower in enumerate(self._followers)
        ]
        pushed += [(Follower(self), region) for region in begins]
        contacts = [follower.push(frame, region) for follower, region in pushed]
        self._followers = [follower for follower, _ in pushed if follower.contact is not None]
        return [contact for contact in contacts if contact is not None]


def _shared(followers: list[Follower], regions: list[Region]) -> dict[int, int]:
    """{follower: region} by the most taxels in common, then the older, then the larger region."""
    pairs = []
    for i, follower in enumerate(followers):
        before = follower.region
        if before is None:
            continue
        for j, region in enumerate(regions):
            if common := (before.bits & region.bits).bit_count():
                pairs.append((0, -common, i, j))
            elif before.touches(region):
                pairs.append((1, 0, i, j))
    found: dict[int, int] = {}
    for _, _, i, j in sorted(pairs):
        if i not in found and j not in found.values():
            found[i] = j
    return found
