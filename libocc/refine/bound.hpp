// SPDX-License-Identifier: Apache-2.0
// Cramer-Rao bound of the pose: no unbiased estimate from the same observations has a smaller
// covariance. For Gaussian observations of mean mu(x) and variance v(x) the Fisher information is
//     I_jk = sum mu_j mu_k / v + v_j v_k / (2 v^2),      subscripts: derivatives by x_j
// (Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, eq (3.31), due to
// Slepian and Bangs). The Schur complement eliminates the unknowns other than the pose; the bound
// is the inverse of the remaining information.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/refine/refine.hpp"

namespace occ {

/// Smallest covariance that an unbiased estimate of the pose can have.
struct PoseBound {
  Matrix6 covariance =
      unknown_covariance<6>();  ///< covariance of cam_from_world, see geometry/rigid.hpp
  Eigen::Matrix3d position_covariance_m2 = unknown_covariance<3>();  ///< covariance of the position
  int rank = 0;   ///< directions of the pose that are determined, of 6
  int lamps = 0;  ///< lamps or points that contribute
};

/// All functions of this header: status ok; too_few_lamps (fewer than three points or lamps, and
/// they do not determine the pose); degenerate (the information is singular to 1e-12 of its scale;
/// the message states its rank). Without a bound the covariance is infinite, never NaN. They throw
/// std::invalid_argument for a pose that is not finite.

/// Bound from image points with independent errors of sigma_px in x and y. Points outside the
/// camera's domain are ignored. Throws std::invalid_argument for points that are not finite, a
/// sigma that is not positive, or a number of sigmas that differs from the number of points.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                                        const Camera& camera, const Rigid3& cam_from_world,
                                        double sigma_px);
/// Bound with a sigma for each point.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                                        const Camera& camera, const Rigid3& cam_from_world,
                                        const std::vector<double>& sigmas_px);

/// Bound from the image of a scene, predicted with the sensor's noise:
///   points, centres   position of each lamp in the image; its size is known, its light and the
///                     background are unknown: a lower limit for the error of any centroid
///   rims              independent parts of each lamp's rim; light and background on both sides are
///                     known; the information per length along the rim is integral mu'^2 / v across
///                     it
///   direct            all pixels around the lamps; the light and background of each are unknown
/// The flux model adds the information of known lamp powers. Lamps that are dark, outside the image
/// or cut by its border are ignored. Throws std::invalid_argument if the scene is not valid.
LIBOCC_API Result<PoseBound> pose_bound(const Scene& scene, const Rigid3& cam_from_world,
                                        Rung rung = Rung::direct,
                                        FluxModel flux = FluxModel::ignore);

/// Bound from measured blobs with their stated sigmas at a given pose: the limit of refine() with
/// these options. Throws as refine() does.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Match>& matches,
                                        const std::vector<Blob>& blobs, const Scene& scene,
                                        const Rigid3& cam_from_world,
                                        const RefineOptions& options = {});

/// Bound for Rung::direct, which needs the image.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Match>& matches,
                                        const std::vector<Blob>& blobs, const Scene& scene,
                                        const Rigid3& cam_from_world, const RefineOptions& options,
                                        const ImageView& image);

}  // namespace occ
