// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/internal/route_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::guide {
namespace {

constexpr double shortest_m = 1e-9;  // shorter pieces are rounding errors

double direction_of(const Eigen::Vector2d& v) { return std::atan2(v.y(), v.x()); }

/// Speed from each way-point on.
std::vector<double> speeds_of(const std::vector<RouteWaypoint>& waypoints,
                              const RouteOptions& options) {
  std::vector<double> speeds;
  for (const RouteWaypoint& waypoint : waypoints)
    speeds.push_back(
        waypoint.speed_m_s.value_or(speeds.empty() ? options.speed_m_s : speeds.back()));
  return speeds;
}

/// A corner: rotation at a way-point, and the length that the arc takes of the adjacent lines.
struct Corner {
  double turn_rad = 0, radius_m = 0;
  double cut_m() const { return radius_m * std::tan(std::abs(turn_rad) / 2); }
};

/// Corner with the requested radius, before it is fitted to the lines.
Corner corner_at(std::size_t i, const std::vector<RouteWaypoint>& waypoints,
                 const RouteOptions& options) {
  const std::size_t n = waypoints.size();
  const Eigen::Vector2d in = waypoints[i].position_m - waypoints[(i + n - 1) % n].position_m;
  const Eigen::Vector2d out = waypoints[(i + 1) % n].position_m - waypoints[i].position_m;
  Corner corner;
  corner.turn_rad = wrapped_rad(direction_of(out) - direction_of(in));
  const double radius_m = waypoints[i].corner_radius_m.value_or(options.corner_radius_m);
  if (radius_m == 0 || std::abs(corner.turn_rad) < 1e-9) return corner;
  require(std::abs(corner.turn_rad) < pi - 1e-3, "waypoints[" + std::to_string(i) + "].position_m",
          waypoints[i].position_m.transpose(), "no point at which the route reverses");
  corner.radius_m = radius_m;
  return corner;
}

/// Reduces two corners that need more than the line between them by the same factor.
std::vector<Corner> fitting_corners(const std::vector<RouteWaypoint>& waypoints,
                                    const RouteOptions& options) {
  const std::size_t n = waypoints.size(), lines = options.closed ? n : n - 1;
  std::vector<Corner> corners(n);
  for (std::size_t i = options.closed ? 0 : 1; i < lines; ++i)
    corners[i] = corner_at(i, waypoints, options);
  std::vector<double> shares(n, 1);
  for (std::size_t i = 0; i < lines; ++i) {
    const std::size_t next = (i + 1) % n;
    const double length = (waypoints[next].position_m - waypoints[i].position_m).norm();
    const double requested = corners[i].cut_m() + corners[next].cut_m();
    if (requested <= length) continue;
    for (const std::size_t k : {i, next}) shares[k] = std::min(shares[k], length / requested);
  }
  for (std::size_t i = 0; i < n; ++i) corners[i].radius_m *= shares[i];
  return corners;
}

void add_piece(std::vector<RoutePiece>& pieces, const PlanarPose& begin, double length_m,
               double curvature_1_m, double speed_m_s) {
  if (length_m > shortest_m) pieces.push_back({begin, 0, length_m, curvature_1_m, speed_m_s});
}

/// Arc that starts at `from` along its heading and ends at `to`; a line if that is straight ahead.
void add_arc_to(std::vector<RoutePiece>& pieces, const PlanarPose& from, const Eigen::Vector2d& to,
                double speed_m_s) {
  const Eigen::Vector2d off = to - from.position();
  const double ahead = off.dot(from.forward()), left = off.dot(from.left());
  const double half_turn = std::atan2(left, ahead);
  if (std::abs(half_turn) < 1e-9) return add_piece(pieces, from, off.norm(), 0, speed_m_s);
  const double curvature = 2 * std::sin(half_turn) / off.norm();
  add_piece(pieces, from, 2 * half_turn / curvature, curvature, speed_m_s);
}

/// Biarc between two poses, with tangents of equal length.
void add_biarc(std::vector<RoutePiece>& pieces, const PlanarPose& from, const PlanarPose& to,
               double speed_m_s) {
  const Eigen::Vector2d v = to.position() - from.position();
  const Eigen::Vector2d sum = from.forward() + to.forward();
  // |v - d sum|^2 = (2 d)^2
  const double a = 4 - sum.squaredNorm(), b = v.dot(sum), c = v.squaredNorm();
  const double d = c / (b + std::sqrt(b * b + a * c));
  const Eigen::Vector2d joint =
      0.5 * (from.position() + to.position() + d * (from.forward() - to.forward()));
  const Eigen::Vector2d along =
      to.position() - d * to.forward() - from.position() - d * from.forward();
  add_arc_to(pieces, from, joint, speed_m_s);
  add_arc_to(pieces, {joint.x(), joint.y(), direction_of(along)}, to.position(), speed_m_s);
}

/// Computes the second derivatives of a cubic spline over chord length at its knots; they are zero
/// at the ends of an open curve.
Eigen::MatrixX2d second_derivatives(const std::vector<Eigen::Vector2d>& points,
                                    const std::vector<double>& chords, bool closed) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(n, 2);
  for (Eigen::Index i = closed ? 0 : 1; i < (closed ? n : n - 1); ++i) {
    const Eigen::Index before = (i + n - 1) % n, after = (i + 1) % n;
    const auto at = [](Eigen::Index k) { return static_cast<std::size_t>(k); };
    const double h0 = chords[at(before)], h1 = chords[at(i)];
    system(i, i) = (h0 + h1) / 3;
    system(i, before) += h0 / 6;
    system(i, after) += h1 / 6;
    right.row(i) =
        ((points[at(after)] - points[at(i)]) / h1 - (points[at(i)] - points[at(before)]) / h0)
            .transpose();
  }
  Eigen::MatrixX2d slopes(n, 2);
  for (const int axis : {0, 1}) slopes.col(axis) = core::solve_lu(system, right.col(axis));
  return slopes;
}

