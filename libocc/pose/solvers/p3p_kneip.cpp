// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/p3p_kneip.hpp"

#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/internal/opengv.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_p3p_kneip(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  add_opengv_p3p(opengv::absolute_pose::modules::p3p_kneip_main, problem, candidates);
}

}  // namespace

constexpr Solver p3p_kneip_solver = {
    /*name=*/"p3p_kneip",
    /*min_points=*/3,
    /*max_points=*/3,
    /*max_candidates=*/4, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "loses poses at double roots, on axes and planes of symmetry and in the plane of the points",
    /*source=*/"Kneip, Scaramuzza, Siegwart, CVPR 2011; OpenGV", solve_p3p_kneip};

}  // namespace occ
