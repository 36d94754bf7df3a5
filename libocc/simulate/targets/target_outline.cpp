// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/target_outline.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/quadrature.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::simulate {

using namespace internal::core;
namespace {

constexpr double two_pi = 2 * pi;
constexpr int nodes_of_panel = 16;
constexpr double panel_spacings =
    0.6 * nodes_of_panel;  // longest panel, as in formation/contour.cpp

struct CurvePoint {
  Eigen::Vector3d at, tangent;
};

// Projects one piece of an outline, a curve over [0, 1].
class Piece {
 public:
  Piece(const Camera& camera, const Eigen::Vector2d& near_px, double spacing_px)
      : camera_(camera),
        near_px_(near_px),
        spacing_px_(spacing_px),
        nodes_(gauss_legendre(nodes_of_panel)) {}

  // Returns false outside the camera's domain or if longer than `max_length_px`.
  template <typename Curve>
  bool add(const Curve& curve, int probes, double max_length_px, Contour& contour) const {
    double length = 0;
    Eigen::Vector2d last = Eigen::Vector2d::Zero();
    for (int i = 0; i <= probes; ++i) {
      const auto px = projected(curve(static_cast<double>(i) / probes).at, nullptr);
      if (!px) return false;
      if (i > 0) length += (*px - last).norm();
      last = *px;
    }
    if (!(length < max_length_px)) return false;
    // 10 % more, because perspective makes one end of a piece longer than the other.
    const int panels = 1 + static_cast<int>(1.1 * length / (panel_spacings * spacing_px_));
    for (int i = 0; i < panels; ++i)
      for (const QuadratureNode& node : nodes_)
        if (!add_point(curve((i + node.at) / panels), node.weight / panels, contour)) return false;
    return true;
  }

 private:
  std::optional<Eigen::Vector2d> projected(const Eigen::Vector3d& point,
                                           Eigen::Matrix<double, 2, 3>* jacobian) const {
    const auto px = camera_.project(point, jacobian);
    if (!px) return std::nullopt;
    return Eigen::Vector2d(near_px_ + camera_.difference_px(*px, near_px_));
  }

  bool add_point(const CurvePoint& point, double weight, Contour& contour) const {
    Eigen::Matrix<double, 2, 3> jacobian;
    const auto px = projected(point.at, &jacobian);
    if (!px) return false;
    contour.push_back({*px, weight * jacobian.row(1).dot(point.tangent)});
    return true;
  }

  const Camera& camera_;
  Eigen::Vector2d near_px_;
  double spacing_px_;
  std::vector<QuadratureNode> nodes_;
};

Eigen::Vector3d in_space(const Eigen::Vector2d& p) { return {p.x(), p.y(), 0}; }

}  // namespace

PlaneOutline rectangle_outline(const Eigen::Vector2d& half_size_m) {
  const double x = half_size_m.x(), y = half_size_m.y();
  const Eigen::Vector2d corners[4] = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  PlaneOutline outline;
  for (int k = 0; k < 4; ++k) outline.edges.push_back({corners[k], corners[(k + 1) % 4]});
  return outline;
}

PlaneOutline square_outline(double half_side_m) {
  return rectangle_outline(Eigen::Vector2d::Constant(half_side_m));
}

std::optional<Contour> plane_contour(const PlaneOutline& outline, const Rigid3& cam_from_plane,
                                     const Camera& camera, const Eigen::Vector2d& near_px,
                                     double spacing_px, double max_length_px) {
  const Piece piece(camera, near_px, spacing_px);
  Contour contour;
  for (const PrintEdge& edge : outline.edges) {
    const Eigen::Vector3d from = cam_from_plane * in_space(edge.from);
    const Eigen::Vector3d step = cam_from_plane * in_space(edge.to) - from;
    const auto line = [&](double s) { return CurvePoint{from + s * step, step}; };
    if (!piece.add(line, 2, max_length_px, contour)) return std::nullopt;
  }
  const Eigen::Vector3d x = outline.circle_radius_m * cam_from_plane.rotation.col(0);
  const Eigen::Vector3d y = outline.circle_radius_m * cam_from_plane.rotation.col(1);
  for (const Eigen::Vector2d& at : outline.circle_centres_m) {
    const Eigen::Vector3d centre = cam_from_plane * in_space(at);
    const auto circle = [&](double s) {
      const double c = std::cos(two_pi * s), sine = std::sin(two_pi * s);
      return CurvePoint{centre + c * x + sine * y, two_pi * (c * y - sine * x)};
    };
    if (!piece.add(circle, 16, max_length_px, contour)) return std::nullopt;
  }
  return contour;
}

// Integral of x dy. The image's y axis points down, so an outline that is counter-clockwise seen
// from the front is clockwise here.
double contour_area(const Contour& contour) {
  if (contour.empty()) return 0;
  const double origin = contour.front().px.x();
  double area = 0;
  for (const ContourPoint& point : contour) area -= (point.px.x() - origin) * point.dy_px;
  return area;
}

Eigen::Vector2d contour_centroid(const Contour& contour) {
  const Eigen::Vector2d origin = contour.front().px;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  double area = 0;
  for (const ContourPoint& point : contour) {
    const Eigen::Vector2d p = point.px - origin;
    area += p.x() * point.dy_px;
    moment += Eigen::Vector2d(0.5 * p.x(), p.y()) * (p.x() * point.dy_px);
  }
  return origin + moment / area;
}

}  // namespace occ::internal::simulate
