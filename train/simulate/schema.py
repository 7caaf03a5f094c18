"""The keys of a scene file with their limits and defaults, and the table of all
effects."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Field:
    """A number of a scene: its limits, and its default where the file does not give
    it."""

    low: float
    high: float
    default: float | None = None
    open_low: bool = False
    """Whether the lower limit itself is excluded."""
    integer: bool = False
    """Whether it must be a whole number."""


def above_0(high: float, default: float | None = None) -> Field:
    """A number above 0, which 0 itself is not."""
    return Field(0.0, high, default, open_low=True)


@dataclass(frozen=True)
class Effect:
    """When a trial calls for an effect; the module of its name, loaded only then,
    computes it."""

    settings: dict[str, Field] = field(default_factory=dict)
    needs: tuple[str, ...] = ()
    """Effects that it builds upon."""
    families: tuple[str, ...] = ()
    """Object families that can have it; empty for all."""
    keys: tuple[str, ...] = ()
    """Object keys that it needs; an object with all of them calls for it."""
    condition: str = ""
    """The condition whose objects call for it, and no others can."""
    axes: int = 0
    """The axes of a skin that calls for it, whatever the object."""


CONDITIONS = ("fixed", "movable")

TRIALS = {
    # trials of each object in each condition
    "count": Field(1, 1_000_000, 5, integer=True),
    "after_s": Field(0.1, 60.0, 2.2),  # time after it
    "rate_hz": Field(1.0, 10_000.0, 100.0),  # frames a second
}
LEAD = Field(0.02, 10.0, 0.2)  # time before the skin reaches the object
TAXEL = above_0(1e15, 10_000.0)  # stiffness of a taxel in N/m
"""At 1e16 N/m the depth of a touch is below the rounding error of a metre."""
LABELS = {
    # time after the first touch in which labels are judged
    "window_s": Field(0.01, 60.0, 1.2),
    # push that moves every movable object of a [[family]]
    "push_n": Field(0.1, 1e6, 6.0),
    # a movable object moves at least this far by then
    "slides_m": Field(0.0, 1.0, 0.02),
    # a soft object yields by then, as a part of its thickness
    "yields": Field(0.0, 1.0, 0.01),
}
SPREAD = {
    "place_m": Field(0.0, 0.08, 0.0),  # place along the forearm where the object is met
    "aside_m": Field(0.0, 0.5, 0.0),  # distance of the push from the object's middle
    "slope_deg": Field(0.0, 10.0, 0.0),  # of the table, along the push
    "yaw_deg": Field(0.0, 30.0, 0.0),  # angle between the object's face and the forearm
    "roll_deg": Field(0.0, 60.0, 0.0),  # forearm roll: which columns touch
    "stiffness": Field(0.0, 1.0, 0.0),  # of the object, as a part of its value
    # of both coefficients together, as a part of their value
    "friction": Field(0.0, 1.0, 0.0),
    "mass": Field(0.0, 1.0, 0.0),  # as a part of its value
    "cover": Field(0.0, 1.0, 0.0),  # of the skin's and the cover's stiffness, as a part
    "travel_s": Field(0.0, 10.0, 0.0),  # time at which the arm halts
}
RATE_DEG_S = "rate_deg_s"
"""A spread of a number a joint, of its speed: `rate_deg_s.3` is the fourth joint's."""
SPREAD_OF_MOVABLE = {"slope_deg": "mass_kg", "aside_m": "foot_m"}
"""{spread around 0: the other key that a movable object needs for it}; the object need
not give a value for the spread itself."""
OBJECT = {
    "mass_kg": Field(1e-6, 1e12),  # kilograms
    "friction_static": Field(0.0, 5.0),  # mu_s
    "friction_kinetic": Field(0.0, 5.0),  # mu_k, at most friction_static
    "skin_friction": Field(0.0, 5.0),  # mu between the skin and the object's face
    "width_m": above_0(10.0, 1.0),  # the face along the forearm
    "breadth_m": above_0(10.0, 10.0),  # the face across the forearm
    "radius_m": Field(1e-3, 1e6, 1e6),  # how the face curves along the forearm
    "height_m": above_0(10.0),  # of the contact above the floor
    "base_m": above_0(10.0),  # of the object's foot in the push's direction
    "foot_m": above_0(10.0),  # diameter of the object's foot
    "aside_m": Field(-1.0, 1.0),  # distance of the push from the object's middle
    # of the surface under the object, uphill along the push
    "slope_deg": Field(-20.0, 20.0),
    "stribeck_m_s": above_0(10.0),  # speed at which friction has fallen
    "modulus_pa": above_0(1e18, 12e3),  # of the elastic foundation
    "depth_m": Field(1e-4, 10.0, 0.10),  # of the elastic foundation
    "relax_ratio": Field(0.0, 100.0, 0.6),  # k1 / k_inf of the standard linear solid
    "relax_s": above_0(1e6, 0.5),  # its time
    "stem_count": Field(1, 200, 12, integer=True),  # stems the forearm can meet
    "stem_n_m": above_0(1e12, 15.0),  # stiffness of a stem, 3 E I / L^3
    "stem_spread_m": Field(0.0, 1.0, 0.06),  # depth over which the stems stand
    "stem_slip_m": above_0(10.0, 0.12),  # bend at which a stem slips off
    "stem_damping": Field(0.0, 1.0, 0.15),  # damping ratio of a stem
    # of the logarithm of the stems' stiffnesses
    "stem_deviation": Field(0.0, 2.0, 0.3),
    "stem_kg": above_0(10.0, 0.02),  # moving mass of a stem
    # of the forearm's middle above the feet of stems that stand upright
    "stem_height_m": Field(0.2, 10.0),
    "bubble_n_m": above_0(1e12, 2000.0),  # stiffness of a bubble at rest
    "bubble_m": above_0(0.1, 0.004),  # height of a bubble
    "pop_n": above_0(1e6, 10.0),  # force at which a bubble bursts
    "cover_n_m": above_0(1e12),  # stiffness of a sleeve, per taxel
    "cover_spread": Field(0.0, 0.2, 0.1),  # part of a taxel's load each neighbour takes
}
STIFFNESSES = ("modulus_pa", "stem_n_m", "bubble_n_m")


