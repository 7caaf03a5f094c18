"""The elastic layer of `mujoco_touch`: the face of every soft object except a plant."""

import mujoco
import numpy as np

ABOVE_FLOOR_M = 0.30
"""Height of the middle of the contact."""
NET_M = 0.0108
FACE_M = 0.008
LAYER_KG_M2 = 8.7
"""The pitch of the net, half the face's thickness, and the layer's mass."""
SHEAR = 0.06
"""The layer's shear stiffness divided by modulus times thickness."""
CONTACT = "-1e5 -600"
SHEAR_N_M = 1e4
SHEAR_NS_M = 15.0
"""The skin's stretch along the forearm: its stiffness and its loss."""


def beneath_n_m(modulus_pa):
    """Stiffness of the layer beneath one taxel, finer than its net: 2 E times the net's
    pitch."""
    return 2.0 * modulus_pa * NET_M


def layer_xml(thing):
    """An elastic layer: a net of sprung knots, and both the springs between neighbours
    (together a Pasternak foundation) and the face stretched over the net.

    The face is smooth and its net as fine as the skin. Flat blocks would triple the
    highest load of a taxel, because a single pad bears each block. Compared with finite
    elements of an elastic block (8 kPa, 0.1 m thick, the arm upright or askew by 17
    degrees), the net's depth, area and highest load are within 15 %.
    """
    high = min(thing.height_m, 0.20)
    wide = min(thing.breadth_m, 0.15)
    rows = round(high / NET_M)
    cols = round(wide / NET_M)
    dz = high / rows
    dy = wide / cols
    k = thing.modulus_pa * dz * dy / thing.thick_m
    shear = SHEAR * thing.modulus_pa * thing.thick_m
    mass = LAYER_KG_M2 * dz * dy
    numbers = np.arange((rows + 1) * (cols + 1)).reshape(rows + 1, cols + 1)
    knots = ""
    springs = ""
    for (r, c), n in np.ndenumerate(numbers):
        # A knot on the rim stands for half of a cell, or at a corner for a quarter.
        of_row = 0.5 if r in (0, rows) else 1.0
        of_col = 0.5 if c in (0, cols) else 1.0
        part = of_row * of_col
        y = (c - cols / 2) * dy
        z = ABOVE_FLOOR_M + (r - rows / 2) * dz
        # A body with a face may have no damped joint, so the face hangs on a second.
        knots += (
            f'<body pos="{FACE_M} {y} {z}"><joint class="knot" name="b{n}" '
            f'stiffness="{k * part}" damping="{0.06 * (k * part) + 0.02}" '
            f'range="0 {thing.thick_m * 0.9}"/><inertial pos="0 0 0" '
            f'mass="{mass * part}" diaginertia="1e-6 1e-6 1e-6"/><body '
            f'name="n{n}"><inertial pos="0 0 0" mass="1e-5" '
            'diaginertia="1e-9 1e-9 1e-9"/></body></body>'
        )
        if r < rows:
            springs += spring_xml(n, n + cols + 1, shear * (dy / dz * of_col))
        if c < cols:
            springs += spring_xml(n, n + 1, shear * (dz / dy * of_row))
    return knots, f"<tendon>{springs}</tendon>{face_xml(numbers)}"


def spring_xml(first, second, stiffness):
    """A spring between two knots."""
    return (
        f'<fixed stiffness="{stiffness}"><joint joint="b{first}" coef="1"/>'
        f'<joint joint="b{second}" coef="-1"/></fixed>'
    )


def face_xml(numbers):
    """The face over the knots, of two triangles a cell, whose diagonals alternate."""
    rows, cols = numbers.shape
    triangles = []
    for r, c in np.ndindex(rows - 1, cols - 1):
        (a, b), (d, e) = numbers[r : r + 2, c : c + 2]
        triangles += [a, b, e, a, e, d] if (r + c) % 2 else [a, b, d, b, e, d]
    bodies = " ".join(f"n{n}" for n in numbers.flat)
    return (
        f'<deformable><flex name="face" dim="2" radius="{FACE_M}" body="{bodies}" '
        f'vertex="{"0 0 0 " * numbers.size}" '
        f'element="{" ".join(map(str, triangles))}"><contact '
        f'contype="2" conaffinity="1" selfcollide="none" condim="1" solref="{CONTACT}" '
        'solimp="0.95 0.95 0.001"/></flex></deformable>'
    )


class Rub:
    """Coulomb friction between skin and layer, on the stretch of the skin along the
    forearm; none of 0.

    Friction at each pad would jam instead. The knots under the pads yield in one
    direction only, so pads on the two sides of a dent would lean against each other and
    bear loads of no real net.
    """

    def __init__(self, model, pads, friction):
        self.model = model
        self.pads = pads
        self.friction = friction
        self.stretch = 0.0
        self.arm = model.body_parentid[pads[0]]
        self.thing = model.body("thing").id

    def hold(self, data, loads):
        """Set the pull of this step on arm and object, from the pads' loads (n,)."""
        data.qfrc_applied[:] = 0.0
        most = self.friction * float(loads.sum())
        if most == 0.0:
            self.stretch = 0.0
            return
        point = loads @ data.xpos[self.pads] / loads.sum()
        along = data.xmat[self.arm].reshape(3, 3)[:, 2]
        arm, thing = (self._speed(data, i, point) for i in (self.arm, self.thing))
        slips = along @ (arm - thing)
        pull = SHEAR_N_M * self.stretch + SHEAR_NS_M * slips
        longest = most / SHEAR_N_M
        stretch = self.stretch + slips * self.model.opt.timestep
        self.stretch = np.clip(stretch, -longest, longest)
        force = np.clip(pull, -most, most) * along
        applied = data.qfrc_applied
        zero = np.zeros(3)
        for body, push in ((self.arm, -force), (self.thing, force)):
            mujoco.mj_applyFT(self.model, data, push, zero, point, body, applied)

    def _speed(self, data, body, point):
        """(3,) m/s of a point of a body."""
        spatial = np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_BODY
        mujoco.mj_objectVelocity(self.model, data, kind, body, spatial, 0)
        return np.asarray(spatial[3:] + np.cross(spatial[:3], point - data.xpos[body]))
