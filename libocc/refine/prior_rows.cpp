// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/prior_rows.hpp"

namespace occ::internal::refine {

void add_prior(const Prior& prior, const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
               PoseNormalEquations& normal) {
  const PriorRows rows = prior.rows(cam_from_world);
  for (Eigen::Index i = 0; i < rows.residuals.size(); ++i) {
    Vector8 row = Vector8::Zero();
    row.head<6>() = rows.jacobian.row(i).transpose();
    centre_row(row, pivot);
    normal.add(row, rows.residuals[i]);
  }
}

}  // namespace occ::internal::refine
