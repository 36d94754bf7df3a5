// SPDX-License-Identifier: Apache-2.0
// Effect of the stated errors of the scene on the likelihood of the pose.
//
// Observations r = n - A d - G e with the pose's error d, independent errors e of unit variance and
// noise n of covariance V. With the errors eliminated, W = (V + G G^T)^-1, the information is
// A^T W A and the gradient is A^T W r. Its derivative by the errors is -A^T W G, and the noise
// alone gives it the covariance A^T W A - (A^T W G) (A^T W G)^T.
//
// A lamp that moves has the image of a lamp from which the camera moves: G = A T for the errors of
// a lamp, with the motion T. So the part A^T W G of a lamp is its part of the information times T.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::internal::refine {

struct ErrorGradient {
  struct Source {
    enum Kind { camera, map, lamp } kind;
    int component;       ///< index in LampError, or among the shared errors of camera or map
    int lamp_index = 0;  ///< in the scene
  };
  std::vector<Source> sources;  ///< one for each column
  /// A^T W G, for left perturbations of cam_from_world.
  Eigen::Matrix<double, 6, Eigen::Dynamic> gradient_by_errors;
};

/// Evaluated at a refined pose, for the lamps that were not left out. No columns if the scene is
/// exact. `options`: those of the refinement; the prior is not used.
LIBOCC_API ErrorGradient error_gradient(const Refined& refined, const std::vector<Blob>& blobs,
                                        const Scene& scene, RefineOptions options);

}  // namespace occ::internal::refine
