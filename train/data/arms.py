"""The arms and joint angles of recordings."""

from collections.abc import Sequence
from pathlib import Path

from edge.errors import InputError
from edge.record.recording import Recording
from edge.touch.arm import Chain


def arm_of(
    recording: Recording,
    where: str,
    unnamed: Chain | None = None,
) -> Chain | None:
    """The recording's arm: its `meta.arm`, else `unnamed`, else Cody's where it has
    five angles.

    None without joint angles, and where `meta.arm` is None.
    """
    # With an arm of None, the joints are not those of an arm that carries the skin.
    if recording.joints is None or recording.meta.get("arm", {}) is None:
        return None
    dof = recording.joints.shape[1]
    arm = recording.meta.get("arm")
    if arm is not None:
        chain = Chain.from_dict(arm, where=f"{where}: meta.arm")
    elif unnamed is not None:
        chain = unnamed
    else:
        chain = Chain.cody()
        if dof != chain.dof or recording.joint_names not in (None, chain.names):
            raise InputError(
                f"{where}: has {dof} joint angles and names no arm; give --arm"
            )
    if recording.joint_names is not None:
        recording.for_joints(chain.names, where)
    elif dof != chain.dof:
        raise InputError(f"{where}: has {dof} joint angles, its arm takes {chain.dof}")
    return chain


def joint_angles(files: Sequence[tuple[Recording, Path]]) -> int:
    """The number of joint angles, the same for every recording."""
    counts = [0 if r.joints is None else r.joints.shape[1] for r, _ in files]
    for count, (_, path) in zip(counts, files, strict=True):
        if count == 0:
            raise InputError(
                f"{path}: has no joint angles; leave out the features made of them"
            )
        if count != counts[0]:
            raise InputError(
                f"{path}: has {count} joint angles, {files[0][1]} has {counts[0]}"
            )
    return counts[0]
