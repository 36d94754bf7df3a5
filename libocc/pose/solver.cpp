// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solver.hpp"

#include <stdexcept>

#include "libocc/pose/solvers/dlt.hpp"
#include "libocc/pose/solvers/epnp.hpp"
#include "libocc/pose/solvers/gp3p.hpp"
#include "libocc/pose/solvers/gpnp.hpp"
#include "libocc/pose/solvers/homography.hpp"
#include "libocc/pose/solvers/ippe.hpp"
#include "libocc/pose/solvers/iterative.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/pose/solvers/p3p_gao.hpp"
#include "libocc/pose/solvers/p3p_kneip.hpp"
#include "libocc/pose/solvers/p3p_triples.hpp"
#include "libocc/pose/solvers/posit.hpp"
#include "libocc/pose/solvers/posit_coplanar.hpp"
#include "libocc/pose/solvers/sqpnp.hpp"
#include "libocc/pose/solvers/triangle.hpp"
#include "libocc/pose/solvers/upnp.hpp"
#include "libocc/pose/solvers/upright_p2p.hpp"

namespace occ {

const std::vector<Solver>& solvers() {
  static const std::vector<Solver> list = {
      // two points
      upright_p2p_solver,
      // three points
      p3p_solver, p3p_kneip_solver, p3p_gao_solver, triangle_solver, gp3p_solver,
      // three or more points
      sqpnp_solver, upnp_solver, p3p_triples_solver,
      // four or more points
      iterative_solver, ippe_solver, homography_solver, posit_coplanar_solver, posit_solver,
      epnp_solver,
      // six or more points
      dlt_solver, gpnp_solver};
  return list;
}

const Solver& solver_named(const std::string& name) {
  for (const Solver& solver : solvers())
    if (solver.name == name) return solver;
  std::string names;
  for (const Solver& solver : solvers())
    names += (names.empty() ? "" : ", ") + std::string(solver.name);
  throw std::invalid_argument("solver = \"" + name + "\" must be one of " + names);
}

}  // namespace occ
