// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/p3p_gao.hpp"

#include <opengv/absolute_pose/modules/main.hpp>

#include "libocc/pose/internal/opengv.hpp"

namespace occ {

using namespace internal::pose;
namespace {

void solve_p3p_gao(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  add_opengv_p3p(opengv::absolute_pose::modules::p3p_gao_main, problem, candidates);
}

}  // namespace

constexpr Solver p3p_gao_solver = {/*name=*/"p3p_gao",
                                   /*min_points=*/3,
                                   /*max_points=*/3,
                                   /*max_candidates=*/4, Layout::any,
                                   /*needs_up=*/false,
                                   /*takes_origins=*/false,
                                   /*failures=*/
                                   "loses digits at narrow views: at 20 to 100 times the points' "
                                   "size, a third of the poses is exact to 1e-6",
                                   /*source=*/"Gao, Hou, Tang, Cheng, PAMI 25(8), 2003; OpenGV",
                                   solve_p3p_gao};

}  // namespace occ
