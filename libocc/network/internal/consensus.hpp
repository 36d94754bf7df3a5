// SPDX-License-Identifier: Apache-2.0
// Intersection of rays, and the consensus of the images that observe one point or one body, or of
// the targets that one station observes.
//
// The consensus maximises the number of inliers over pairs of images (Fischler, Bolles, "Random
// sample consensus", CACM 24, 1981); cameras and stations are held. Robust weights alone fail here:
// with few rays, each one controls some direction of the point, and the point follows a gross
// error.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/internal/observation_rows.hpp"

namespace occ::internal::network {

/// Point with the least sum of squared distances to the rays; nothing for fewer than two rays or
/// for parallel ones. It is a start value: all rays have the same weight, whatever their range.
std::optional<Eigen::Vector3d> intersect_rays(const std::vector<Ray>& rays);

/// intersect_rays() for the rays of these image observations (indices).
std::optional<Eigen::Vector3d> intersect_observations(const Network& network,
                                                      const NetworkState& state,
                                                      const std::vector<int>& observations);

/// Indices of the used observations of each unknown point (body); empty for other points (bodies).
std::vector<std::vector<int>> observations_of_points(const Network& network,
                                                     const NetworkLayout& layout);
std::vector<std::vector<int>> observations_of_bodies(const Network& network,
                                                     const NetworkLayout& layout);

struct PointConsensus {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::vector<int> outliers;  ///< observations with residuals above the limit
  /// At least three observations and more than half of them are inliers, or no other hypothesis has
  /// as many inliers.
  bool reliable = false;
};

/// `limit`: length of an inlier's residual, in sigmas. The point stays where it is when most
/// observations are inliers there.
PointConsensus point_consensus(const Network& network, const NetworkState& state, int point,
                               const std::vector<int>& observations, double limit);

/// For each of these image observations: 1 if the length of its residual is below `limit` sigmas.
std::vector<char> inliers_at(const Network& network, const NetworkState& state,
                             const std::vector<int>& observations, double limit);

/// Similarity that moves points (columns) to others, by least squares, with a given scale or the
/// best one (Umeyama, "Least-squares estimation of transformation parameters between two point
/// patterns", PAMI 13, 1991).
Similarity similarity_between(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                              std::optional<double> scale);

struct BodyConsensus {
  Rigid3 world_from_body;
  double scale = 1;
  std::vector<int> outliers;  ///< observations with residuals above the limit
  bool reliable = false;      ///< more than half of the observed corners are inliers
};

/// Hypotheses: the corners that both images of a pair show are intersected, and the body is fitted
/// to them. The body stays where it is when most corners are inliers there. `state` is used as
/// scratch memory and restored.
BodyConsensus body_consensus(const Network& network, const NetworkLayout& layout,
                             NetworkState& state, int body, const std::vector<int>& observations,
                             double limit);

/// Indices of the used observations of each unknown station; empty for other stations.
std::vector<std::vector<int>> observations_of_stations(const Network& network,
                                                       const NetworkLayout& layout);

/// Pose at which most observations of a station are inliers. Hypotheses: P3P for three observations
/// of one image; points and bodies are held. The station stays where it is when three quarters of
/// its observations are inliers there, or when no hypothesis has more. `limit` as in
/// point_consensus(); `state` is used as scratch memory and restored.
Rigid3 station_consensus(const Network& network, const NetworkLayout& layout, NetworkState& state,
                         int station, const std::vector<int>& observations, double limit);

}  // namespace occ::internal::network
