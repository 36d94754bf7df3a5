// SPDX-License-Identifier: Apache-2.0
// Start values for an adjustment: resection for any camera, both poses of a tag, focal lengths from
// images of planes, and the curvature of a tag's sides. The camera may be uncalibrated; up to a
// third of the points may be gross errors.
//
// Resection: poses from triples of points (pose/solvers/p3p.hpp; a camera without a single centre
// is first approximated by one that has it) are scored by the median distance between projected and
// observed points (Rousseeuw, "Least median of squares regression", JASA 79, 1984). Gauss-Newton
// steps on pixels with Tukey's weights at the scale of that median refine the best ones.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/landmarks/april_tags.hpp"

namespace occ {

/// Options of resect().
struct LIBOCC_API ResectionOptions {
  double min_sigma_px = 0.1;  ///< lower bound of the residuals' standard deviation
  double gate = 5;            ///< inliers' largest residual, in robust standard deviations
  int samples = 200;          ///< limit of the number of triples; random ones if there are more
  std::uint64_t seed = 0;     ///< seed of the random triples

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Pose of one image, computed from known points without a start value.
struct Resection {
  Rigid3 cam_from_world;             ///< pose with the smallest scale of the residuals
  double sigma_px = 0;               ///< robust standard deviation of the residuals, per axis
  std::vector<bool> inliers;         ///< one per point
  std::vector<Rigid3> alternatives;  ///< poses with up to three times this sigma_px, best first
};

/// Pose of a camera from known points. points_m: 3 x n [m]; points_px: 2 x n. Status: ok;
/// too_few_lamps (fewer than four points in the camera's domain); degenerate (collinear points);
/// no_pose (no pose fits half of the points). Throws std::invalid_argument for counts that differ
/// or values that are not finite.
LIBOCC_API Result<Resection> resect(const Eigen::Matrix3Xd& points_m,
                                    const Eigen::Matrix2Xd& points_px, const Camera& camera,
                                    const ResectionOptions& options = {});

/// One of the (at most two) poses of a tag in an image, with the r.m.s. of the corners' residuals.
struct TagPoseHypothesis {
  Rigid3 cam_from_tag;  ///< tag frame: x to the right, y up, z towards the viewer
  double rms_px = 0;    ///< over the four corners
};

/// Both poses of a tag, or one if they coincide, best first; none when a corner is outside the
/// camera's domain. size_m: side of the black square.
LIBOCC_API std::vector<TagPoseHypothesis> tag_pose_hypotheses(const AprilTag& tag, double size_m,
                                                              const Camera& camera);

/// Curvature of the sides of a tag's image, for AprilTagOptions::bends_px when corners are measured
/// again with a calibrated camera. With u from -1 to 1 along a side, a point of the side deviates
/// from the chord by b (1 - u^2) on average; the function returns b [px] of the sides from corner k
/// to the next. b is zero outside the camera's domain.
LIBOCC_API std::function<std::array<double, 4>(const std::array<Eigen::Vector2d, 4>& corners_px)>
side_bends(const Camera& camera);

/// Points of a plane (2 x n, any unit) and their image points (2 x n).
struct PlaneView {
  Eigen::Matrix2Xd plane, px;  ///< column k of `plane` is observed at column k of `px`
};

/// Pinhole camera with square pixels and its principal point in the middle of the image (Zhang, "A
/// flexible new technique for camera calibration", PAMI 22(11), 2000, equations 3 and 4, for one
/// unknown). Status: ok; too_few_lamps (no view of four points or more); degenerate (all planes are
/// parallel to the image, or the equations have no solution; the value then has a view of 60
/// degrees).
LIBOCC_API Result<Camera> start_pinhole(const std::vector<PlaneView>& views, int width, int height);

/// A tag as the view of a plane.
LIBOCC_API PlaneView plane_view(const AprilTag& tag);

/// Scales the focal lengths of an approximate camera of any model by the factor, 1/3 to 3, with the
/// least residuals of the planes (grid search). A fifth of the views may be gross errors. Status:
/// ok; too_few_lamps (as above); degenerate (no factor is much better than the others; the value is
/// the given camera). Throws std::invalid_argument for a camera without focal lengths (that of a
/// rotating line follows from its angle per column).
LIBOCC_API Result<Camera> start_focal_length(const std::vector<PlaneView>& views,
                                             const Camera& approximate);

}  // namespace occ
