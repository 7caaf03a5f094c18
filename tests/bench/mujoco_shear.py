"""The tangential force of each pad of `mujoco_touch`, from MuJoCo's contacts."""

from itertools import count

import mujoco
import numpy as np

from train.simulate.scene import CODY_SKIN

DEGREES = np.array(CODY_SKIN["column_angles_deg"])
TURN = np.sign((DEGREES[1] - DEGREES[0] + 180.0) % 360.0 - 180.0)
"""The sense around the arm in which columns follow each other."""


def tangents(model, data, pads, columns, loads, pull):
    """(n, 2) newtons on each pad along the rows and around the columns.

    The pull of a soft layer's skin friction is shared by the pads' loads.

    Args:
        model, data: MuJoCo's.
        pads, columns: (n,) body and column of each pad.
        loads: (n,) newtons on each pad along its normal.
        pull: newtons of a soft layer's skin friction.
    """
    places = dict(zip(model.body_geomadr[pads].tolist(), count()))
    forces = np.zeros((len(loads), 3))
    wrench = np.zeros(6)
    for number in range(data.ncon):
        contact = data.contact[number]
        mujoco.mj_contactForce(model, data, number, wrench)
        force = contact.frame.reshape(3, 3).T @ wrench[:3]
        # The contact's normal points from its first geom to its second.
        for geom, sign in zip(contact.geom.tolist(), (-1.0, 1.0), strict=True):
            if geom in places:
                forces[places[geom]] += sign * force
    arm = model.body_parentid[pads[0]]
    x, y, z = (forces @ data.xmat[arm].reshape(3, 3)).T
    angles = np.radians(DEGREES)[columns]
    around = TURN * (np.cos(angles) * y - np.sin(angles) * x)
    along = -z
    if loads.any():
        along += pull * loads / loads.sum()
    return np.column_stack([along, around])
