// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/headlights.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/locate/solve_pose.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int nodes = 181;  // of the yaw

// Bearings of the two lamps and the angle between them.
struct Pair {
  Vector3d first, second;
  double angle_rad = 0, sigma_rad = 0;
  double direction_sigma_rad = 0;  // of the bisector
};

Vector3d bearing_of(const Camera& camera, const Vector2d& pixel, int i,
                    Eigen::Matrix<double, 3, 2>& by_pixel) {
  const auto bearing = camera.unproject(pixel, &by_pixel);
  if (!bearing)
    require(false, "lamps_px[" + std::to_string(i) + "]", pixel.transpose(),
            "inside the camera's domain");
  return *bearing;
}

Pair pair_of(const Eigen::Matrix2d& pixels, const Camera& camera, double sigma_px) {
  Eigen::Matrix<double, 3, 2> by_first, by_second;
  Pair pair;
  pair.first = bearing_of(camera, pixels.col(0), 0, by_first);
  pair.second = bearing_of(camera, pixels.col(1), 1, by_second);
  const Vector3d across = pair.first.cross(pair.second);
  pair.angle_rad = std::atan2(across.norm(), pair.first.dot(pair.second));
  Vector3d along = (pair.second - pair.first).normalized();
  if (!along.allFinite()) along = pair.first.unitOrthogonal();
  const double variance =
      (by_first.transpose() * along).squaredNorm() + (by_second.transpose() * along).squaredNorm();
  pair.sigma_rad = sigma_px * std::sqrt(variance);
  pair.direction_sigma_rad = 0.5 * pair.sigma_rad;
  return pair;
}

double distance_at(double separation_m, double angle_rad, double yaw_rad) {
  const double sine = std::sin(angle_rad);
  const double ratio2 = 2 * (1 + std::cos(angle_rad) * std::cos(2 * yaw_rad)) / (sine * sine) - 1;
  return 0.5 * separation_m * std::sqrt(ratio2);
}

// Normal component of the distribution of 1 / D for one yaw.
struct Part {
  double weight = 0, mean = 0, sigma = 0;
};

struct Mixture {
  std::vector<Part> parts;
  double best_misfit = 0;  // smallest misfit of a component to the heights [sigmas]

  double below(double value) const {
    double sum = 0;
    for (const Part& part : parts)
      sum += part.weight * normal_probability((value - part.mean) / part.sigma);
    return sum;
  }

