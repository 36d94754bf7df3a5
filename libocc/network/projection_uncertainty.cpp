// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/network_statistics.hpp"

namespace occ {

namespace core = internal::core;
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

struct GridPoint {
  Index row, column;
  MatrixXd by_parameters;  ///< two rows
  MatrixXd by_pose;        ///< rotation, and translation at a finite range
};

}  // namespace

ProjectionUncertainty projection_uncertainty(const Camera& camera,
                                             const std::vector<std::string>& free,
                                             const MatrixXd& covariance, int columns, int rows,
                                             double range_m) {
  require(columns >= 2, "columns", columns, "at least 2");
  require(rows >= 2, "rows", rows, "at least 2");
  require(range_m > 0, "range_m", range_m, "positive");
  const Index count = static_cast<Index>(free.size());
  require(covariance.rows() == count && covariance.cols() == count && covariance.allFinite(),
          "covariance", covariance.rows(), "finite, one row for each free parameter");
  const MatrixXd directions = free_parameter_directions(camera, free);

  const bool has_range = std::isfinite(range_m);
  const double distance = has_range ? range_m : 1e6;  // large compared with any camera
  ProjectionUncertainty out;
  out.x_px.resize(rows, columns);
  out.y_px.resize(rows, columns);
  out.sigma_px = MatrixXd::Constant(rows, columns, std::numeric_limits<double>::infinity());
  std::vector<GridPoint> points;
  for (Index r = 0; r < rows; ++r)
    for (Index c = 0; c < columns; ++c) {
      const Eigen::Vector2d pixel((static_cast<double>(c) + 0.5) * camera.width() / columns - 0.5,
                                  (static_cast<double>(r) + 0.5) * camera.height() / rows - 0.5);
      out.x_px(r, c) = pixel.x();
      out.y_px(r, c) = pixel.y();
      const auto ray = camera.ray(pixel);
      if (!ray) continue;
      const Eigen::Vector3d x = ray->origin + distance * ray->direction;
      Eigen::Matrix<double, 2, 3> d_point;
      Camera::ParameterJacobian d_parameters;
      if (!camera.project(x, &d_point, &d_parameters)) continue;
      GridPoint point{r, c, {}, {}};
      point.by_parameters = core::product(MatrixXd(d_parameters), directions);
      point.by_pose.resize(2, has_range ? 6 : 3);
      point.by_pose.leftCols<3>() = -d_point * skew(x);
      if (has_range) point.by_pose.rightCols<3>() = d_point * distance;
      points.push_back(point);
    }
  if (points.empty()) return out;

  const Index pose = has_range ? 6 : 3;
  MatrixXd normal = MatrixXd::Zero(pose, pose), mixed = MatrixXd::Zero(pose, count);
  for (const GridPoint& point : points) {
    normal += core::transposed_product(point.by_pose, point.by_pose);
    mixed += core::transposed_product(point.by_pose, point.by_parameters);
  }
  // Minimum-norm solution, because the pose may be undetermined (a panorama's shift along its
  // axis).
  const MatrixXd compensation = -core::minimum_norm_solution(normal, mixed);
  double sum = 0;
  for (const GridPoint& point : points) {
    const MatrixXd uncompensated = point.by_parameters + core::product(point.by_pose, compensation);
    const Eigen::Matrix2d q =
        core::product_transposed(core::product(uncompensated, covariance), uncompensated);
    const double sigma = std::sqrt(std::max(0.0, core::symmetric_eigenvalues(q)[1]));
    out.sigma_px(point.row, point.column) = sigma;
    out.worst_px = std::max(out.worst_px, sigma);
    sum += sigma;
  }
  out.mean_px = sum / static_cast<double>(points.size());
  return out;
}

}  // namespace occ
