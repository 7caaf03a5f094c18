"""How force lies on the two halves of the skin and on the whole of it: square roots of moments.

| quantity, of `left`, `right` and `skin` | unit, under the root | from |
|---|---|---|
| `max_force` | newton (count) | the zone's largest count |
| `force` | newton (count) | its sum of counts |
| `area` | taxel | its number of active taxels |
| `along`, `around` | taxel | sums of counts times row, column |
| `spread_along`, `spread_around`, `length`, `width` | taxel | the same, and times their squares |
| `slant` | taxel^2 | and times row times column |

Forces spread over decades and their square roots lie evenly, as those of counts do.
"""

from edge.touch.measures import QUANTITIES

FEATURES = tuple(
    f"sqrt_{zone}_{quantity}@20"
    for zone in ("left", "right", "skin")
    for quantity in QUANTITIES
    if quantity != "pressure"
)
