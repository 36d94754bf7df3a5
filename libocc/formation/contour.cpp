// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/contour.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

constexpr double two_pi = 6.283185307179586;
constexpr int max_points = 65536;
constexpr int min_disc_points = 24;

// A curve in the camera's frame: position and tangent at a parameter.
struct CurvePoint {
  Eigen::Vector3d at, tangent;
};

struct ImagePoint {
  Eigen::Vector2d px, tangent_px;
};

std::optional<ImagePoint> project_point(const CurvePoint& point, const Camera& camera) {
  Eigen::Matrix<double, 2, 3> jacobian;
  const auto px = camera.project(point.at, &jacobian);
  if (!px) return std::nullopt;
  return ImagePoint{*px, jacobian * point.tangent};
}

// Greatest speed [px per unit of parameter] at `probes` places of [from, to].
template <typename Curve>
std::optional<double> max_speed(const Curve& curve, const Camera& camera, double from, double to,
                                int probes) {
  double speed = 0;
  for (int i = 0; i < probes; ++i) {
    const auto point = project_point(curve(from + (to - from) * i / (probes - 1)), camera);
    if (!point) return std::nullopt;
    speed = std::max(speed, point->tangent_px.norm());
  }
  return speed;
}

int points_for(double length_px, double spacing_px, int at_least) {
  const double wanted = std::ceil(length_px / spacing_px);
  return static_cast<int>(std::clamp(wanted, static_cast<double>(at_least), 1.0 * max_points));
}

std::optional<Contour> disc_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                    const Camera& camera, double spacing_px) {
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const Eigen::Vector3d normal = cam_from_world.rotation * lamp.normal;
  const Eigen::Vector3d across = normal.unitOrthogonal() * lamp.radius_m;
  const Eigen::Vector3d along = normal.cross(across);
  const auto curve = [&](double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return CurvePoint{centre + c * across + s * along, c * along - s * across};
  };
  const auto speed = max_speed(curve, camera, 0, two_pi, 17);
  if (!speed) return std::nullopt;
  const int count = points_for(two_pi * *speed, spacing_px, min_disc_points);
  Contour contour;
  contour.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const auto point = project_point(curve(two_pi * i / count), camera);
    if (!point) return std::nullopt;
    contour.push_back({point->px, point->tangent_px.y() * two_pi / count});
  }
  return contour;
}

// Positive half of the 16-point Gauss-Legendre rule on [-1, 1] (Abramowitz & Stegun, table 25.4).
constexpr std::array<double, 8> gauss_nodes = {
    0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
    0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499};
constexpr std::array<double, 8> gauss_weights = {
    0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
    0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541};

// One edge from `from` to `to`, in panels whose widest node gap (0.19 of half a panel) is the
// spacing.
bool add_edge(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Camera& camera,
              double spacing_px, Contour& contour) {
  const auto curve = [&](double s) { return CurvePoint{from + s * (to - from), to - from}; };
  const auto speed = max_speed(curve, camera, 0, 1, 5);
  if (!speed) return false;
  const int panels = points_for(*speed * 0.095, spacing_px, 1);
  const double half = 0.5 / panels;
  for (int panel = 0; panel < panels; ++panel) {
    for (int i = 0; i < 16; ++i) {
      const auto node = static_cast<std::size_t>(i < 8 ? i : i - 8);
      const double offset = i < 8 ? -gauss_nodes[node] : gauss_nodes[node];
      const auto point = project_point(curve((2 * panel + 1 + offset) * half), camera);
      if (!point) return false;
      contour.push_back({point->px, point->tangent_px.y() * half * gauss_weights[node]});
    }
  }
  return true;
}

std::optional<Contour> rectangle_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                         const Camera& camera, double spacing_px) {
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const Eigen::Vector3d x_axis = cam_from_world.rotation * lamp.x_axis;
  const Eigen::Vector3d y_axis = (cam_from_world.rotation * lamp.normal).cross(x_axis);
  const Eigen::Vector3d along = 0.5 * lamp.size_m.x() * x_axis;
  const Eigen::Vector3d across = 0.5 * lamp.size_m.y() * y_axis;
  const std::array<Eigen::Vector3d, 4> corners = {centre - along - across, centre + along - across,
                                                  centre + along + across, centre - along + across};
  Contour contour;
  for (std::size_t i = 0; i < 4; ++i)
    if (!add_edge(corners[i], corners[(i + 1) % 4], camera, spacing_px, contour))
      return std::nullopt;
  return contour;
}

}  // namespace

std::optional<Contour> project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                       const Camera& camera, double spacing_px) {
  require(spacing_px > 0, "spacing_px", spacing_px, "positive");
  if (lamp.shape == LampShape::point) return Contour();
  const Eigen::Vector3d to_camera = cam_from_world.origin_in_source() - lamp.centre_m;
  if (!(to_camera.dot(lamp.normal) > 0)) return std::nullopt;
  return lamp.shape == LampShape::disc
             ? disc_contour(lamp, cam_from_world, camera, spacing_px)
             : rectangle_contour(lamp, cam_from_world, camera, spacing_px);
}

Contour smooth_contour(const std::vector<Eigen::Vector2d>& rim_px) {
  // Central first difference of order 12 (Fornberg, "Generation of finite difference formulas on
  // arbitrarily spaced grids", Math. Comp. 51, 1988, table 1).
  constexpr std::array<double, 6> taps = {6.0 / 7,   -15.0 / 56, 5.0 / 63,
                                          -1.0 / 56, 1.0 / 385,  -1.0 / 5544};
  const std::size_t count = rim_px.size();
  require(count >= 13, "rim_px", count, "at least 13 samples long");
  Contour contour(count);
  for (std::size_t i = 0; i < count; ++i) {
    double dy = 0;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      const double ahead = rim_px[(i + k + 1) % count].y();
      const double behind = rim_px[(i + count - k - 1) % count].y();
      dy += taps[k] * (ahead - behind);
    }
    contour[i] = {rim_px[i], dy};
  }
  return contour;
}

}  // namespace occ
