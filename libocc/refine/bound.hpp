// SPDX-License-Identifier: Apache-2.0
// The Cramer-Rao bound of the pose: no unbiased estimate from the same observations has a smaller
// covariance. With Gaussian observations of mean mu(x) and variance v(x) the Fisher information is
//     I_jk = sum mu_j mu_k / v + v_j v_k / (2 v^2),      subscripts: derivatives by x_j
// (Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, eq (3.31), due to
// Slepian and Bangs); unknowns that are not the pose are eliminated by the Schur complement, and
// the bound is the inverse of what is left.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/refine/refine.hpp"

namespace occ {

struct PoseBound {
  Matrix6 covariance = unknown_covariance<6>();  ///< of cam_from_world, see geometry/rigid.hpp
  Eigen::Matrix3d position_covariance_m2 = unknown_covariance<3>();  ///< of the camera's position
  int rank = 0;   ///< directions of the pose that are determined, of 6
  int lamps = 0;  ///< lamps or points that contribute
};

/// Every function here: status ok; too_few_lamps (fewer than three points or lamps, and they do not
/// determine the pose); degenerate (the information is singular to 1e-12 of its scale; the message
/// says its rank). The covariance is infinite where there is no bound, never NaN. A pose that is
/// not finite throws std::invalid_argument.

/// From image points: independent errors of sigma_px in x and y. Points outside the camera's domain
/// are left out. Throws std::invalid_argument for points that are not finite, a sigma that is not
/// positive, or another number of sigmas than of points.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                                        const Camera& camera, const Rigid3& cam_from_world,
                                        double sigma_px);
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Eigen::Vector3d>& points_in_world,
                                        const Camera& camera, const Rigid3& cam_from_world,
                                        const std::vector<double>& sigmas_px);

/// From what the scene says an image at this pose would show, by the sensor's noise:
///   points, centres   each lamp's place in the image, its size known, its light and the background
///                     not: the least that any centroid can err
///   rims              each part of a lamp's rim for itself, light and background on its two sides
///                     known; per length along the rim the information is integral mu'^2 / v across
///   direct            all pixels around the lamps, each lamp's light and background unknown
/// The flux model adds what is known of light: lamp powers, up to a common factor or not. Lamps
/// that are dark, outside the image or cut by its border are left out. Throws
/// std::invalid_argument when the scene does not validate.
LIBOCC_API Result<PoseBound> pose_bound(const Scene& scene, const Rigid3& cam_from_world,
                                        Rung rung = Rung::direct,
                                        FluxModel flux = FluxModel::ignore);

/// From observations as they are, with their stated sigmas, at a given pose: what refine() with
/// these options could attain. Throws as refine() does.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Match>& matches,
                                        const std::vector<Blob>& blobs, const Scene& scene,
                                        const Rigid3& cam_from_world,
                                        const RefineOptions& options = {});

/// The same with the image, for Rung::direct.
LIBOCC_API Result<PoseBound> pose_bound(const std::vector<Match>& matches,
                                        const std::vector<Blob>& blobs, const Scene& scene,
                                        const Rigid3& cam_from_world, const RefineOptions& options,
                                        const ImageView& image);

}  // namespace occ
