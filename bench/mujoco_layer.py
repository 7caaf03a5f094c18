"""The elastic layer of `mujoco_touch`: the face of every soft thing except a plant."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

ABOVE_FLOOR_M = 0.30
"""Height of the middle of the contact."""
NET_M, FACE_M, LAYER_KG_M2 = 0.0108, 0.008, 8.7
"""The pitch of the net, half the face's thickness, and the layer's mass."""
SHEAR = 0.06
"""The layer's shear stiffness divided by modulus times thickness."""
SOLIMP, CONTACT = 0.95, "-1e5 -600"
SHEAR_N_M, SHEAR_NS_M = 1e4, 15.0
"""The skin's stretch along the forearm: its stiffness and its loss."""


def beneath_n_m(modulus_pa: float) -> float:
    """Stiffness of the layer beneath one taxel, finer than its net: 2 E times the net's pitch."""
    return 2.0 * modulus_pa * NET_M


def layer_xml(
    height_m: float, breadth_m: float, modulus_pa: float, thick_m: float
) -> tuple[str, str, str]:
    """An elastic layer: a net of sprung knots, the springs between neighbours (together a Pasternak
    foundation) and the face stretched over the net.

    The face is smooth and its net as fine as the skin. Flat blocks would triple the highest load of
    a taxel, because a single pad bears each block. Compared with finite elements of an elastic
    block (8 kPa, 0.1 m thick, the arm upright or askew by 17 degrees), the net's depth, area and
    highest load are within 15 %.
    """
    high, wide = min(height_m, 0.20), min(breadth_m, 0.15)
    rows, cols = round(high / NET_M), round(wide / NET_M)
    dz, dy = high / rows, wide / cols
    k = modulus_pa * dz * dy / thick_m
    shear = SHEAR * modulus_pa * thick_m
    mass = LAYER_KG_M2 * dz * dy
    xml, between, knots = "", "", []
    for r in range(rows + 1):
        for c in range(cols + 1):
            share = (0.5 if r in (0, rows) else 1.0) * (0.5 if c in (0, cols) else 1.0)
            y, z = (c - cols / 2) * dy, ABOVE_FLOOR_M + (r - rows / 2) * dz
            # A body with a face may have no damped joint, so the face hangs on a second body.
            xml += (
                f'<body pos="{FACE_M} {y} {z}"><joint name="b{r}_{c}" type="slide" axis="1 0 0" '
                f'stiffness="{k * share}" damping="{0.06 * k * share + 0.02}" '
                f'range="0 {thick_m * 0.9}" limited="true"/><inertial pos="0 0 0" '
                f'mass="{mass * share}" diaginertia="1e-6 1e-6 1e-6"/><body name="n{r}_{c}">'
                '<inertial pos="0 0 0" mass="1e-5" diaginertia="1e-9 1e-9 1e-9"/></body></body>'
            )
            knots.append(f"n{r}_{c}")
            beside = [(r + 1, c, dy / dz * (0.5 if c in (0, cols) else 1.0))]
            beside += [(r, c + 1, dz / dy * (0.5 if r in (0, rows) else 1.0))]
            for r2, c2, share in beside:
                if r2 <= rows and c2 <= cols:
                    between += (
                        f'<fixed stiffness="{shear * share}"><joint joint="b{r}_{c}" coef="1"/>'
                        f'<joint joint="b{r2}_{c2}" coef="-1"/></fixed>'
                    )
    triangles = []
    for r in range(rows):
        for c in range(cols):
            a = r * (cols + 1) + c
            b, d, e = a + 1, a + cols + 1, a + cols + 2
            triangles += [a, b, e, a, e, d] if (r + c) % 2 else [a, b, d, b, e, d]
    face = (
        f'<deformable><flex name="face" dim="2" radius="{FACE_M}" body="{" ".join(knots)}" '
        f'vertex="{"0 0 0 " * len(knots)}" element="{" ".join(map(str, triangles))}"><contact '
        f'contype="2" conaffinity="1" selfcollide="none" condim="1" solref="{CONTACT}" '
        f'solimp="{SOLIMP} {SOLIMP} 0.001"/></flex></deformable>'
    )
    return xml, between, face


class Rub:
    """Coulomb friction between skin and layer, on the stretch of the skin along the forearm.

    Friction at each pad would jam instead. The knots under the pads yield in one direction only, so
    pads on the two sides of a dent would lean against each other and bear loads of no real net.
    """

    def __init__(self, model: Any, friction: float) -> None:
        self.model, self.friction, self.stretch = model, friction, 0.0
        self.pads = [i for i in range(model.nbody) if model.body(i).name.startswith("pad")]
        self.arm, self.thing = model.body_parentid[self.pads[0]], model.body("thing").id

    def hold(self, data: Any, loads: NDArray[np.float64]) -> None:
        """Set the pull of this step on arm and thing, from the pads' loads (n,)."""
        data.qfrc_applied[:] = 0.0
        most = self.friction * float(loads.sum())
        if most == 0.0:
            self.stretch = 0.0
            return
        point = loads @ data.xpos[self.pads] / loads.sum()
        along = data.xmat[self.arm].reshape(3, 3)[:, 2]
        slips = along @ (self._speed(data, self.arm, point) - self._speed(data, self.thing, point))
        pull = SHEAR_N_M * self.stretch + SHEAR_NS_M * slips
        pull = min(max(pull, -most), most)
        stretch, longest = self.stretch + slips * self.model.opt.timestep, most / SHEAR_N_M
        self.stretch = min(max(stretch, -longest), longest)
        for body, force in ((self.arm, -pull * along), (self.thing, pull * along)):
            mujoco.mj_applyFT(self.model, data, force, np.zeros(3), point, body, data.qfrc_applied)

    def _speed(self, data: Any, body: int, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """(3,) m/s of a point of a body."""
        spatial = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, data, mujoco.mjtObj.mjOBJ_BODY, body, spatial, 0)
        return np.asarray(spatial[3:] + np.cross(spatial[:3], point - data.xpos[body]))
