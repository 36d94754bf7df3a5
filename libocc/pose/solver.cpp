// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solver.hpp"

#include <stdexcept>

#include "libocc/pose/internal/dlt.hpp"
#include "libocc/pose/internal/epnp.hpp"
#include "libocc/pose/internal/gp3p.hpp"
#include "libocc/pose/internal/gpnp.hpp"
#include "libocc/pose/internal/homography.hpp"
#include "libocc/pose/internal/ippe.hpp"
#include "libocc/pose/internal/iterative.hpp"
#include "libocc/pose/internal/p3p_gao.hpp"
#include "libocc/pose/internal/p3p_kneip.hpp"
#include "libocc/pose/internal/p3p_triples.hpp"
#include "libocc/pose/internal/posit.hpp"
#include "libocc/pose/internal/posit_coplanar.hpp"
#include "libocc/pose/internal/sqpnp.hpp"
#include "libocc/pose/internal/triangle.hpp"
#include "libocc/pose/internal/upnp.hpp"
#include "libocc/pose/internal/upright_p2p.hpp"
#include "libocc/pose/solvers/p3p.hpp"

namespace occ {

using namespace internal::pose;

namespace {

void solve_p3p(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  std::vector<Rigid3> poses;
  p3p(problem.bearings, problem.points, poses);
  candidates.insert(candidates.end(), poses.begin(), poses.end());
}

}  // namespace

const std::vector<Solver>& solvers() {
  constexpr Layout any = Layout::any, flat = Layout::coplanar, deep = Layout::not_coplanar;
  // name, points from, to (0: any number), candidates, layout, needs_up, takes_origins, failures,
  // source, function
  static const std::vector<Solver> list = {
      {"upright_p2p", 2, 2, 2, any, true, true,
       "the camera at the height of both points, and points above one another, leave the heading "
       "open",
       "Kukelova, Bujnak, Pajdla, ACCV 2010", solve_upright_p2p},
      {"p3p", 3, 3, 4, any, false, false,
       "none known; points nearer to a line than 1e-5 of their size lose digits as any solver's do",
       "libocc; conics after Ding, Yang, Larsson, Olsson, Astrom, CVPR 2023", solve_p3p},
      {"p3p_kneip", 3, 3, 4, any, false, false,
       "loses poses at double roots, on axes and planes of symmetry and in the plane of the points",
       "Kneip, Scaramuzza, Siegwart, CVPR 2011; OpenGV", solve_p3p_kneip},
      {"p3p_gao", 3, 3, 4, any, false, false,
       "loses digits at narrow views: a third of the poses at 20 to 100 times the points' size is "
       "exact to 1e-6",
       "Gao, Hou, Tang, Cheng, PAMI 25(8), 2003; OpenGV", solve_p3p_gao},
      {"triangle", 3, 3, 8, any, false, false, "takes 30 times as long as p3p_kneip",
       "DeMenthon, lecture \"Object pose from a single image\"", solve_triangle},
      {"gp3p", 3, 3, 8, any, false, true,
       "misses one pose in fifty, and before polishing one in seven is off by more than 1e-6",
       "Kneip, Furgale, Siegwart, ICRA 2013; OpenGV", solve_gp3p},
      {"sqpnp", 3, 0, 18, any, false, false,
       "three points: misses one pose in six, four points: one in fifty; small targets with noise; "
       "refuses bearings more than 89.9 deg from their mean",
       "Terzakis, Lourakis, ECCV 2020; OpenCV", solve_sqpnp},
      {"upnp", 3, 0, 8, any, false, true,
       "takes ten times as long as sqpnp; three points: one pose in twenty is off by more than "
       "1e-6 before polishing; in a plane with noise one in twenty is off by a tenth",
       "Kneip, Li, Seo, ECCV 2014; elimination by OpenGV", solve_upnp},
      {"p3p_triples", 3, 0, 4, any, false, false,
       "returns the candidates of one triple: with four points and much noise the other branch may "
       "be missing",
       "libocc; p3p over triples, judged by all points", solve_p3p_triples},
      {"iterative", 4, 0, 1, any, false, false,
       "points not in a plane must be six or more; may end in the wrong one of a plane's two "
       "poses; refuses bearings more than 89.9 deg from their mean",
       "OpenCV SOLVEPNP_ITERATIVE: homography or DLT, then Levenberg-Marquardt", solve_iterative},
      {"ippe", 4, 0, 2, flat, false, false,
       "with noise three times as far off as sqpnp on four points; refuses bearings more than 89.9 "
       "deg from their mean",
       "Collins, Bartoli, IJCV 109, 2014; OpenCV", solve_ippe},
      {"homography", 4, 0, 1, flat, false, false,
       "with noise farther off than any other: five times ippe on four points",
       "Hartley, Zisserman 2004, section 4.1; Zhang, PAMI 22(11), 2000", solve_homography},
      {"posit_coplanar", 4, 0, 2, flat, false, false,
       "diverges when near: four points at 2 times their size in one of three, at 4 times in one "
       "of twelve, at 10 times in one of seventy; refuses bearings more than 89.9 deg from their "
       "mean",
       "Oberkampf, DeMenthon, Davis, CVIU 63, 1996", solve_posit_coplanar},
      {"posit", 4, 0, 1, deep, false, false,
       "diverges when near: four points at 1.5 times their size in one of three, at 2 times in one "
       "of eleven, at 3 times in one of 170; refuses bearings more than 89.9 deg from their mean",
       "DeMenthon, Davis, IJCV 15, 1995", solve_posit},
      {"epnp", 4, 0, 1, deep, false, false,
       "four points: wrong in four of five; nearly flat points; calls wait for each other, for "
       "OpenGV keeps its scratch memory in statics; refuses bearings more than 89.9 deg from their "
       "mean",
       "Lepetit, Moreno-Noguer, Fua, IJCV 81, 2009; OpenGV", solve_epnp},
      {"dlt", 6, 0, 1, deep, false, false,
       "nearly flat points; with noise farther off than any other: fifteen times sqpnp on six "
       "points, four times on twenty",
       "Hartley, Zisserman 2004, section 7.1", solve_dlt},
      {"gpnp", 6, 0, 1, deep, false, true,
       "needs bearings from several centres: returns nothing for one camera; nearly flat points",
       "Kneip, Furgale, Siegwart, ICRA 2013; search by OpenGV", solve_gpnp}};
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
