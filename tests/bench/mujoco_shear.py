"""The tangential force of each pad of `mujoco_touch`, from MuJoCo's contacts."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from train.simulate.scene import CODY_SKIN


class Tangents:
    """Reads the tangential forces of a model's pads.

    Args:
        model: MuJoCo's.
        where: (row, column) of each pad.
    """

    def __init__(self, model, where):
        self._model = model
        self._pad_of_geom = {}
        for number in range(len(where)):
            body = model.body(f"pad{number}").id
            self._pad_of_geom[int(model.body_geomadr[body])] = number
        self._arm = model.body_parentid[model.body("pad0").id]
        angles = np.radians([CODY_SKIN["column_angles_deg"][c] for _, c in where])
        self._around = np.column_stack(
            [-np.sin(angles), np.cos(angles), np.zeros(len(where))]
        )
        """(pads, 3) towards higher angles, in the arm's link."""
        columns = np.array(CODY_SKIN["column_angles_deg"])
        turn = (columns[1] - columns[0] + 180.0) % 360.0 - 180.0
        self._sign = math.copysign(1.0, turn)

    def read(self, data, loads, rub):
        """(pads, 2) newtons on each pad along the rows and around the columns.

        The pull of a soft layer's skin friction is shared by the pads' loads.
        """
        forces = np.zeros((len(self._around), 3))
        wrench = np.zeros(6)
        for number in range(data.ncon):
            contact = data.contact[number]
            first, second = (int(geom) for geom in contact.geom)
            pad = self._pad_of_geom.get(second, self._pad_of_geom.get(first))
            if pad is None:
                continue
            mujoco.mj_contactForce(self._model, data, number, wrench)
            # The contact's normal points from its first geom to its second.
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            forces[pad] += force if second in self._pad_of_geom else -force
        local = forces @ data.xmat[self._arm].reshape(3, 3)
        along = -local[:, 2]
        if rub is not None and loads.sum() > 0.0:
            along = along + rub.pull * loads / loads.sum()
        around = self._sign * (local * self._around).sum(axis=1)
        return np.column_stack([along, around])
