// SPDX-License-Identifier: Apache-2.0
// Parts of the normal equations, kept for the protection level (refine/separation.hpp).
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"
#include "libocc/refine/separation.hpp"

namespace occ::internal::refine {

/// Contribution of one lamp; `shared` is empty if no error is shared.
struct LampPart {
  Matrix8 information = Matrix8::Zero();
  Vector8 gradient = Vector8::Zero();
  std::optional<SharedSums> shared;
};

/// Contributions of all lamps, and of the priors of pose, growth and log_factor.
struct NormalParts {
  std::vector<LampPart> lamps;
  Matrix8 prior = Matrix8::Zero();
};

/// Sums of the normal equations before a lamp is added.
class PartRecorder {
 public:
  PartRecorder(const PoseNormalEquations& normal, const SharedSums* shared);
  /// Sets `part` to the difference of the current sums from those at construction.
  void finish(const PoseNormalEquations& normal, const SharedSums* shared, LampPart& part) const;

 private:
  Matrix8 information_;
  Vector8 gradient_;
  std::optional<SharedSums> shared_;
};

/// Model of a minimum at `cam_from_world` with the estimated `shared_errors`; the gradients of the
/// parts are those without these errors. `lamps`: index in the scene of each part. Unknowns that no
/// lamp affects are left out.
SeparationModel separation_model(const NormalParts& parts, const std::vector<int>& lamps,
                                 const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
                                 const Eigen::VectorXd& shared_errors);

}  // namespace occ::internal::refine
