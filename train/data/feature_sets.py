"""Features that go together, by name. To add a set, add an entry to `SETS`.

`paper`: the paper's three features (section III-B).

| feature | unit | from |
|---|---|---|
| `max_force` | newton (count) | the largest count of the region |
| `contact_area` | taxel | its number of taxels |
| `contact_motion` | metre (taxel) | its sums of rows and columns over its area; the pose |

`contact`: how force grows, with area and with motion. It recognises objects that were
not in the training data. Logarithms turn a product into a sum, so objects that differ
by a factor differ by a shift. Five times are enough for such smooth time series; more
of them fit the objects trained on.

| feature | unit | from |
|---|---|---|
| `log_max_force` | log(newton) | the largest count of the region |
| `log_skin_force` | log(newton) | the sum of active counts |
| `relative_skin_force`, its `_rate` | 1, 1/s | the same |
| `log_contact_area`, `relative_contact_area` | log(taxel), 1 | the region's number of taxels |
| `log_contact_pressure` | log(newton/taxel) | the region's sum of counts over its area |
| `force_motion`, its `_rate` | metre, metre/s | its sums of counts times row, column; the pose |
| `log_stiffness` | log(newton/metre) | the skin's sum of counts over force-weighted motion |

`moments`: how force lies on the two halves of the skin and on all of it, as square
roots. Forces spread over decades; their square roots lie evenly, as those of counts do.

| quantity, of `left`, `right` and `skin` | unit, under the root | from |
|---|---|---|
| `max_force` | newton (count) | the zone's largest count |
| `force` | newton (count) | its sum of counts |
| `area` | taxel | its number of active taxels |
| `along`, `around` | taxel | sums of counts times row, column |
| `spread_along`, `spread_around`, `length`, `width` | taxel | the same, and times their squares |
| `slant` | taxel^2 | and times row times column |

`taxels`: every taxel in its place, or cells of several where the skin is large
(`edge.features.cells.Cells`). `sqrt_taxels`: the same of their square roots.

| feature, of each cell | unit | from |
|---|---|---|
| `taxel_force`, at ten times | newton (count) | the cell's sum of counts |
| `taxel_force_mean`, `taxel_force_deviation` | newton (count) | the same, over the window |
| `taxel_force_roughness` | newton (count) | its mean change from sample to sample |

`kernels`: the share of the window in which kernels of nine samples, applied to sums of
the skin's cells, lie above values that training gave (`edge.features.kernels`).
`zone_kernels`: the same of the eight whole numbers of each zone
(`edge.features.zones.ZONE_WIDTH`), which goes with `moments`.

| feature | unit | from |
|---|---|---|
| `taxel_kernels`, 1,008 of them | 1 | the sums of counts of at most 32 cells |
| `zone_kernels`, 504 of them | 1 | the sums of `contact`, `skin`, `left` and `right` |

`joints`: how far each joint yields, which depends on the object touched. `sqrt_joints`:
the same of its square root, in which small motions count. `posture`: the angles
themselves. They give a gripper the object's size, and an arm its place. Where
each object stood in its own place, posture recognises it for a reason that holds in
that room only.

| feature, of each joint | unit | from |
|---|---|---|
| `joint_change`, at ten times | radian | the recording's angles, from onset on |
| `joint_change_rate` | radian/s | the same |
| `joint_angle`, at ten times | radian | the angles themselves |

`shear`, of recordings of three axes: how large the tangential force is, and which part
of the normal one. It nears the coefficient of friction before a contact slides.

| feature, of the contact | unit | from |
|---|---|---|
| `log_contact_shear_size`, its rate | log(newton) | the sums of both components |
| `contact_shear_ratio`, its rate | 1, 1/s | the same, over the sum of counts |
| `sqrt_contact_shear_along`, `_around` | newton under the root | each of the sums |

`taxel_shear`: the tangential force on every taxel, or on cells of several as in
`taxels`.

| feature, of each cell | unit | from |
|---|---|---|
| `sqrt_taxel_shear`, at ten times | newton under the root | both of its sums of shear |
"""

from collections.abc import Sequence

from edge.features.names import PAPER, Feature
from edge.touch.layout import SkinLayout

_TAXELS = (
    "taxel_force@10",
    "taxel_force_mean",
    "taxel_force_deviation",
    "taxel_force_roughness",
)

SETS: dict[str, tuple[str, ...]] = {
    "paper": PAPER,
    "contact": (
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
    ),
    "moments": tuple(
        f"sqrt_{zone}_{quantity}@20"
        for zone in ("left", "right", "skin")
        for quantity in (
            "max_force",
            "force",
            "area",
            "along",
            "around",
            "spread_along",
            "spread_around",
            "slant",
            "length",
            "width",
        )
    ),
    "taxels": _TAXELS,
    "sqrt_taxels": tuple(f"sqrt_{name}" for name in _TAXELS),
    "kernels": ("taxel_kernels",),
    "zone_kernels": ("zone_kernels",),
    "joints": ("joint_change@10", "joint_change_rate@10"),
    "sqrt_joints": ("sqrt_joint_change@10", "sqrt_joint_change_rate@10"),
    "posture": ("joint_angle@10",),
    "shear": (
        "log_contact_shear_size@5",
        "log_contact_shear_size_rate@5",
        "contact_shear_ratio@5",
        "contact_shear_ratio_rate@5",
        "sqrt_contact_shear_along@5",
        "sqrt_contact_shear_around@5",
    ),
    "taxel_shear": ("sqrt_taxel_shear@10",),
}
"""{set: names of its features, see `edge.features.names`}."""


def expand(names: Sequence[str]) -> tuple[str, ...]:
    """The features of several sets, or single features, in their order, each once."""
    expanded = (feature for name in names for feature in SETS.get(name, (name,)))
    return tuple(dict.fromkeys(expanded))


def moves(feature: Feature) -> bool:
    """Whether a feature is measured in the world's frame where joint angles are
    known."""
    return bool(feature.quantity.motion)


def axes(types: Sequence[Feature]) -> int | None:
    """3 where a feature needs shear, else None, as `SkinLayout.axes` says it."""
    return 3 if any(feature.quantity.shear for feature in types) else None


def unit(feature: Feature, layout: SkinLayout) -> str:
    """The unit of a feature's values on a skin."""
    units = {"force": layout.force_unit, "length": layout.length_unit}
    text = feature.quantity.unit.format(**units)
    for transform in feature.transforms:
        text = "1" if transform == "relative" else f"{transform}({text})"
    return f"{text}/s" if feature.summary == "rate" else text