/// One span of the spline.
struct Span {
  Eigen::Vector2d p0, p1, m0, m1;  // points, second derivatives
  double h;

  PlanarPose at(double t) const {  // t in [0, 1]
    const double s = 1 - t, k = h * h / 6;
    const Eigen::Vector2d p = s * p0 + t * p1 + k * ((s * s * s - s) * m0 + (t * t * t - t) * m1);
    const Eigen::Vector2d d = p1 - p0 + k * ((1 - 3 * s * s) * m0 + (3 * t * t - 1) * m1);
    return {p.x(), p.y(), direction_of(d)};
  }
};

}  // namespace

std::vector<RoutePiece> rounded_lines(const std::vector<RouteWaypoint>& waypoints,
                                      const RouteOptions& options) {
  const std::size_t n = waypoints.size();
  const std::vector<double> speeds = speeds_of(waypoints, options);
  const std::vector<Corner> corners = fitting_corners(waypoints, options);
  std::vector<RoutePiece> pieces;
  for (std::size_t i = 0; i < (options.closed ? n : n - 1); ++i) {
    const std::size_t next = (i + 1) % n;
    const Eigen::Vector2d line = waypoints[next].position_m - waypoints[i].position_m;
    const double heading = direction_of(line), length = line.norm();
    const PlanarPose at{waypoints[i].position_m.x(), waypoints[i].position_m.y(), heading};
    const double from = corners[i].cut_m(), to = length - corners[next].cut_m();
    add_piece(pieces, at * PlanarPose{from, 0, 0}, to - from, 0, speeds[i]);
    if (corners[next].radius_m > 0)
      add_piece(pieces, at * PlanarPose{to, 0, 0},
                corners[next].radius_m * std::abs(corners[next].turn_rad),
                std::copysign(1 / corners[next].radius_m, corners[next].turn_rad), speeds[i]);
  }
  return pieces;
}

std::vector<RoutePiece> spline_arcs(const std::vector<RouteWaypoint>& waypoints,
                                    const RouteOptions& options) {
  const std::size_t n = waypoints.size();
  const std::vector<double> speeds = speeds_of(waypoints, options);
  std::vector<Eigen::Vector2d> points;
  std::vector<double> chords;
  for (std::size_t i = 0; i < n; ++i) {
    points.push_back(waypoints[i].position_m);
    chords.push_back((waypoints[(i + 1) % n].position_m - waypoints[i].position_m).norm());
  }
  const Eigen::MatrixX2d bends = second_derivatives(points, chords, options.closed);
  std::vector<RoutePiece> pieces;
  constexpr int parts = 16;  // pairs of arcs per span
  for (std::size_t i = 0; i < (options.closed ? n : n - 1); ++i) {
    const std::size_t next = (i + 1) % n;
    const Span span{points[i], points[next], bends.row(static_cast<Eigen::Index>(i)).transpose(),
                    bends.row(static_cast<Eigen::Index>(next)).transpose(), chords[i]};
    for (int part = 0; part < parts; ++part)
      add_biarc(pieces, span.at(part / double{parts}), span.at((part + 1) / double{parts}),
                speeds[i]);
  }
  return pieces;
}

}  // namespace occ::internal::guide
