// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_view.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/survey/internal/tag_views.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int ellipse_points = 24;  // an ellipse has five unknowns; more points average the lens
// Relative error of a range that the noise does not contain, such as of a lamp's uneven light.
constexpr double min_range_sigma = 2e-3;
constexpr double min_centre_sigma_px = 0.03;  // likewise, of the centre of a lamp's image

/// Cone of the rays, in a frame whose z axis is `middle`: A u^2 + B u v + C v^2 + D u + E v = 1.
std::optional<Matrix3d> cone_of(const std::vector<Vector3d>& bearings, const Matrix3d& to_local) {
  std::vector<Vector2d> points;
  double scale = 0;
  for (const Vector3d& bearing : bearings) {
    const Vector3d local = to_local * bearing;
    if (!(local.z() > 0)) return std::nullopt;
    points.emplace_back(local.head<2>() / local.z());
    scale = std::max(scale, points.back().norm());
  }
  if (!(scale > 0)) return std::nullopt;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  Matrix5 normal = Matrix5::Zero();
  Vector5 rhs = Vector5::Zero();
  for (const Vector2d& point : points) {
    const double u = point.x() / scale, v = point.y() / scale;
    Vector5 row;
    row << u * u, u * v, v * v, u, v;
    normal += row * row.transpose();
    rhs += row;
  }
  const core::Ldlt<Matrix5> factors(normal);
  constexpr double singular = 1e-12;
  if (!(factors.rcond() > singular)) return std::nullopt;
  const Vector5 conic = factors.solve(rhs);
  const double s2 = scale * scale;
  Matrix3d cone;
  cone << conic[0] / s2, conic[1] / (2 * s2), conic[3] / (2 * scale),  //
      conic[1] / (2 * s2), conic[2] / s2, conic[4] / (2 * scale),      //
      conic[3] / (2 * scale), conic[4] / (2 * scale), -1;
  return cone;
}

bool add_disc(const Blob& blob, const Camera& camera, LampShapeView& view) {
  const Ellipse& ellipse = blob.ellipse;
  std::vector<Vector3d> bearings;
  for (int k = 0; k < ellipse_points; ++k) {
    const double t = 2 * pi * k / ellipse_points;
    const Vector2d axes(ellipse.semi_major_px * std::cos(t), ellipse.semi_minor_px * std::sin(t));
    const auto bearing =
        camera.unproject(ellipse.centre_px + Eigen::Rotation2Dd(ellipse.angle_rad) * axes);
    if (!bearing) return false;
    bearings.push_back(*bearing);
  }
  const auto middle = camera.unproject(ellipse.centre_px);
  if (!middle) return false;
  const Matrix3d to_local = shortest_rotation(*middle, Vector3d::UnitZ());
  const auto cone = cone_of(bearings, to_local);
  if (!cone) return false;
  const auto eigen = core::symmetric_eigen<Matrix3d>(*cone, Eigen::ComputeEigenvectors);
  const double l3 = eigen.eigenvalues()[0], l2 = eigen.eigenvalues()[1];
  const double l1 = eigen.eigenvalues()[2];
  if (!(l3 < 0 && l2 > 0)) return false;
  const double p = std::sqrt((l1 - l2) / (l1 - l3)), q = std::sqrt((l2 - l3) / (l1 - l3));
  const double z0 = l2 / std::sqrt(-l1 * l3);
  // The eigenvectors are in ascending order of the eigenvalues: the axis of the cone comes first.
  Vector3d mean = Vector3d::Zero();
  for (const double sign : {1.0, -1.0}) {
    Vector3d centre = eigen.eigenvectors() * Vector3d(l1 / l2 * q, 0, sign * l3 / l2 * p) * z0;
    Vector3d normal = eigen.eigenvectors() * Vector3d(q, 0, sign * p);
    if (centre.z() < 0) centre = -centre;
    if (normal.dot(centre) > 0) normal = -normal;
    mean += 0.5 * (to_local.transpose() * centre);
    view.normals.push_back(to_local.transpose() * normal);
  }
  view.range = mean.norm();
  view.bearing = mean / view.range;
  return true;
}

