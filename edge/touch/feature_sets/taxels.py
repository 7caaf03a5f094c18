"""Every taxel in its place, or cells of several where the skin is large (`edge.touch.cells`).

| feature, of each cell | unit | from |
|---|---|---|
| `taxel_force`, at ten times | newton (count) | the cell's sum of counts |
| `taxel_force_mean`, `taxel_force_deviation` | newton (count) | the same, over the window |
| `taxel_force_roughness` | newton (count) | its mean change from sample to sample |

`SQRT` are those of the square roots, which lie evenly where forces spread over decades.
"""

FEATURES = (
    "taxel_force@10",
    "taxel_force_mean",
    "taxel_force_deviation",
    "taxel_force_roughness",
)
SQRT = tuple(f"sqrt_{name}" for name in FEATURES)
