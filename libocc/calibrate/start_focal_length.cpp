// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/calibrate/internal/pixel_fit.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/pose/internal/plane_starts.hpp"

namespace occ {

using namespace internal::calibrate;
namespace {

Camera scaled(const Camera& camera, double factor) {
  const std::vector<CameraParameter> parameters = camera.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool focal = parameters[i].name == "fx_px" || parameters[i].name == "fy_px";
    values[static_cast<Eigen::Index>(i)] = parameters[i].value * (focal ? factor : 1);
  }
  return camera.with_parameters(values);
}

/// Sum of squared residuals [px^2] of the best pose of a plane.
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
  constexpr int iterations = 10;
  double smallest = infinity;
  for (const Rigid3& start : internal::pose::plane_starts(problem))
    smallest = std::min(
        smallest, fit_pose(problem.points, view.px, camera, start, infinity, iterations).cost);
  return 2 * smallest;
}

/// Sum over the best four fifths of the views, which tolerates gross errors in the others.
double misfit(const std::vector<const PlaneView*>& views, const Camera& camera) {
  std::vector<double> all;
  for (const PlaneView* view : views) all.push_back(misfit(*view, camera));
  std::sort(all.begin(), all.end());
  all.resize((4 * all.size() + 4) / 5);
  double sum = 0;
  for (const double value : all) sum += value;
  return sum;
}

}  // namespace

Result<Camera> start_focal_length(const std::vector<PlaneView>& views, const Camera& approximate) {
  require(std::isinf(approximate.period_px()), "about", name_of(approximate.kind()),
          "a camera with focal lengths");
  Result<Camera> result{approximate, Status::ok, ""};
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
    result.message = "no view of a plane has four points or more";
    return result;
  }
  constexpr std::size_t max_views = 60;
  for (std::size_t i = 0; used.size() > max_views && i < max_views; ++i)
    used[i] = used[i * used.size() / max_views];
  used.resize(std::min(used.size(), max_views));
  constexpr int steps = 15;  // to each side of 1, up to a factor of 3
  const double step = std::log(3.0) / steps;
  std::vector<double> misfits;
  for (int i = -steps; i <= steps; ++i)
    misfits.push_back(misfit(used, scaled(approximate, std::exp(i * step))));
  const auto best = std::min_element(misfits.begin(), misfits.end());
  const auto index = best - misfits.begin();
  constexpr double min_rise = 1.1;  // required ratio of the misfit at twice and at half the factor
  // Rounding errors of an exact fit: 1e-6 px, far above that of doubles and below any real
  // residual.
  constexpr double rounding_px2 = 1e-12;
  const auto worse = [&](std::ptrdiff_t offset) {
    const std::ptrdiff_t neighbour = std::clamp<std::ptrdiff_t>(index + offset, 0, 2 * steps);
    return misfits[neighbour] > min_rise * std::max(*best, rounding_px2);
  };
  constexpr int octave_steps = 9;  // steps for a factor of about 2
  if (index == 0 || index == 2 * steps || !worse(octave_steps) || !worse(-octave_steps)) {
    result.status = Status::degenerate;
    result.message = "the planes are too nearly parallel to the image to determine a focal length";
    return result;
  }
  // Vertex of the parabola through three values.
  const double left = best[-1], right = best[1], curvature = left + right - 2 * *best;
  const double shift = std::isfinite(curvature) && curvature > 0
                           ? std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5)
                           : 0;
  result.value = scaled(approximate, std::exp((static_cast<double>(index - steps) + shift) * step));
  return result;
}

}  // namespace occ
