// SPDX-License-Identifier: Apache-2.0
// Internal: poses from the measured outline of one lamp.
#pragma once

#include <vector>

#include "libocc/formation/rim.hpp"
#include "libocc/identify/internal/search_by_one_lamp.hpp"

namespace occ::internal::identify {

/// Central second moments of a lamp's face along x_axis and normal x x_axis.
Eigen::Matrix2d face_moments_m2(const Lamp& lamp);

/// Finds the poses at which a lamp has the outline of one blob. Starts follow from the second
/// moments of both areas: under weak perspective, they determine tilt and distance for each turn
/// about the normal. The distances of the rim points from the outline are then minimised, by
/// Levenberg-Marquardt, and all minima that fit are kept.
class OutlineSearch {
 public:
  /// Keeps references.
  OutlineSearch(const AssignmentProblem& problem, const Blob& blob);

  /// Those of a disc are arbitrary in its turn about the normal, for which they have no
  /// information. Empty for points and ellipses, and if the blob has no rim of the lamp's kind.
  std::vector<LampPose> poses(const Lamp& lamp);

 private:
  /// A pose of the lamp's own axes: x_axis, normal x x_axis and normal.
  struct Fit {
    Rigid3 cam_from_lamp;
    Matrix6 information = Matrix6::Zero();  ///< see LampPose::information
    double chi2 = 0;
    int lost = 0;  ///< rays that do not meet the outline
  };

  void find_rays();
  std::vector<Rigid3> starts(const Lamp& shape) const;
  Fit assess(const Lamp& shape, const Rigid3& cam_from_lamp, Vector6* gradient) const;
  Fit refined(const Lamp& shape, const Rigid3& start) const;
  std::vector<Fit> fits(const Lamp& shape) const;

  const AssignmentProblem& problem_;
  const Blob& blob_;
  double sigma_px_;
  std::vector<RimRay> rays_;
  struct Known {
    Lamp shape;  ///< with its own axes
    std::vector<Fit> fits;
  };
  std::vector<Known> known_;  ///< equal lamps have the same poses
};

}  // namespace occ::internal::identify
