// SPDX-License-Identifier: Apache-2.0
// Start values for an adjustment: where a camera stood that saw points of known position, by any
// camera; both poses from which a small square is seen; and the focal length of a camera that saw
// planes. The camera need not be calibrated yet: nothing here takes the pixels to be good, gross
// errors may be a good third of them.
//
// Poses come from triples of points (pose/solvers/p3p.hpp; a camera without one centre is at first
// taken for one that has it) and are judged by the median of the distances between projected and
// seen points (Rousseeuw, "Least median of squares regression", JASA 79, 1984), then improved by
// Gauss and Newton's steps on pixels, Tukey's weights about that median.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/landmarks/april_tags.hpp"

namespace occ {

struct LIBOCC_API ResectionOptions {
  double min_sigma_px = 0.1;  ///< residuals below do not count as better
  double gate = 5;            ///< in robust standard deviations of the residuals: beyond is wrong
  int samples = 200;          ///< triples of points, where there are more
  std::uint64_t seed = 0;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct Resection {
  Rigid3 cam_from_world;
  double sigma_px = 0;         ///< robust standard deviation of the residuals, per axis
  std::vector<bool> agree;     ///< of each point
  std::vector<Rigid3> others;  ///< poses that fit up to three times as badly, best first
};

/// points_m: columns; points_px: columns, as many. Status: ok; too_few_lamps (fewer than four
/// points that the camera's domain holds); degenerate (they lie on a line); no_pose (no more than
/// half of them agree on one). Throws std::invalid_argument for counts that differ or values that
/// are not finite.
LIBOCC_API Result<Resection> resect(const Eigen::Matrix3Xd& points_m,
                                    const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                    const ResectionOptions& options = {});

/// The poses cam_from_tag from which a tag is seen, one or two, the better first, with the r.m.s.
/// of their residuals; none when it is outside the camera's domain.
struct TagSighting {
  Rigid3 cam_from_tag;
  double rms_px = 0;
};
LIBOCC_API std::vector<TagSighting> tag_sightings(const AprilTag& tag, double size_m,
                                                  const Camera& camera);

/// Points of a plane (in it, any unit) and where they were seen.
struct PlaneView {
  Eigen::Matrix2Xd plane, px;
};

/// A pinhole with square pixels and its principal point in the image's middle (Zhang, "A flexible
/// new technique for camera calibration", PAMI 22(11), 2000, equations 3 and 4, for one unknown).
/// Status: ok; too_few_lamps (no view of four points or more); degenerate (all planes are seen face
/// on, or what they say makes no focal length: the value has one of a view of 60 degrees).
LIBOCC_API Result<Camera> start_pinhole(const std::vector<PlaneView>& views, int width, int height);

/// A tag as such a view.
LIBOCC_API PlaneView plane_view(const AprilTag& tag);

/// The camera of any kind with focal lengths between a third and three times those given, both by
/// the same factor: the factor with which planes are planes, by trial; a fifth of the views may be
/// gross errors. Status: ok; too_few_lamps (as above); degenerate (no factor is much better than
/// others: the value is the camera given). Throws std::invalid_argument for a camera without focal
/// lengths (a rotating line's follows from its angle per column).
LIBOCC_API Result<Camera> start_focal_length(const std::vector<PlaneView>& views,
                                             const Camera& about);

}  // namespace occ
