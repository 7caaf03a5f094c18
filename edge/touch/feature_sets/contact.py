"""What recognises objects that were never met: how force grows, with area and with motion.

| feature | unit | from |
|---|---|---|
| `log_max_force` | log(newton) | the largest count of the region |
| `log_skin_force` | log(newton) | the sum of active counts |
| `relative_skin_force`, its `_rate` | 1, 1/s | the same |
| `log_contact_area`, `relative_contact_area` | log(taxel), 1 | the region's number of taxels |
| `log_contact_pressure` | log(newton/taxel) | the region's sum of counts over its area |
| `force_motion`, its `_rate` | metre, metre/s | its sums of counts times row, column; the pose |
| `log_stiffness` | log(newton/metre) | the skin's sum of counts over force-weighted motion |

Logarithms turn a product into a sum: what differs between objects by a factor is a shift. Five
times are enough for courses this smooth; more of them fit the objects that were met.
"""

FEATURES = (
    "log_max_force@5",
    "log_skin_force@5",
    "log_contact_area@5",
    "log_contact_pressure@5",
    "log_stiffness@5",
    "force_motion@5",
    "force_motion_rate@5",
    "relative_skin_force@5",
    "relative_contact_area@5",
    "relative_skin_force_rate@5",
)
