"""Foliage: stems at different depths that bend as cantilevers (k = 3 E I / L^3, one
number here), damp, and slip off the forearm for good once bent too far.

The cantilever is Euler and Bernoulli's; damping and slipping are a model of ours, which
was fitted to nothing."""

from dataclasses import dataclass

import numpy as np

from train.simulate import streams
from train.simulate.contact import bed_law
from train.simulate.effects.base import FAR_M
from train.simulate.trials import Array, Index, Places, Trials, pick, total


@dataclass
class Stems:
    """The stems of each trial; a trial of fewer stems has some of no stiffness.

    Attributes:
        depth, stiffness: (stems, n) metres at which each is touched, and newtons a
            metre, 0 once it has slipped off.
        damping: (stems, n) N s/m of each, 0 once it has slipped off.
        taxel, part: (stems, n) the place in the window's image of the first of the two
            rows that a stem lies between, and the part of its load that the second
            bears.
        order: (stems, n) the stems sorted by depth.
        slopes, intercepts: (stems, n) the law of the stems still held, without damping.
        drag: (n,) N s/m of all bent stems.
    """

    depth: Array
    stiffness: Array
    damping: Array
    taxel: Places
    part: Array
    order: Places
    slopes: Array
    intercepts: Array
    drag: Array


def lay(t: Trials, i: Index) -> None:
    """Lay stems instead of the bed's rows."""
    trials = np.arange(t.n)[i]
    scene = t.scene
    values = t.values
    counts = values["stem_count"][trials].astype(np.int64)
    shape = (int(counts.max()), t.n)
    depth, along, around, stiffness = np.ones(shape), *np.zeros((3, *shape))
    for trial, count in zip(trials.tolist(), counts.tolist(), strict=True):
        spec = t.specs[trial]
        generator = streams.stream(scene.seed, "stems", spec.key, spec.number)
        depth[:count, trial] = generator.random(count)
        along[:count, trial] = generator.random(count)
        around[:count, trial] = generator.integers(-1, 2, count)
        deviation = values["stem_deviation"][trial]
        stiffness[:count, trial] = np.exp(deviation * generator.standard_normal(count))
    depth -= depth.min(axis=0)
    stiffness = np.where(stiffness > 0.0, stiffness * values["stem_n_m"], 0.0)
    pitch = t.skin.pitch[0]
    middle = (t.row_z[0] - t.z) / pitch
    reach = 0.5 * np.minimum(values["width_m"], t.rows * pitch) / pitch
    place = np.clip(middle + (2.0 * along - 1.0) * reach, 0.0, max(t.rows - 1.001, 0.0))
    low = np.floor(place)
    window = len(t.columns)
    damping = 2.0 * values["stem_damping"] * np.sqrt(stiffness * values["stem_kg"])
    t.states["stems"] = Stems(
        depth=depth * values["stem_spread_m"],
        stiffness=stiffness,
        damping=np.where(stiffness > 0.0, damping, 0.0),
        taxel=(low * window + (window // 2 + around)).astype(np.intp),
        part=place - low,
        order=np.zeros(shape, dtype=np.intp),
        slopes=np.zeros(shape),
        intercepts=np.zeros(shape),
        drag=np.zeros(t.n),
    )


def law(t: Trials, i: Index) -> None:
    """The law of the stems by depth."""
    state = t.states["stems"]
    state.order[:, i] = t.obey(i, pick(state.depth, i), pick(state.stiffness, i))
    let_go(t, i)


def let_go(t: Trials, i: Index) -> None:
    """The law of the stems that are still held."""
    state = t.states["stems"]
    order = pick(t.states["stems"].order, i)
    gaps, stiffness = (
        np.take_along_axis(pick(a, i), order, 0) for a in (state.depth, state.stiffness)
    )
    state.slopes[:, i], state.intercepts[:, i] = bed_law(gaps, stiffness)


def tune(t: Trials, i: Index) -> None:
    """The law of the next step: the stems still held, and implicitly the damping of
    bent ones."""
    state = t.states["stems"]
    drag = pick(state.drag, i) / pick(t.h, i)
    stems = len(state.depth)
    t.slopes[:stems, i] = pick(state.slopes, i) + drag
    t.intercepts[:stems, i] = pick(state.intercepts, i) + drag * pick(t.depth[0], i)


def settle(t: Trials, i: Index) -> None:
    """Let stems slip off that are bent too far; the others damp the next step."""
    state = t.states["stems"]
    bent = pick(t.depth[0], i) - pick(state.depth, i)
    slips = (bent > pick(t.values["stem_slip_m"], i)) & (pick(state.stiffness, i) > 0.0)
    at = slips.any(axis=0).nonzero()[0]
    if at.size:
        trials = np.arange(t.n)[i][at]
        bends = ~slips.take(at, -1)
        state.stiffness[:, trials] *= bends
        state.damping[:, trials] *= bends
        let_go(t, trials)
    state.drag[i] = total(np.where(bent > 0.0, pick(state.damping, i), 0.0))
    tune(t, i)


def bear(t: Trials, i: Index) -> None:
    """The force on the skin, and how far the first stem is bent."""
    state = t.states["stems"]
    depth = pick(t.depth[0], i)
    bends = pick(state.stiffness, i) > 0.0
    bent = depth - pick(state.depth, i)
    t.force[i] = pick(t.loads[0], i)
    t.deepest[i] = np.where(bends, bent, 0.0).max(axis=0)
    t.inside[i] = np.where(bends, bent, FAR_M).max(axis=0)


def image(t: Trials, i: Index) -> None:
    """Put each stem's load on the two rows that it lies between."""
    state = t.states["stems"]
    m = len(np.arange(t.n)[i])
    bent = np.maximum(pick(t.depth[0], i) - pick(state.depth, i), 0.0)
    loads = bent * pick(state.stiffness, i)
    borne = total(loads)
    loads = loads * (pick(t.force, i) / np.where(borne > 0.0, borne, 1.0))
    image = np.zeros((t.image[..., 0].size, m))
    part = pick(state.part, i)
    every = np.arange(m)
    beside = len(t.columns) if t.rows > 1 else 0
    shares = zip(pick(state.taxel, i), loads * (1.0 - part), loads * part, strict=True)
    for taxel, first, second in shares:
        image[taxel, every] += first
        image[taxel + beside, every] += second
    t.image[:, :, i] = image.reshape(*t.image.shape[:2], m)
