// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/p3p_kneip.hpp"

#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/internal/opengv_types.hpp"

namespace occ::internal::pose {

void solve_p3p_kneip(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  add_opengv_p3p(opengv::absolute_pose::modules::p3p_kneip_main, problem, candidates);
}

}  // namespace occ::internal::pose
