// SPDX-License-Identifier: Apache-2.0
// Zhang's constraints on the image of the absolute conic, w = diag(1/f^2, 1/f^2, 1) about the
// principal point, from each homography (h1 h2 h3) of a plane:
//     h1^T w h2 = 0,   h1^T w h1 = h2^T w h2.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/tag.hpp"

namespace occ {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Transformation that moves the centroid of points to the origin and scales their mean distance to
/// 1 (Hartley, "In defense of the eight-point algorithm", PAMI 19(6), 1997).
Matrix3d normalisation(const Matrix2Xd& points) {
  const Vector2d centroid = points.rowwise().mean();
  const double size = (points.colwise() - centroid).colwise().norm().mean();
  const double s = size > 0 ? 1 / size : 1;
  Matrix3d t;
  t << s, 0, -s * centroid.x(), 0, s, -s * centroid.y(), 0, 0, 1;
  return t;
}

/// Homography by the direct linear transformation. `condition`: ratio of the second smallest to the
/// largest singular value, zero for collinear points.
Matrix3d homography(const Matrix2Xd& from, const Matrix2Xd& to, double& condition) {
  const Matrix3d a = normalisation(from), b = normalisation(to);
  Eigen::MatrixXd rows(2 * from.cols(), 9);
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    const Vector3d p = a * from.col(i).homogeneous(), q = b * to.col(i).homogeneous();
    rows.row(2 * i) << p.transpose(), 0, 0, 0, -q.x() * p.transpose();
    rows.row(2 * i + 1) << 0, 0, 0, p.transpose(), -q.y() * p.transpose();
  }
  const auto eigen = internal::core::symmetric_eigen<Eigen::MatrixXd>(rows.transpose() * rows);
  condition = std::sqrt(std::max(0.0, eigen.eigenvalues()[1] / eigen.eigenvalues()[8]));
  const Eigen::VectorXd h = eigen.eigenvectors().col(0);
  Matrix3d normal;
  normal << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  return b.inverse() * normal * a;
}

/// a u + b = 0 for u = 1 / f^2, normalised so that views of any size have the same weight.
struct Equation {
  double a, b;
};

void add_equations(const PlaneView& view, const Vector2d& centre, std::vector<Equation>& all) {
  constexpr double min_condition = 1e-4;
  Matrix2Xd px = view.px.colwise() - centre;
  double condition = 0;
  const Matrix3d h = homography(view.plane, px, condition);
  if (!(condition > min_condition) || !h.allFinite()) return;
  const Vector3d x = h.col(0), y = h.col(1);
  const Vector3d diagonal_1 = x + y, diagonal_2 = x - y;
  const auto add = [&](const Vector3d& p, const Vector3d& q) {
    // p^T w q = 0 for orthogonal directions p, q of the plane, divided by their lengths.
    const double scale = p.head<2>().norm() * q.head<2>().norm();
    if (scale > 0) all.push_back({p.head<2>().dot(q.head<2>()) / scale, p.z() * q.z() / scale});
  };
  add(x, y);
  add(diagonal_1, diagonal_2);
}

}  // namespace

PlaneView plane_view(const AprilTag& tag) {
  PlaneView view;
  view.plane = tag_corners(1).topRows<2>();
  view.px.resize(2, 4);
  for (int k = 0; k < 4; ++k) view.px.col(k) = tag.corners_px[k];
  return view;
}

Result<Camera> start_pinhole(const std::vector<PlaneView>& views, int width, int height) {
  require(width > 0, "width", width, "positive");
  require(height > 0, "height", height, "positive");
  const Vector2d centre(0.5 * (width - 1), 0.5 * (height - 1));
  const double size = std::max(width, height);
  const auto camera = [&](double f) {
    return Camera::pinhole(width, height, f, f, centre.x(), centre.y());
  };
  constexpr double default_ratio = 0.866;  // f over the larger side: a field of view of 60 degrees
  Result<Camera> result{camera(default_ratio * size), Status::ok, ""};
  std::vector<Equation> equations;
  for (const PlaneView& view : views) {
    require(view.plane.cols() == view.px.cols(), "views: px", view.px.cols(),
            "one for each point of the plane");
    require_finite(view.plane, "views: plane");
    require_finite(view.px, "views: px");
    if (view.px.cols() >= 4) add_equations(view, centre, equations);
  }
  if (equations.empty()) {
    result.status = Status::too_few_lamps;
    result.message = "no view of a plane has four points or more";
    return result;
  }
  // Least squares in u. b is the perspective effect, of second order in the tilt of the plane.
  double ab = 0, bb = 0, aa = 0;
  for (const Equation& e : equations) {
    ab += e.a * e.b;
    bb += e.b * e.b;
    aa += e.a * e.a;
  }
  constexpr double min_ratio = 0.2, max_ratio = 20;  // plausible f over the larger side
  const double u = bb > 0 ? -ab / aa : 0, f = u > 0 ? 1 / std::sqrt(u) : 0;
  if (!(f > min_ratio * size && f < max_ratio * size)) {
    result.status = Status::degenerate;
    result.message = "the planes are too nearly parallel to the image to determine a focal length";
    return result;
  }
  result.value = camera(f);
  return result;
}

}  // namespace occ
