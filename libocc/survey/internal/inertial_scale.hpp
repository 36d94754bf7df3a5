// SPDX-License-Identifier: Apache-2.0
// Scale of a map by an inertial measurement unit that moves with the camera.
//
// 1. Time offset, axes and gyroscope bias: the turns of the unit between two pictures are those of
//    the camera, R_cam = R_ci R_imu R_ci^T (inertial_axes.hpp).
// 2. Scale: between two pictures, with the accelerations integrated in the unit's first frame
//    (velocity b, position a; Forster et al., "On-manifold preintegration for real-time
//    visual-inertial odometry", IEEE T-RO 33, 2017),
//
//        s (p_j - p_i) + (R_j - R_i) r - v_i dt - g dt^2 / 2 = R_i R_ci a
//        v_j - v_i - g dt = R_i R_ci b
//
//    with the scale s, the velocities v, gravity g of known magnitude, the place r of the unit in
//    the camera's frame, gain and bias of the accelerometer, and the errors of step 1 and of the
//    poses as unknowns. The noise of the accelerations is that of greatest restricted likelihood
//    (Patterson, Thompson, "Recovery of inter-block information when block sizes are unequal",
//    1971), so that the sigma of the scale contains errors of any origin that act as such noise.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// Pose of a picture in the map, whose unit is arbitrary.
struct TimedPose {
  int picture = 0;  ///< index into the list of pictures
  double time_s = 0;
  Rigid3 cam_from_map;
  Matrix6 covariance = Matrix6::Zero();  ///< see rigid.hpp
};

/// Scale of the map and alignment of the unit. Status: ok; too_few_lamps: too few pictures have
/// inertial measurements; no_pose: the turns disagree; degenerate: the motion does not determine
/// the axes or the scale. The message has the figures. Poses and samples: increasing times.
LIBOCC_API Result<InertialAlignment> align_inertial(const std::vector<TimedPose>& poses,
                                                    const std::vector<ImuSample>& imu);

}  // namespace occ::internal::survey
