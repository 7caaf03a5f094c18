"""The keys of a scene file with their limits and defaults, and the table of all effects."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Field:
    """A number of a scene: its limits, and its default where the file does not give it."""

    low: float
    high: float
    default: float | None
    says: str
    open_low: bool = False
    """Whether the lower limit itself is excluded."""
    whole: bool = False


@dataclass(frozen=True)
class EffectInfo:
    """The entry of an effect; its code is loaded only where a scene calls for it."""

    says: str
    stage: str
    """`contact` (acts in the step), `sensor` (on the frames) or `clock` (on their times)."""
    settings: dict[str, Field] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    """Effects that it builds upon."""
    families: tuple[str, ...] = ()
    """Object families that can have it; empty for all."""
    keys: tuple[str, ...] = ()
    """Object keys that it needs; an object with all of them calls for it."""


RIGID, FOAM, PILLOW, BUBBLES, FOLIAGE = "rigid", "foam", "pillow", "bubbles", "foliage"
SOFT_FAMILIES = (FOAM, PILLOW, BUBBLES, FOLIAGE)
FAMILIES = (RIGID, *SOFT_FAMILIES)
CONDITIONS = ("fixed", "movable")

TRIALS = {
    "count": Field(1, 1_000_000, 5, "trials of each object in each condition", whole=True),
    "after_s": Field(0.1, 60.0, 2.2, "time after it"),
    "rate_hz": Field(1.0, 10_000.0, 100.0, "frames a second"),
    "tolerance": Field(1e-5, 0.5, 0.01, "error allowed to the step, as a part of the peak force"),
}
LEAD = Field(0.02, 10.0, 0.2, "time before the skin reaches the object")
TAXEL = Field(0.0, 1e15, 10_000.0, "stiffness of a taxel in N/m", open_low=True)
"""At 1e16 N/m the depth of a touch is below the rounding error of a metre."""
LABELS = {
    "window_s": Field(0.01, 60.0, 1.2, "time after the first touch in which labels are judged"),
    "push_n": Field(0.1, 1e6, 6.0, "push that moves every movable object of a [[family]]"),
    "slides_m": Field(0.0, 1.0, 0.02, "a movable object moves at least this far by then"),
    "yields": Field(0.0, 1.0, 0.01, "a soft object yields by then, as a part of its thickness"),
}
SPREAD = {
    "place_m": Field(0.0, 0.08, 0.0, "place along the forearm where the object is met"),
    "aside_m": Field(0.0, 0.5, 0.0, "distance of the push from the object's middle"),
    "slope_deg": Field(0.0, 10.0, 0.0, "of the table, along the push"),
    "yaw_deg": Field(0.0, 30.0, 0.0, "angle between the object's face and the forearm"),
    "roll_deg": Field(0.0, 60.0, 0.0, "forearm roll: which columns touch"),
    "stiffness": Field(0.0, 1.0, 0.0, "of the object, as a part of its value"),
    "friction": Field(0.0, 1.0, 0.0, "of both coefficients together, as a part of their value"),
    "mass": Field(0.0, 1.0, 0.0, "as a part of its value"),
    "cover": Field(0.0, 1.0, 0.0, "of the skin's and the cover's stiffness, as a part"),
}
SPREAD_OF_MOVABLE = {"slope_deg": "mass_kg", "aside_m": "foot_m"}
"""{spread around 0: the other key that a movable object needs for it}; the object need not give
a value for the spread itself."""
OBJECT = {
    "mass_kg": Field(0.0, 1e12, None, "kilograms", open_low=True),
    "friction_static": Field(0.0, 5.0, None, "mu_s"),
    "friction_kinetic": Field(0.0, 5.0, None, "mu_k, at most friction_static"),
    "skin_friction": Field(0.0, 5.0, None, "mu between the skin and the object's face"),
    "width_m": Field(0.0, 10.0, 1.0, "the face along the forearm", open_low=True),
    "breadth_m": Field(0.0, 10.0, 10.0, "the face across the forearm", open_low=True),
    "radius_m": Field(1e-3, 1e6, 1e6, "how the face curves along the forearm"),
    "height_m": Field(0.0, 10.0, None, "of the contact above the floor", open_low=True),
    "base_m": Field(0.0, 10.0, None, "of the object's foot in the push's direction", open_low=True),
    "foot_m": Field(0.0, 10.0, None, "diameter of the object's foot", open_low=True),
    "aside_m": Field(-1.0, 1.0, None, "distance of the push from the object's middle"),
    "slope_deg": Field(-20.0, 20.0, None, "of what the object stands on, uphill along the push"),
    "stribeck_m_s": Field(0.0, 10.0, None, "speed at which friction has fallen", open_low=True),
    "modulus_pa": Field(0.0, 1e18, None, "of the elastic foundation", open_low=True),
    "depth_m": Field(0.0, 10.0, None, "of the elastic foundation", open_low=True),
    "relax_ratio": Field(0.0, 100.0, None, "k1 / k_inf of the standard linear solid"),
    "relax_s": Field(0.0, 1e6, None, "its time", open_low=True),
    "stem_count": Field(1, 200, None, "stems the forearm can meet", whole=True),
    "stem_n_m": Field(0.0, 1e12, None, "stiffness of a stem, 3 E I / L^3", open_low=True),
    "stem_spread_m": Field(0.0, 1.0, None, "depth over which the stems stand"),
    "stem_slip_m": Field(0.0, 10.0, None, "bend at which a stem slips off", open_low=True),
    "stem_damping": Field(0.0, 1.0, None, "damping ratio of a stem"),
    "stem_deviation": Field(0.0, 2.0, None, "of the logarithm of the stems' stiffnesses"),
    "stem_kg": Field(0.0, 10.0, 0.02, "moving mass of a stem", open_low=True),
    "bubble_n_m": Field(0.0, 1e12, None, "stiffness of a bubble at rest", open_low=True),
    "bubble_m": Field(0.0, 0.1, 0.004, "height of a bubble", open_low=True),
    "pop_n": Field(0.0, 1e6, None, "force at which a bubble bursts", open_low=True),
    "cover_n_m": Field(0.0, 1e12, None, "stiffness of a sleeve, per taxel", open_low=True),
    "cover_spread": Field(0.0, 0.2, 0.1, "part of a taxel's load each neighbour takes"),
}
STIFFNESSES = ("modulus_pa", "stem_n_m", "bubble_n_m")
FAMILY_KEYS: dict[str, dict[str, float]] = {
    RIGID: {},
    FOAM: {"modulus_pa": 12e3, "depth_m": 0.10, "relax_ratio": 0.6, "relax_s": 0.5},
    PILLOW: {"modulus_pa": 3e3, "depth_m": 0.15, "relax_ratio": 0.4, "relax_s": 0.8},
    BUBBLES: {"bubble_n_m": 2000.0, "bubble_m": 0.004, "pop_n": 10.0},
    FOLIAGE: {
        "stem_count": 12,
        "stem_n_m": 15.0,
        "stem_spread_m": 0.06,
        "stem_slip_m": 0.12,
        "stem_damping": 0.15,
        "stem_deviation": 0.3,
        "stem_kg": 0.02,
    },
}
"""{family: {key that no other family has: its default}}, a typical object of the family."""


def keys_of(family: str) -> tuple[str, ...]:
    """The keys of `OBJECT` that an object of a family may have."""
    others = {key for name, keys in FAMILY_KEYS.items() if name != family for key in keys}
    return tuple(key for key in OBJECT if key not in others - set(FAMILY_KEYS[family]))


THICKNESS = {FOAM: "depth_m", PILLOW: "depth_m", BUBBLES: "bubble_m", FOLIAGE: "stem_slip_m"}
"""{soft family: the key of the depth to which it can yield}."""
ELASTIC = (FOAM, PILLOW)
EFFECTS: dict[str, EffectInfo] = {
    # Effects run in this order, in the step and on the frames.
    "foundation": EffectInfo("elastic foundation under each taxel", "contact", families=ELASTIC),
    "lateral": EffectInfo(
        "foam that behaves as an elastic layer, not as separate springs",
        "contact",
        needs=("foundation",),
        families=ELASTIC,
    ),
    "bottoming": EffectInfo(
        "foam that stiffens as it is pressed flat",
        "contact",
        needs=("foundation",),
        families=ELASTIC,
    ),
    "cover": EffectInfo(
        "a sleeve over the skin, in series, that spreads the load",
        "contact",
        keys=("cover_n_m",),
    ),
    "pop": EffectInfo(
        "bubbles: the gas law, no stiffness after the burst", "contact", families=(BUBBLES,)
    ),
    "stems": EffectInfo(
        "foliage: stems that bend, damp and slip off", "contact", families=(FOLIAGE,)
    ),
    "tilt": EffectInfo(
        "the forearm pivots about the contact",
        "contact",
        families=(RIGID, FOAM, PILLOW, BUBBLES),
    ),
    "relaxation": EffectInfo("standard linear solid", "contact", families=ELASTIC),
    "inertia": EffectInfo(
        "the arm's inertia: it hits and bounces",
        "contact",
        {"loss_s": Field(0.0, 1.0, 0.0015, "the skin's dashpot, as a part of its stiffness")},
    ),
    "friction": EffectInfo(
        "the object's face holds the skin until it slides along it",
        "contact",
        {"shear_n_m": Field(0.0, 1e12, 1e4, "stiffness of the skin along the face", open_low=True)},
        keys=("skin_friction",),
    ),
    "sliding": EffectInfo("sticks, then slides on the floor", "contact"),
    "slope": EffectInfo(
        "a table that is not level", "contact", needs=("sliding",), keys=("slope_deg",)
    ),
    "turning": EffectInfo(
        "a push beside the middle turns the object",
        "contact",
        needs=("sliding",),
        keys=("aside_m", "foot_m"),
    ),
    "stribeck": EffectInfo(
        "friction that falls with speed", "contact", needs=("sliding",), keys=("stribeck_m_s",)
    ),
    "tipping": EffectInfo(
        "the object tips over its edge where that takes less force than sliding",
        "contact",
        needs=("sliding",),
        keys=("base_m", "height_m"),
    ),
    "crosstalk": EffectInfo(
        "each taxel feels its neighbours",
        "sensor",
        {"part": Field(0.0, 0.2, 0.02, "of each of the four neighbours")},
    ),
    "hysteresis": EffectInfo(
        "the reading lags behind the load as it rises and falls",
        "sensor",
        {"counts": Field(0.0, 65535, 30.0, "half the width of the loop")},
    ),
    "drift": EffectInfo(
        "a baseline that drifts, differently for each taxel",
        "sensor",
        {"counts_per_s": Field(0.0, 65535, 5.0, "deviation of the taxels' slopes")},
    ),
    "noise": EffectInfo(
        "normal noise on each reading",
        "sensor",
        {"counts": Field(0.0, 65535, 8.0, "standard deviation")},
    ),
    "saturation": EffectInfo(
        "no reading above a limit",
        "sensor",
        {"newton": Field(0.0, 1e6, 17.0, "the limit", open_low=True)},
    ),
    "dead_band": EffectInfo(
        "small readings are zero",
        "sensor",
        {"counts": Field(0.0, 65535, 50.0, "readings below it are zero")},
    ),
    "quantisation": EffectInfo(
        "coarse steps of the converter",
        "sensor",
        {"counts": Field(1.0, 65535, 4.0, "size of a step")},
    ),
    "dead_taxels": EffectInfo(
        "taxels that read nothing in a trial",
        "sensor",
        {
            "part": Field(0.0, 1.0, 0.01, "of all taxels"),
            "known": Field(0, 1, 1, "1: marked invalid; 0: they read zero", whole=True),
        },
    ),
    "jitter": EffectInfo(
        "frames come early or late",
        "clock",
        {"s": Field(0.0, 1.0, 0.001, "standard deviation, cut at 0.45 of a frame")},
    ),
    "dropped_frames": EffectInfo(
        "frames that are lost",
        "clock",
        {"part": Field(0.0, 0.9, 0.02, "of all frames")},
    ),
}
STEP = Field(1e-6, 1.0, None, "the physics' step")
IMPLIED_BY_FAMILY = {
    FOAM: ("foundation", "lateral", "bottoming", "relaxation"),
    PILLOW: ("foundation", "lateral", "bottoming", "relaxation"),
    BUBBLES: ("pop",),
    FOLIAGE: ("stems",),
}
IMPLIED_BY_CONDITION = {"movable": ("sliding",)}
SHARED = {"viscous": ("relaxation", "inertia")}
"""{module of `effects`: the effects that share it}."""
LABELLED_BY = {
    "foundation": {FOAM: "soft", PILLOW: "soft"},
    "pop": {BUBBLES: "soft"},
    "stems": {FOLIAGE: "soft"},
}
"""{effect: {family: the label that rests on it}}."""
