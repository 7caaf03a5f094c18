"""The arm's joint angles.

| feature, of each joint | unit | from |
|---|---|---|
| `joint_change`, at ten times | radian | the recording's angles, from onset on |
| `joint_change_rate` | radian/s | the same |
| `joint_angle`, at ten times | radian | the angles themselves |

How far joints yield depends on the object that is touched. The angles themselves (`POSTURE`) give a
gripper the object's size, and an arm its place: where each object stood in a place of its own, they
recognise it for a reason that holds in that room alone.
"""

FEATURES = ("joint_change@10", "joint_change_rate@10")
POSTURE = ("joint_angle@10",)
