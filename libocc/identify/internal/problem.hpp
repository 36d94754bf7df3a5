// SPDX-License-Identifier: Apache-2.0
// Internal: what the search for names needs, prepared once: blobs as bearings with the covariance
// of their direction, lamps about a local origin (so that large world coordinates cost no digits),
// and which blob may be which lamp.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"

namespace occ::internal::identify {

/// A blob that is a whole lamp. The direction of a point Y is compared with it in its tangent
/// plane: e = tangent Y / (bearing . Y), in radians to first order, Y counted from where the ray
/// starts.
struct BearingObservation {
  int blob = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the ray, camera frame [m]
  double parallax_rad = 0;              ///< what leaving the origin out may turn a direction by
  Eigen::Vector3d bearing;              ///< unit, camera frame
  Eigen::Matrix<double, 2, 3> tangent;  ///< orthonormal rows across the bearing
  Eigen::Vector3d axis;                 ///< along which depth counts: a pinhole's, else the bearing
  Eigen::Matrix2d covariance;           ///< [rad^2] in that plane, the model's error included
  double sigma_rad = 0;                 ///< largest standard deviation
  double min_radius_rad = 0;            ///< apparent radius of a disc, with room for its error
  double largest_radius_rad = 0;        ///< 0 when no rim was measured
  double radius_rad = 0;                ///< of an unsaturated rim; 0 when there is none
  double radius_sigma = 0;              ///< relative
  double flatness = 1;                  ///< shorter axis over longer one
  double flux = 0;                      ///< before the lens; 0 when unknown
  double flux_sigma = 0;                ///< relative
  bool flux_is_bound = false;           ///< of the lamp's, from below: saturated, cut, striped
  bool named = false;                   ///< by its code or frequency
  std::vector<int> lamps;               ///< those it may be
};

struct MapPoint {
  Eigen::Vector3d centre;  ///< about the local origin [m]
  Eigen::Vector3d normal;
  double radius_m = 0;  ///< of the smallest circle around it
  bool disc = false;
  double cone_cos = 0;    ///< seen where the angle from the normal has a larger cosine: of a lamp
                          ///< the half space; -2: from everywhere
  double sure_cos = 0.1;  ///< and not to be overlooked there: farther inside that cone
  double power_w = 0, power_sigma = 0, order = 1;  ///< power 0: not known
  bool steady = true;  ///< does not blink, which leaves a flux between dark and lit
  bool twin = false;   ///< an earlier one is in the same place and stands for both
};

struct AssignmentProblem {
  const std::vector<Blob>* blobs = nullptr;
  const Camera* camera = nullptr;
  const Scene* scene = nullptr;  ///< null for the points of an object
  bool all_together = true;      ///< any of them can be seen at once, as lamps of a scene
  const IdentifyOptions* options = nullptr;
  int min_pairs = 0;                                 ///< explanations of fewer blobs are of no use
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the local frame, in the world
  double size_m = 0;                                 ///< largest distance of a lamp from it
  std::vector<MapPoint> targets;  ///< one for each lamp or point, in the order of scene or object
  std::vector<BearingObservation> sightings;  ///< named first, then the brightest
  std::vector<int>
      weak_blobs;             ///< cut or merged: their centroid says little, their place something
  std::vector<char> allowed;  ///< [sighting * targets + target]

  bool may_be(int sighting, int target) const {
    return allowed[static_cast<std::size_t>(sighting) * targets.size() +
                   static_cast<std::size_t>(target)] != 0;
  }
  const BearingObservation& sighting(int i) const { return sightings[i]; }
  const MapPoint& target(int i) const { return targets[i]; }
  Rigid3 from_world(const Rigid3& cam_from_local) const {
    return {cam_from_local.rotation, cam_from_local.translation - cam_from_local.rotation * origin};
  }
};

/// More whole blobs than this are not looked at; the brightest are.
inline constexpr std::size_t max_sightings = 64;

/// All that is given must outlive the problem.
LIBOCC_API AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Scene& scene,
                                          const IdentifyOptions& options);
LIBOCC_API AssignmentProblem make_problem(const std::vector<Blob>& blobs, const Object& object,
                                          const Camera& camera, const IdentifyOptions& options);

}  // namespace occ::internal::identify
