"""The tangential force of each pad of `mujoco_touch`, from MuJoCo's contacts."""

import mujoco
import numpy as np

from train.simulate.scene import CODY_SKIN


class Tangents:
    """Reads the tangential forces of a model's pads.

    Args:
        model: MuJoCo's.
        columns: (pads,) of the skin.
    """

    def __init__(self, model, columns):
        self._model = model
        bodies = [model.body(f"pad{number}").id for number in range(len(columns))]
        geoms = (int(model.body_geomadr[body]) for body in bodies)
        self._pad_of_geom = {geom: number for number, geom in enumerate(geoms)}
        self._arm = model.body_parentid[bodies[0]]
        degrees = np.array(CODY_SKIN["column_angles_deg"])
        angles = np.radians(degrees)[columns]
        turn = (degrees[1] - degrees[0] + 180.0) % 360.0 - 180.0
        around = [-np.sin(angles), np.cos(angles), np.zeros(len(columns))]
        self._around = np.sign(turn) * np.column_stack(around)
        """(pads, 3) towards the next column, in the arm's link."""

    def read(self, data, loads, pull):
        """(pads, 2) newtons on each pad along the rows and around the columns.

        The pull of a soft layer's skin friction is shared by the pads' loads.
        """
        forces = np.zeros((len(loads), 3))
        wrench = np.zeros(6)
        for number in range(data.ncon):
            contact = data.contact[number]
            first, second = (self._pad_of_geom.get(int(geom)) for geom in contact.geom)
            if first is second is None:
                continue
            mujoco.mj_contactForce(self._model, data, number, wrench)
            # The contact's normal points from its first geom to its second.
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            if second is None:
                forces[first] -= force
            else:
                forces[second] += force
        local = forces @ data.xmat[self._arm].reshape(3, 3)
        along = -local[:, 2]
        if loads.any():
            along += pull * loads / loads.sum()
        return np.column_stack([along, (local * self._around).sum(axis=1)])
