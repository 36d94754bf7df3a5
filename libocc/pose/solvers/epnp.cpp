// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/epnp.hpp"

#include <mutex>
#include <opengv/absolute_pose/modules/Epnp.hpp>

#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

// Needed because OpenGV's Epnp::qr_solve keeps its scratch memory in static variables.
std::mutex& epnp_mutex() {
  static std::mutex mutex;
  return mutex;
}

void solve_epnp(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const std::optional<PinholeFrame> frame = pinhole_frame(problem);
  // Points in a plane have no barycentric coordinates, and coincident bearings do not determine a
  // pose: OpenGV would print and return NaN.
  if (!frame || problem.size() < 4 || !spans_space(point_layout(problem.points)) ||
      !spans_plane(point_layout(problem.bearings)))
    return;
  opengv::absolute_pose::modules::Epnp epnp;
  epnp.set_maximum_number_of_correspondences(problem.size());
  epnp.reset_correspondences();
  for (Eigen::Index i = 0; i < problem.points.cols(); ++i) {
    const Eigen::Vector3d p = problem.points.col(i);
    epnp.add_correspondence(p.x(), p.y(), p.z(), frame->image(0, i), frame->image(1, i), 1);
  }
  double rotation[3][3], translation[3];
  {
    const std::lock_guard<std::mutex> lock(epnp_mutex());
    epnp.compute_pose(rotation, translation);
  }
  Rigid3 turned_from_world;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      turned_from_world.rotation(row, column) = rotation[row][column];
    turned_from_world.translation[row] = translation[row];
  }
  candidates.push_back(frame->cam_from_world(turned_from_world));
}

}  // namespace

constexpr Solver epnp_solver = {
    /*name=*/"epnp",
    /*min_points=*/4,
    /*max_points=*/0,
    /*max_candidates=*/1, Layout::not_coplanar,
    /*needs_up=*/false,
    /*takes_origins=*/false,
    /*failures=*/
    "wrong in four of five cases with four points; nearly flat points; concurrent calls wait for "
    "each other, because OpenGV keeps its scratch memory in static variables; rejects bearings "
    "more than 89.9 deg from their mean",
    /*source=*/"Lepetit, Moreno-Noguer, Fua, IJCV 81, 2009; OpenGV", solve_epnp};

}  // namespace occ