  double quantile(double probability) const {
    double low = 0, high = 0;
    for (const Part& part : parts) high = std::max(high, part.mean + 8 * part.sigma);
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (below(middle) < probability ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
};

// Kalman update of 1 / D by the sine of the elevation; returns the log-likelihood of the
// prediction.
double update(const RoadHeights& heights, double seen_sine, double direction_sigma_rad, Part& part,
              double& misfit) {
  const double height_m = heights.lamps_m - heights.camera_m;
  const double height_sigma_m = std::hypot(heights.lamps_sigma_m, heights.camera_sigma_m);
  const double noise =
      std::hypot(height_sigma_m * part.mean, std::hypot(heights.up_sigma_rad, direction_sigma_rad));
  const double variance = std::pow(height_m * part.sigma, 2) + noise * noise;
  const double off = seen_sine - height_m * part.mean;
  const double gain = part.sigma * part.sigma * height_m / variance;
  part.mean += gain * off;
  part.sigma *= noise / std::sqrt(variance);
  misfit = std::abs(off) / std::sqrt(variance);
  return -0.5 * (misfit * misfit + std::log(variance));
}

Mixture mixture_of(const Pair& pair, const HeadlightOptions& options, HeadlightDistance& result) {
  Mixture mixture;
  const double relative = std::hypot(options.separation_sigma_m / options.separation_m,
                                     pair.sigma_rad / pair.angle_rad);
  std::vector<double> logs;
  for (int i = 0; i < nodes; ++i) {
    const double yaw = options.yaw_max_rad * ((2 * i + 1.0) / nodes - 1);  // middles of equal parts
    const double distance = distance_at(options.separation_m, pair.angle_rad, yaw);
    Part part{0, 1 / distance, relative / distance};
    double log = options.yaw_concentration * std::cos(yaw), misfit = 0;
    if (options.heights) {
      const Vector3d up = options.heights->up_in_cam.normalized();
      log += update(*options.heights, up.dot(result.direction_in_cam), pair.direction_sigma_rad,
                    part, misfit);
    }
    mixture.best_misfit = i == 0 ? misfit : std::min(mixture.best_misfit, misfit);
    mixture.parts.push_back(part);
    logs.push_back(log);
    result.yaw_rad.push_back(yaw);
    result.distance_of_yaw_m.push_back(distance);
  }
  const double largest = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (std::size_t i = 0; i < logs.size(); ++i)
    sum += mixture.parts[i].weight = std::exp(logs[i] - largest);
  for (Part& part : mixture.parts) {
    part.weight /= sum;
    result.yaw_density.push_back(part.weight * nodes / (2 * options.yaw_max_rad));
  }
  return mixture;
}

// Mean and deviation of D = 1 / v, to second order in the relative sigma of each component.
void take_moments(const Mixture& mixture, HeadlightDistance& result) {
  double mean = 0, square = 0;
  for (const Part& part : mixture.parts) {
    const double relative2 = std::pow(part.sigma / part.mean, 2);
    mean += part.weight * (1 + relative2) / part.mean;
    square += part.weight * (1 + 3 * relative2) / (part.mean * part.mean);
  }
  result.distance_m = mean;
  result.sigma_m = std::sqrt(std::max(0.0, square - mean * mean));
  constexpr double tail = 0.025;
  result.low_m = 1 / mixture.quantile(1 - tail);
  result.high_m = 1 / mixture.quantile(tail);
}

// Gradient of f(pose) with respect to the left perturbation, by central differences.
template <typename Function>
double sigma_of(const Candidate& candidate, const Function& f) {
  Vector6 gradient;
  for (int i = 0; i < 6; ++i) {
    constexpr double step = 1e-6;
    const Vector6 delta = step * Vector6::Unit(i);
    const double difference =
        f(perturb(candidate.cam_from_world, delta)) - f(perturb(candidate.cam_from_world, -delta));
    gradient[i] = std::remainder(difference, 2 * pi) / (2 * step);
  }
  return std::sqrt(gradient.dot(candidate.covariance * gradient));
}

double yaw_of(const Rigid3& cam_from_vehicle) {
  const Vector3d camera = cam_from_vehicle.origin_in_source();
  return std::atan2(-camera.y(), camera.x());
}

}  // namespace

void HeadlightOptions::validate() const {
  const auto positive = [](double value, const char* name) {
    require(value > 0 && std::isfinite(value), name, value, "positive");
  };
  positive(separation_m, "separation_m");
  require(separation_sigma_m >= 0 && separation_sigma_m < 0.3 * separation_m, "separation_sigma_m",
          separation_sigma_m, "zero or positive, below 0.3 separation_m");
  positive(sigma_px, "sigma_px");
  require(yaw_max_rad > 0 && yaw_max_rad < pi / 2, "yaw_max_rad", yaw_max_rad, "in (0, pi/2)");
  require(yaw_concentration >= 0 && std::isfinite(yaw_concentration), "yaw_concentration",
          yaw_concentration, "zero or positive");
  if (!heights) return;
  require(std::isfinite(heights->lamps_m), "heights.lamps_m", heights->lamps_m, "finite");
  require(std::isfinite(heights->camera_m), "heights.camera_m", heights->camera_m, "finite");
  positive(heights->lamps_sigma_m, "heights.lamps_sigma_m");
  positive(heights->camera_sigma_m, "heights.camera_sigma_m");
  positive(heights->up_sigma_rad, "heights.up_sigma_rad");
  require(std::abs(heights->up_in_cam.norm() - 1) <= 1e-6, "heights.up_in_cam",
          heights->up_in_cam.transpose(), "unit");
}

Result<HeadlightDistance> headlight_distance(const Eigen::Matrix2d& lamps_px, const Camera& camera,
                                             const HeadlightOptions& options) {
  options.validate();
  require_finite(lamps_px, "lamps_px");
  constexpr double min_sigmas = 5, max_misfit = 5;
  const Pair pair = pair_of(lamps_px, camera, options.sigma_px);
  Result<HeadlightDistance> result;
  HeadlightDistance& found = result.value;
  found.direction_in_cam = (pair.first + pair.second).normalized();
  found.bearing_rad = std::atan2(found.direction_in_cam.x(), found.direction_in_cam.z());
  found.separation_rad = pair.angle_rad;
  found.separation_sigma_rad = pair.sigma_rad;
  if (!(pair.angle_rad > min_sigmas * pair.sigma_rad)) {
    result.status = Status::degenerate;
    result.message =
        "the two lamps are not resolved in the image, which determines only their bearing";
    return result;
  }
  const Mixture mixture = mixture_of(pair, options, found);
  take_moments(mixture, found);
  if (mixture.best_misfit > max_misfit) {
    result.status = Status::no_pose;
    result.message = "no yaw within yaw_max_rad fits the heights over the road";
  }
  return result;
}

Result<std::vector<VehiclePose>> vehicle_poses(const Eigen::Matrix3Xd& lamps_m,
                                               const Eigen::Matrix2Xd& lamps_px,
                                               const Camera& camera, double sigma_px,
                                               const Vector3d& up_in_cam, double max_tilt_rad) {
  require(std::abs(up_in_cam.norm() - 1) <= 1e-6, "up_in_cam", up_in_cam.transpose(), "unit");
  require(max_tilt_rad > 0, "max_tilt_rad", max_tilt_rad, "positive");
  SolvePoseOptions options;
  options.sigma_px = sigma_px;
  const Result<Fix> fix = solve_pose(lamps_m, lamps_px, camera, options);
  Result<std::vector<VehiclePose>> result{{}, fix.status, fix.message};
  for (const Candidate& candidate : fix->candidates) {
    const Rigid3& pose = candidate.cam_from_world;
    if (!(pose.rotation.col(2).dot(up_in_cam) > std::cos(max_tilt_rad))) continue;
    VehiclePose vehicle;
    vehicle.pose = candidate;
    vehicle.distance_m = pose.translation.norm();
    vehicle.sigma_m = sigma_of(candidate, [](const Rigid3& p) { return p.translation.norm(); });
    vehicle.yaw_rad = yaw_of(pose);
    vehicle.yaw_sigma_rad = sigma_of(candidate, &yaw_of);
    result.value.push_back(vehicle);
  }
  double upright = 0;
  for (const VehiclePose& vehicle : result.value) upright += vehicle.pose.probability.value_or(0);
  for (VehiclePose& vehicle : result.value)
    if (vehicle.pose.probability && upright > 0) *vehicle.pose.probability /= upright;
  if (result.value.empty() && !fix->candidates.empty()) {
    result.status = Status::no_pose;
    result.message = "every pose that fits the image has a tilt above max_tilt_rad";
  } else if (fix.status == Status::ambiguous && result.value.size() == 1) {
    result.status = Status::ok;
    result.message.clear();
  }
  return result;
}

}  // namespace occ
