// SPDX-License-Identifier: Apache-2.0
// Input of the assignment search, prepared once per image: blobs as bearings with the covariance of
// their direction, map points relative to a local origin, and the list of allowed assignments.
//
// The residual of a map point against a bearing is measured in the tangent plane of the bearing.
// For a point Y in the camera frame, relative to the origin of the ray,
//     e = tangent Y / (bearing . Y)      [rad, to first order].
// The local origin is the mean of the map points, so that large world coordinates cost no digits.
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"

namespace occ::internal::identify {

/// Measured direction of a whole blob (not cut by the border, not merged) of a lamp's colour.
struct BearingObservation {
  int blob = 0;                                      ///< index of the blob
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< origin of the ray, camera frame [m]
  double parallax_rad = 0;  ///< bound of the error when the origin is ignored
  Eigen::Vector3d bearing;  ///< unit vector, camera frame
  bool of_centre = false;   ///< true: of the lamp's centre; false: of the centroid of its image
  Eigen::Matrix<double, 2, 3> tangent;  ///< orthonormal rows perpendicular to the bearing
  Eigen::Vector3d axis;        ///< direction of depth: optical axis of a pinhole, else the bearing
  Eigen::Matrix2d covariance;  ///< covariance of e [rad^2], with the error of the camera model
  double sigma_rad = 0;        ///< largest standard deviation
  double min_radius_rad = 0;   ///< smallest apparent radius of a disc within the tolerance
  double max_radius_rad = 0;   ///< largest one; 0 without a measured rim
  double radius_rad = 0;       ///< radius of an unsaturated rim; 0 without one
  double radius_sigma = 0;     ///< relative
  double flatness = 1;         ///< minor axis over major axis
  double flux = 0;             ///< with vignetting corrected; 0 if unknown
  double flux_sigma = 0;       ///< relative
  bool flux_is_bound = false;  ///< true for a lower bound: saturated, cut or striped blob
  bool coded = false;          ///< candidate lamps come from a code or a blink frequency
  std::vector<int> lamps;      ///< candidate lamps, as indices of the map points
};

/// A lamp of a scene or a point of an object.
struct MapPoint {
  Eigen::Vector3d centre;  ///< relative to the local origin [m]
  Eigen::Vector3d normal;
  double radius_m = 0;  ///< radius of the circumscribed circle
  bool disc = false;
  double cone_cos = 0;  ///< cosine of the half angle of the cone from which the point is visible; 0
                        ///< for a lamp (half space), -2 for a point that is visible from everywhere
  double reliable_cos = 0.1;  ///< cosine of the narrower cone from which detection is certain
  double size_sigma = 0;      ///< relative standard deviation of radius_m
  double power_w = 0, power_sigma = 0, order = 1;  ///< power 0: unknown
  bool steady = true;  ///< false for a blinking lamp, whose flux is between dark and lit
  /// Emission by the photometry of the lamp, in the world's frame; none: Lambertian with `order`.
  std::shared_ptr<const scene::LampEmission> measured = nullptr;
  bool duplicate = false;  ///< an earlier point has the same position and represents both
};

/// Apparent over predicted size of a disc with a measured radius.
inline double size_ratio(const BearingObservation& observation, const MapPoint& disc,
                         double distance_m) {
  return observation.radius_rad * distance_m / disc.radius_m;
}

struct AssignmentProblem {
  const std::vector<Blob>* blobs = nullptr;
  const Camera* camera = nullptr;
  const Scene* scene = nullptr;  ///< null for the points of an object
  bool has_polygons = false;     ///< a blob with four corners may be another shape than a rectangle
  bool all_covisible = true;     ///< any points can be visible together, as lamps of a scene
  const IdentifyOptions* options = nullptr;
  int min_pairs = 0;                                 ///< hypotheses with fewer pairs are discarded
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< origin of the local frame, in the world
  double size_m = 0;                 ///< largest distance of a map point from the origin
  double map_variance_m2 = 0;        ///< largest variance of a lamp's position along an axis
  double min_radius_m = 0;           ///< radius of the smallest lamp; 0 if a lamp is a point
  std::vector<MapPoint> map_points;  ///< in the order of the scene's lamps or object's points
  std::vector<BearingObservation> observations;  ///< coded ones first, then by decreasing flux
  std::vector<char> foreign;       ///< for each blob: its colour contradicts all lamps
  std::vector<int> partial_blobs;  ///< cut or merged: their extent is used, not their centroid
  std::chrono::steady_clock::time_point deadline =
      std::chrono::steady_clock::time_point::max();  ///< the search stops then
  std::vector<char> allowed;  ///< [observation * map_points.size() + map_point]

  bool allows(int observation, int map_point) const {
    return allowed[observation * map_points.size() + map_point] != 0;
  }
  bool out_of_time() const {
    return deadline != std::chrono::steady_clock::time_point::max() &&
           std::chrono::steady_clock::now() >= deadline;
  }
  const BearingObservation& observation(int i) const { return observations[i]; }
  const MapPoint& map_point(int i) const { return map_points[i]; }
  /// Returns cam_from_world for a pose relative to the local frame.
  Rigid3 from_world(const Rigid3& cam_from_local) const {
    return {cam_from_local.rotation, cam_from_local.translation - cam_from_local.rotation * origin};
  }
};

/// Maximum number of observations; the blobs with the largest flux are used. TripleOrder keeps a
/// set of blobs in the bits of a 64-bit integer.
inline constexpr std::size_t max_observations = 64;

/// Maximum chi-square of a plausible hypothesis above that of the best one: 2 ln 1000, a likelihood
/// ratio of 1000.
inline constexpr double max_hypothesis_delta_chi2 = 13.8;

/// Throws std::invalid_argument for blobs that are not finite.
void require_finite(const std::vector<Blob>& blobs);

/// The arguments must outlive the problem.
LIBOCC_API AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene& scene,
                                          const IdentifyOptions& options);
LIBOCC_API AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Object& object,
                                          const Camera& camera, const IdentifyOptions& options);

/// Searches the assignments. Returns the hypotheses without a verdict: no probabilities, no risk,
/// and the status ok if there is one.
LIBOCC_API Result<Identification> solve_assignment(const AssignmentProblem& problem);

/// As identify(), without a verdict: refinement has more evidence.
LIBOCC_API Result<Identification> search_hypotheses(const std::vector<Blob>& blobs,
                                                    const Scene& scene,
                                                    const IdentifyOptions& options);

/// Returns the assignment at another pose: partial blobs and missed lamps are those of this pose,
/// and chi2 does not contain the prior. Empty if a lamp faces away or has another size there, or if
/// the pose is far outside the prior.
LIBOCC_API std::optional<Hypothesis> hypothesis_at(const AssignmentProblem& problem,
                                                   const std::vector<Match>& matches,
                                                   const Rigid3& cam_from_world);

}  // namespace occ::internal::identify
