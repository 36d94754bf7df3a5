// SPDX-License-Identifier: Apache-2.0
#include <opencv2/calib3d.hpp>

#include "libocc/geometry/so3.hpp"
#include "libocc/ladder/internal/ladder_steps.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::ladder {

using namespace internal::pose;
namespace {

struct ImagePoints {
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> image;

  void add(const LadderProblem& p, Eigen::Index i) {
    const Eigen::Vector3d& w = p.points_in_world.col(i);
    world.emplace_back(w.x(), w.y(), w.z());
    image.emplace_back(p.points_px(0, i), p.points_px(1, i));
  }
};

Result<Rigid3> solved(const LadderProblem& p, const ImagePoints& points, int method) {
  Result<Rigid3> result;
  result.status = Status::no_pose;
  const Camera& c = p.scene.camera;
  if (!c.is_pinhole()) {
    result.message = "OpenCV's solvers require a pinhole camera";
    return result;
  }
  const cv::Matx33d matrix(c.fx_px(), c.skew_px(), c.cx_px(), 0, c.fy_px(), c.cy_px(), 0, 0, 1);
  cv::Vec3d turn, shift;
  try {
    if (!cv::solvePnP(points.world, points.image, matrix, c.distortion(), turn, shift, false,
                      method)) {
      return result;
    }
  } catch (const cv::Exception&) {  // thrown for a layout that the method refuses
    return result;
  }
  result.value = {so3_exp({turn[0], turn[1], turn[2]}), {shift[0], shift[1], shift[2]}};
  if (result->rotation.allFinite() && result->translation.allFinite()) result.status = Status::ok;
  return result;
}

template <int method>
Result<Rigid3> by_all_points(const LadderProblem& p) {
  ImagePoints points;
  for (Eigen::Index i = 0; i < p.points_px.cols(); ++i) points.add(p, i);
  return solved(p, points, method);
}

/// AP3P takes exactly four points: a wide triple, and the first other point to select the root.
Result<Rigid3> by_ap3p(const LadderProblem& p) {
  const Triple triple = spread_triple(p.points_in_world);
  ImagePoints points;
  for (const int i : triple) points.add(p, i);
  int last = 0;
  while (last == triple[0] || last == triple[1] || last == triple[2]) ++last;
  points.add(p, last);
  return solved(p, points, cv::SOLVEPNP_AP3P);
}

bool four(const LadderProblem& p) { return p.points_px.cols() >= 4; }
bool coplanar_four(const LadderProblem& p) { return four(p) && is_coplanar(p); }
bool coplanar_or_six(const LadderProblem& p) { return coplanar_four(p) || p.points_px.cols() >= 6; }

}  // namespace

std::vector<LadderStep> opencv_steps() {
  constexpr Rung points = Rung::points;
  constexpr FluxModel no_flux = FluxModel::ignore;
  return {
      {"AP3P", "OpenCV", "four points", points, no_flux, four, by_ap3p},
      {"IPPE", "OpenCV", "a plane's points", points, no_flux, coplanar_four,
       by_all_points<cv::SOLVEPNP_IPPE>},
      {"EPNP", "OpenCV", "all points", points, no_flux, four, by_all_points<cv::SOLVEPNP_EPNP>},
      {"SQPNP", "OpenCV", "all points", points, no_flux, four, by_all_points<cv::SOLVEPNP_SQPNP>},
      {"ITERATIVE", "OpenCV", "all points, refined", points, no_flux, coplanar_or_six,
       by_all_points<cv::SOLVEPNP_ITERATIVE>}};
}

}  // namespace occ::internal::ladder
