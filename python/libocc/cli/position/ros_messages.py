# SPDX-License-Identifier: Apache-2.0
"""Poses as ROS has them: the camera's optical frame in the world, quaternions x y z w, covariances by
[x, y, z, turns about x, y, z], all along the axes of the world (the header's frame_id).

libocc's 6x6 covariance is of cam_from_world = (R, t), of [turn, shift] in the camera's frame by left
perturbation. The camera's place is -R^T t and its attitude R^T, so that

    d place = -R^T shift,   d turn in the world = -R^T turn.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .outputs import tum_line
from .record import Pose

Array = NDArray[np.float64]
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TEXT = "std_msgs/msg/String"


def ros_covariance(pose: Pose) -> Array:
    """(6, 6) of [x, y, z, turn about x, y, z] in the world's frame."""
    back = -pose.cam_from_world[:3, :3].T
    jacobian = np.block([[np.zeros((3, 3)), back], [back, np.zeros((3, 3))]])
    return np.asarray(jacobian @ pose.covariance @ jacobian.T)


def pose_message(store: Any, pose: Pose, frame_id: str, sequence: int | None) -> Any:
    """A PoseWithCovarianceStamped; sequence: of ROS 1's headers, None for ROS 2."""
    types = store.types
    nanoseconds = round(1e9 * pose.time_s)
    stamp = types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
    numbers = {} if sequence is None else {"seq": sequence}
    header = types["std_msgs/msg/Header"](**numbers, stamp=stamp, frame_id=frame_id)
    x, y, z, qx, qy, qz, qw = map(float, tum_line(pose).split()[1:])
    place = types["geometry_msgs/msg/Point"](x=x, y=y, z=z)
    turn = types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw)
    both = types["geometry_msgs/msg/PoseWithCovariance"](
        pose=types["geometry_msgs/msg/Pose"](position=place, orientation=turn),
        covariance=ros_covariance(pose).reshape(36),
    )
    return types[POSE](header=header, pose=both)
