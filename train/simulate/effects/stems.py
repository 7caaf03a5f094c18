"""Foliage: stems at different depths that bend as cantilevers (k = 3 E I / L^3, one
number here), damp, and slip off the forearm for good once bent too far.

The cantilever is Euler and Bernoulli's; damping and slipping are a model of ours, which
was fitted to nothing."""

import numpy as np

from train.simulate import streams
from train.simulate.contact import bed_law, total
from train.simulate.effects.base import FAR_M
from train.simulate.trials import Array, Group, Places, Trials


class Stems(Group):
    """The stems of each trial; a trial of fewer stems has some of no stiffness.

    Attributes:
        depth, stiffness: (stems, n) metres at which each is touched, and newtons a
            metre, 0 once it has slipped off.
        blow: (stems, n) newtons a metre with which its mass resists in this step.
        damping: (stems, n) N s/m of each, 0 once it has slipped off.
        along: (stems, n) where each stands within the face, from 0 to 1.
        taxel, part: (stems, n) the place in the window's image of the first of the two
            rows that a stem lies between, and the part of its load that the second
            bears.
        order: (stems, n) the stems sorted by depth.
        drag: (n,) N s/m of all bent stems.
    """

    depth: Array
    stiffness: Array
    blow: Array
    damping: Array
    along: Array
    taxel: Places
    part: Array
    order: Places
    drag: Array


def lay(t: Trials) -> None:
    """Lay stems instead of the bed's rows."""
    values = t.values
    counts = values["stem_count"].astype(np.int64)
    shape = (int(counts.max()), len(t))
    depth = np.ones(shape)
    along, around, stiffness = np.zeros((3, *shape))
    for trial, place in enumerate(t.places):
        spec = t.batch.specs[place]
        count = counts[trial]
        generator = streams.stream(t.scene.seed, "stems", spec.key, spec.number)
        depth[:count, trial] = generator.random(count)
        along[:count, trial] = generator.random(count)
        around[:count, trial] = generator.integers(-1, 2, count)
        deviation = values["stem_deviation"][trial]
        stiffness[:count, trial] = np.exp(deviation * generator.standard_normal(count))
    depth -= depth.min(axis=0)
    stiffness = np.where(stiffness > 0.0, stiffness * values["stem_n_m"], 0.0)
    rows, window, _ = t.touch.image.shape
    pitch = t.scene.skin.pitch[0]
    middle = (t.scene.skin.row_z[0] - t.contact.z) / pitch
    reach = 0.5 * np.minimum(values["width_m"], rows * pitch) / pitch
    place = np.clip(middle + (2.0 * along - 1.0) * reach, 0.0, max(rows - 1.001, 0.0))
    low = np.floor(place)
    damping = 2.0 * values["stem_damping"] * np.sqrt(stiffness * values["stem_kg"])
    t.add_state(
        "stems",
        Stems,
        depth=depth * values["stem_spread_m"],
        stiffness=stiffness,
        blow=np.zeros(shape),
        damping=np.where(stiffness > 0.0, damping, 0.0),
        along=along,
        taxel=(low * window + (window // 2 + around)).astype(np.intp),
        part=place - low,
        order=np.zeros(shape, dtype=np.intp),
    )


def law(t: Trials) -> None:
    """The law of the stems by depth."""
    stems = t.states["stems"]
    stems.order = t.set_bed_law(stems.depth, stems.stiffness)


def tune(t: Trials) -> None:
    """The law of the next step: the stems still held, and implicitly the damping of
    bent ones."""
    stems = t.states["stems"]
    order = stems.order
    gaps = np.take_along_axis(stems.depth, order, 0)
    stiffness = np.take_along_axis(stems.stiffness + stems.blow, order, 0)
    slopes, intercepts = bed_law(gaps, stiffness)
    drag = stems.drag / t.clock.h
    t.set_lines(slopes + drag, intercepts + drag * t.contact.depth[0])


def settle(t: Trials) -> None:
    """Let stems slip off that are bent too far; the others damp the next step."""
    stems = t.states["stems"]
    bent = t.contact.depth[0] - stems.depth
    slips = (bent > t.values["stem_slip_m"]) & (stems.stiffness > 0.0)
    stems.stiffness *= ~slips
    stems.damping *= ~slips
    stems.drag = total(np.where(bent > 0.0, stems.damping, 0.0))
    tune(t)


def bear(t: Trials) -> None:
    """The force on the skin, and how far the first stem is bent."""
    stems = t.states["stems"]
    holds = stems.stiffness > 0.0
    bent = t.contact.depth[0] - stems.depth
    t.touch.force = t.contact.loads[0]
    t.touch.deepest = np.where(holds, bent, 0.0).max(axis=0)
    t.touch.inside = np.where(holds, bent, FAR_M).max(axis=0)


def image(t: Trials) -> None:
    """Put each stem's load on the two rows that it lies between."""
    stems = t.states["stems"]
    bent = np.maximum(t.contact.depth[0] - stems.depth, 0.0)
    loads = bent * (stems.stiffness + stems.blow)
    borne = total(loads)
    loads = loads * (t.touch.force / np.where(borne > 0.0, borne, 1.0))
    rows, window, _ = t.touch.image.shape
    image = np.zeros((rows * window, len(t)))
    part = stems.part
    trials = np.arange(len(t))
    beside = window if rows > 1 else 0
    shares = zip(stems.taxel, loads * (1.0 - part), loads * part, strict=True)
    for taxel, first, second in shares:
        image[taxel, trials] += first
        image[taxel + beside, trials] += second
    t.touch.image = image.reshape(rows, window, -1)