bool add_rectangle(const Blob& blob, const Camera& camera, LampShapeView& view) {
  std::array<Vector3d, 4> bearings;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto bearing = camera.unproject(blob.corners_px[k]);
    if (!bearing) return false;
    bearings[k] = *bearing;
  }
  Eigen::MatrixXd a(3, 3);
  a << bearings[1], -bearings[2], bearings[3];
  const Eigen::VectorXd distances = core::solve_lu(a, Eigen::VectorXd(bearings[0]));
  if (!distances.allFinite() || !(distances.minCoeff() > 0)) return false;
  for (std::size_t k = 1; k < 4; ++k) bearings[k] *= distances[static_cast<Eigen::Index>(k) - 1];
  const Vector3d centre = (bearings[0] + bearings[1] + bearings[2] + bearings[3]) / 4;
  const Vector3d first = bearings[1] - bearings[0], second = bearings[3] - bearings[0];
  Vector3d normal = first.cross(second);
  const double area = normal.norm();
  if (!(area > 0)) return false;
  normal /= normal.dot(centre) > 0 ? -area : area;
  const double size = std::sqrt(area / pi);
  view.shape = LampShape::rectangle;
  view.range = centre.norm() / size;
  view.bearing = centre.normalized();
  view.normals = {normal};
  view.x_axis = first.normalized();
  view.sides = Vector2d(first.norm(), second.norm()) / size;
  return true;
}

}  // namespace

const char* reason_without_view(const Blob& blob) {
  if (blob.cut_by_border) return "the border of the picture cuts it";
  if (blob.merged) return "it shows several lamps";
  if (blob.striped) return "its rim has stripes";
  if (blob.free_form) return "its outline is neither an ellipse nor a convex polygon";
  if (blob.rim.size() < 8 || !(blob.ellipse.semi_minor_px > 0))
    return "it is too small for a measured rim";
  return "";
}

std::optional<LampShapeView> lamp_view(const Blob& blob, int index, const Camera& camera) {
  if (*reason_without_view(blob) != '\0') return std::nullopt;
  LampShapeView view;
  view.blob = index;
  view.tag = tag_of(blob).value_or(-1);
  const bool has_shape = blob.corners_px.size() == 4 ? add_rectangle(blob, camera, view)
                                                     : add_disc(blob, camera, view);
  if (!has_shape) return std::nullopt;
  double variance = 0;
  for (const RimPoint& point : blob.rim) variance += square(point.sigma_px);
  const double count = static_cast<double>(blob.rim.size());
  const double radius_px = std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px);
  const double growth = std::sqrt(variance / square(count) + blob.rim_covariance_px2(0, 0));
  if (view.tag >= 0) {
    // The tilt follows from the perspective across the tag, which is its side squared over the
    // distance, in pixels.
    constexpr double min_sigma_px = 0.1;  // of a corner in a compressed picture
    const double sigma_px = std::max(min_sigma_px, std::sqrt(variance / square(count)));
    view.tilt_sigma_rad = 2 * sigma_px * view.range / (pi * radius_px);
  }
  view.range_sigma = std::hypot(min_range_sigma, growth / radius_px);
  Eigen::Matrix<double, 3, 2> jacobian;
  if (!camera.unproject(blob.centroid_px, &jacobian)) return std::nullopt;
  const double px = std::hypot(min_centre_sigma_px, std::sqrt(0.5 * blob.covariance_px2.trace()));
  view.angle_sigma_rad = px * jacobian.norm() / std::sqrt(2.0);
  return view;
}

Vector3d consensus_direction(const std::vector<Vector3d>& directions, const Vector3d& hint) {
  constexpr double max_angle_rad = 0.2;  // error of a normal from the rim of a lamp seen from below
  const double min_cosine = std::cos(max_angle_rad);
  constexpr double tie = 0.8;  // of the votes of the best direction
  std::vector<std::pair<int, Vector3d>> means;
  int best = 0;
  for (const Vector3d& candidate : directions) {
    int votes = 0;
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& other : directions)
      if (candidate.dot(other) > min_cosine) {
        ++votes;
        sum += other;
      }
    means.emplace_back(votes, sum.normalized());
    best = std::max(best, votes);
  }
  std::pair<int, Vector3d> chosen(0, Vector3d::Zero());
  for (const auto& mean : means)
    if (hint.isZero() ? mean.first > chosen.first
                      : mean.first >= tie * best &&
                            (chosen.first == 0 || mean.second.dot(hint) > chosen.second.dot(hint)))
      chosen = mean;
  return chosen.second;
}

Vector3d common_normal(const std::vector<LampShapeView>& views) {
  std::vector<Vector3d> normals;
  for (const LampShapeView& view : views)
    if (view.tag < 0) normals.insert(normals.end(), view.normals.begin(), view.normals.end());
  return consensus_direction(normals);
}

std::optional<Vector3d> line_normal(const std::vector<Vector3d>& bearings, double max_width) {
  Matrix3d sum = Matrix3d::Zero();
  for (const Vector3d& bearing : bearings) sum += bearing * bearing.transpose();
  const auto eigen = core::symmetric_eigen<Matrix3d>(sum, Eigen::ComputeEigenvectors);
  if (!(eigen.eigenvalues()[0] < square(max_width) * eigen.eigenvalues()[1])) return std::nullopt;
  return eigen.eigenvectors().col(0);
}

}  // namespace occ::internal::survey
