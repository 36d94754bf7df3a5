# SPDX-License-Identifier: Apache-2.0
"""Poses as ROS messages: pose of the camera's optical frame in the world, quaternion order x y z w, covariance order
[x, y, z, rotations about x, y, z] along the axes of the world frame (frame_id of the header).

libocc's 6x6 covariance refers to cam_from_world = (R, t) with the left perturbation [rotation r, translation s] in the
camera frame. The position of the camera is -R^T t and its attitude R^T, so that

    d position = -R^T s,   d rotation in the world = -R^T r.
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
    """(6, 6) covariance of [x, y, z, rotations about x, y, z] in the world frame."""
    back = -pose.cam_from_world[:3, :3].T
    jacobian = np.block([[np.zeros((3, 3)), back], [back, np.zeros((3, 3))]])
    return np.asarray(jacobian @ pose.covariance @ jacobian.T)


def pose_message(store: Any, pose: Pose, frame_id: str, sequence: int | None) -> Any:
    """Message PoseWithCovarianceStamped. sequence: number for the header in ROS 1, None for ROS 2."""
    types = store.types
    nanoseconds = round(1e9 * pose.time_s)
    stamp = types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
    numbers = {} if sequence is None else {"seq": sequence}
    header = types["std_msgs/msg/Header"](**numbers, stamp=stamp, frame_id=frame_id)
    x, y, z, qx, qy, qz, qw = map(float, tum_line(pose).split()[1:])
    position = types["geometry_msgs/msg/Point"](x=x, y=y, z=z)
    rotation = types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw)
    pose_with_covariance = types["geometry_msgs/msg/PoseWithCovariance"](
        pose=types["geometry_msgs/msg/Pose"](position=position, orientation=rotation),
        covariance=ros_covariance(pose).reshape(36),
    )
    return types[POSE](header=header, pose=pose_with_covariance)
