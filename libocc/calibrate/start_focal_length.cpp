// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/calibrate/internal/pixel_fit.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/core/require.hpp"
#include "libocc/pose/candidates.hpp"

namespace occ {

using namespace internal::calibrate;
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Camera scaled(const Camera& camera, double factor) {
  const std::vector<CameraParameter> parameters = camera.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool focal = parameters[i].name == "fx_px" || parameters[i].name == "fy_px";
    values[static_cast<Eigen::Index>(i)] = parameters[i].value * (focal ? factor : 1);
  }
  return camera.with_parameters(values);
}

// Sum of squared distances [px^2] that the best pose of the plane leaves.
double misfit(const PlaneView& view, const Camera& camera) {
  PoseProblem problem;
  problem.points = Eigen::Matrix3Xd::Zero(3, view.plane.cols());
  problem.points.topRows<2>() = view.plane;
  problem.bearings.resize(3, view.px.cols());
  for (Eigen::Index i = 0; i < view.px.cols(); ++i) {
    const auto bearing = camera.unproject(view.px.col(i));
    if (!bearing) return infinity;
    problem.bearings.col(i) = *bearing;
  }
  CandidateOptions any;
  any.polish = false;
  any.tolerance_rad = 4;
  constexpr int iterations = 10;
  double least = infinity;
  for (const PoseCandidate& start : pose_candidates(problem, "ippe", any).value)
    least = std::min(
        least,
        fit_pose(problem.points, view.px, camera, start.cam_from_world, infinity, iterations).cost);
  return 2 * least;
}

// Of the better four fifths of the views.
double misfit(const std::vector<const PlaneView*>& views, const Camera& camera) {
  std::vector<double> all;
  for (const PlaneView* view : views) all.push_back(misfit(*view, camera));
  std::sort(all.begin(), all.end());
  all.resize((4 * all.size() + 4) / 5);
  double sum = 0;
  for (const double one : all) sum += one;
  return sum;
}

}  // namespace

Result<Camera> start_focal_length(const std::vector<PlaneView>& views, const Camera& about) {
  require(std::isinf(about.period_px()), "about", name_of(about.kind()),
          "a camera with focal lengths");
  Result<Camera> result{about, Status::ok, ""};
  std::vector<const PlaneView*> used;
  for (const PlaneView& view : views) {
    require(view.plane.cols() == view.px.cols(), "views: px", view.px.cols(),
            "one for each point of the plane");
    require_finite(view.plane, "views: plane");
    require_finite(view.px, "views: px");
    if (view.px.cols() >= 4) used.push_back(&view);
  }
  if (used.empty()) {
    result.status = Status::too_few_lamps;
    result.message = "no plane is seen with four points or more";
    return result;
  }
  constexpr std::size_t enough = 60;
  for (std::size_t i = 0; used.size() > enough && i < enough; ++i)
    used[i] = used[i * used.size() / enough];
  used.resize(std::min(used.size(), enough));
  constexpr int steps = 15;  // to each side, up to a factor of 3
  const double step = std::log(3.0) / steps;
  std::vector<double> misfits;
  for (int i = -steps; i <= steps; ++i)
    misfits.push_back(misfit(used, scaled(about, std::exp(i * step))));
  const auto best = std::min_element(misfits.begin(), misfits.end());
  const auto at = best - misfits.begin();
  // Twice as large a factor must be worse, or half as large: by a tenth.
  constexpr double min_rise = 1.1;
  const auto worse = [&](std::ptrdiff_t by) {
    const std::ptrdiff_t there = std::clamp<std::ptrdiff_t>(at + by, 0, 2 * steps);
    return misfits[there] > min_rise * *best;
  };
  constexpr int half = 9;  // steps of a factor of nearly 2
  if (at == 0 || at == 2 * steps || !worse(half) || !worse(-half)) {
    result.status = Status::degenerate;
    result.message = "the planes are seen too much face on to tell a focal length";
    return result;
  }
  // The parabola through three values.
  const double below = best[-1], above = best[1], bend = below + above - 2 * *best;
  const double shift =
      std::isfinite(bend) && bend > 0 ? std::clamp(0.5 * (below - above) / bend, -0.5, 0.5) : 0;
  result.value = scaled(about, std::exp((static_cast<double>(at - steps) + shift) * step));
  return result;
}

}  // namespace occ
