// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/point_layout.hpp"

#include <Eigen/Dense>

namespace occ::internal::pose {
namespace {

// Of the widest extent. Thinner layouts carry no direction across: they are rounding.
constexpr double thinnest = 1e-10;

}  // namespace

PointLayout point_layout(const Eigen::Matrix3Xd& points) {
  PointLayout layout;
  layout.centroid = points.rowwise().mean();
  const Eigen::Matrix3Xd about_centroid = points.colwise() - layout.centroid;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(about_centroid, Eigen::ComputeFullU);
  layout.axes = svd.matrixU();
  if (layout.axes.determinant() < 0) layout.axes.col(2) *= -1;
  layout.extent.setZero();
  const Eigen::Index count = std::min<Eigen::Index>(3, svd.singularValues().size());
  layout.extent.head(count) = svd.singularValues().head(count);
  return layout;
}

bool spans_plane(const PointLayout& layout) {
  return layout.extent[1] > thinnest * layout.extent[0];
}

bool spans_space(const PointLayout& layout) {
  return layout.extent[2] > thinnest * layout.extent[0];
}

}  // namespace occ::internal::pose
