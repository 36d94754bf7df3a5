// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solver.hpp"

#include <algorithm>
#include <stdexcept>

#include "libocc/pose/internal/missing_method.hpp"
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

// Solvers whose sources a build leaves out have no object.
#if LIBOCC_OPENCV
#define LIBOCC_WITH_OPENCV(solver) &solver
#else
#define LIBOCC_WITH_OPENCV(solver) nullptr
#endif
#if LIBOCC_OPENGV
#define LIBOCC_WITH_OPENGV(solver) &solver
#else
#define LIBOCC_WITH_OPENGV(solver) nullptr
#endif

namespace occ {
namespace {

struct Entry {
  MissingMethod method;  // name, and the option that includes it
  const Solver* solver;  // null if this build does not contain it
};

constexpr const char* own = "";
constexpr const char* opencv = "LIBOCC_OPENCV";
constexpr const char* opengv = "LIBOCC_OPENGV";

const Entry entries[] = {
    // two points
    {{"upright_p2p", own}, &upright_p2p_solver},
    // three points
    {{"p3p", own}, &p3p_solver},
    {{"p3p_kneip", opengv}, LIBOCC_WITH_OPENGV(p3p_kneip_solver)},
    {{"p3p_gao", opengv}, LIBOCC_WITH_OPENGV(p3p_gao_solver)},
    {{"triangle", own}, &triangle_solver},
    {{"gp3p", opengv}, LIBOCC_WITH_OPENGV(gp3p_solver)},
    // three or more points
    {{"sqpnp", opencv}, LIBOCC_WITH_OPENCV(sqpnp_solver)},
    {{"upnp", opengv}, LIBOCC_WITH_OPENGV(upnp_solver)},
    {{"p3p_triples", own}, &p3p_triples_solver},
    // four or more points
    {{"iterative", opencv}, LIBOCC_WITH_OPENCV(iterative_solver)},
    {{"ippe", opencv}, LIBOCC_WITH_OPENCV(ippe_solver)},
    {{"homography", own}, &homography_solver},
    {{"posit_coplanar", own}, &posit_coplanar_solver},
    {{"posit", own}, &posit_solver},
    {{"epnp", opengv}, LIBOCC_WITH_OPENGV(epnp_solver)},
    // six or more points
    {{"dlt", own}, &dlt_solver},
    {{"gpnp", opengv}, LIBOCC_WITH_OPENGV(gpnp_solver)}};

}  // namespace

const std::vector<Solver>& solvers() {
  static const std::vector<Solver> list = [] {
    std::vector<Solver> built;
    for (const Entry& entry : entries)
      if (entry.solver != nullptr) built.push_back(*entry.solver);
    return built;
  }();
  return list;
}

const std::vector<MissingMethod>& missing_solvers() {
  static const std::vector<MissingMethod> list = [] {
    std::vector<MissingMethod> missing;
    for (const Entry& entry : entries)
      if (entry.solver == nullptr) missing.push_back(entry.method);
    return missing;
  }();
  return list;
}

const Solver& solver_named(const std::string& name) {
  for (const Solver& solver : solvers())
    if (solver.name == name) return solver;
  internal::pose::require_in_build("solver", name, missing_solvers());
  std::string names;
  for (const Solver& solver : solvers())
    names += (names.empty() ? "" : ", ") + std::string(solver.name);
  throw std::invalid_argument("solver = \"" + name + "\" must be one of " + names);
}

bool internal::pose::is_in_build(const std::string& solver) {
  return std::any_of(solvers().begin(), solvers().end(),
                     [&](const Solver& other) { return other.name == solver; });
}

void internal::pose::require_in_build(const std::string& argument, const std::string& name,
                                      const std::vector<MissingMethod>& missing) {
  for (const MissingMethod& method : missing)
    if (method.name == name)
      throw std::invalid_argument(argument + " = \"" + name +
                                  "\" is not in this build of libocc; build it with -D" +
                                  method.option + "=ON");
}

}  // namespace occ
