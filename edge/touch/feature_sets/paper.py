"""The paper's three features (section III-B).

| feature | unit | from |
|---|---|---|
| `max_force` | newton (count) | the largest count of the region |
| `contact_area` | taxel | its number of taxels |
| `contact_motion` | metre (taxel) | its sums of rows and columns over its area; the pose |
"""

from edge.touch.measures import PAPER

FEATURES = PAPER