@dataclass(frozen=True)
class Family:
    """A kind of objects.

    Attributes:
        effects: effects that each of its objects calls for; the first makes the objects
            soft.
        thickness: the key of the depth to which a soft object can yield; empty for a
            rigid one.
        keys: those that objects of other families do not have.
        defaults: {key: the family's typical value}, in place of the default in
            `OBJECT`.
    """

    effects: tuple[str, ...] = ()
    thickness: str = ""
    keys: tuple[str, ...] = ()
    defaults: dict[str, float] = field(default_factory=dict)


LAYER = ("foundation", "lateral", "bottoming", "relaxation")
LAYER_KEYS = ("modulus_pa", "depth_m", "relax_ratio", "relax_s")
STEM_KEYS = tuple(key for key in OBJECT if key.startswith("stem_"))
PILLOW = dict(zip(LAYER_KEYS, (3e3, 0.15, 0.4, 0.8), strict=True))
FAMILIES = {
    "rigid": Family(),
    "foam": Family(LAYER, "depth_m", LAYER_KEYS),
    "pillow": Family(LAYER, "depth_m", LAYER_KEYS, PILLOW),
    "bubbles": Family(("pop",), "bubble_m", ("bubble_n_m", "bubble_m", "pop_n")),
    "foliage": Family(("stems",), "stem_slip_m", STEM_KEYS),
}


def keys_of(family: str) -> dict[str, float | None]:
    """{key of `OBJECT` that an object of a family may have: its default, or None}."""
    family_info = FAMILIES[family]
    foreign = {key for of_family in FAMILIES.values() for key in of_family.keys} - {
        *family_info.keys
    }
    defaults = {
        key: field.default for key, field in OBJECT.items() if key not in foreign
    }
    return {**defaults, **family_info.defaults}


ELASTIC = ("foam", "pillow")
CONTACT_EFFECTS = {
    "foundation": Effect(families=ELASTIC),
    "lateral": Effect(needs=("foundation",), families=ELASTIC),
    "bottoming": Effect(needs=("foundation",), families=ELASTIC),
    "cover": Effect(keys=("cover_n_m",)),
    "pop": Effect(families=("bubbles",)),
    "stems": Effect(families=("foliage",)),
    "upright": Effect(needs=("stems",), keys=("stem_height_m",)),
    "strike": Effect(needs=("stems",), keys=("stem_kg",)),
    "tilt": Effect(families=("rigid", "foam", "pillow", "bubbles")),
    "relaxation": Effect(families=ELASTIC),
    # loss_s: dashpot by stiffness
    "inertia": Effect({"loss_s": Field(0.0, 1.0, 0.0015)}),
    # shear_n_m: stiffness of the skin along the face
    "friction": Effect({"shear_n_m": above_0(1e12, 1e4)}, keys=("skin_friction",)),
    "sliding": Effect(condition="movable"),
    "slope": Effect(needs=("sliding",), keys=("slope_deg",)),
    "turning": Effect(needs=("sliding",), keys=("aside_m", "foot_m")),
    "stribeck": Effect(needs=("sliding",), keys=("stribeck_m_s",)),
    "tipping": Effect(needs=("sliding",), keys=("base_m", "height_m")),
    "shear": Effect(axes=3),
}
"""Effects in the step."""
SENSOR_EFFECTS = {
    # part: of each of four neighbours
    "crosstalk": Effect({"part": Field(0.0, 0.2, 0.02)}),
    # counts: half the loop's width
    "hysteresis": Effect({"counts": Field(0.0, 65535, 30.0)}),
    # counts_per_s: deviation of slopes
    "drift": Effect({"counts_per_s": Field(0.0, 65535, 5.0)}),
    # counts: standard deviation
    "noise": Effect({"counts": Field(0.0, 65535, 8.0)}),
    "saturation": Effect({"newton": above_0(1e6, 17.0)}),  # newton: the limit
    # counts: readings below are zero
    "dead_band": Effect({"counts": Field(0.0, 65535, 50.0)}),
    # counts: size of a step
    "quantisation": Effect({"counts": Field(1.0, 65535, 4.0)}),
    # part: of all taxels; known: 1, they are marked invalid; 0, they read zero
    "dead_taxels": Effect(
        {"part": Field(0.0, 1.0, 0.01), "known": Field(0, 1, 1, integer=True)},
    ),
    # s: deviation, cut at 0.45 of a frame
    "jitter": Effect({"s": Field(0.0, 1.0, 0.001)}),
    # part: of all frames
    "dropped_frames": Effect({"part": Field(0.0, 0.9, 0.02)}),
}
"""Effects on the frames, or on their times."""
EFFECTS = {**CONTACT_EFFECTS, **SENSOR_EFFECTS}
"""All of them, in the order in which they run."""
STEP = Field(1e-5, 1.0)  # the physics' step
SHARED = {"viscous": ("relaxation", "inertia")}
"""{module of `effects`: the effects that share it}."""
