// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

void require_finite_value(const char* name, double value) {
  require(std::isfinite(value), name, value, "finite");
}

void require_focal_length(const char* name, double value) {
  require(value > 0 && std::isfinite(value), name, value, "positive and finite");
}

}  // namespace

const char* name_of(CameraKind kind) {
  switch (kind) {
    case CameraKind::pinhole:
      return "pinhole";
    case CameraKind::fisheye:
      return "fisheye";
    case CameraKind::double_sphere:
      return "double_sphere";
    case CameraKind::brown_forward:
      return "brown_forward";
    case CameraKind::brown_backward:
      return "brown_backward";
    case CameraKind::equirectangular:
      return "equirectangular";
    case CameraKind::rotating_line:
      return "rotating_line";
    case CameraKind::rotating_line_first_order:
      return "rotating_line_first_order";
  }
  return "";
}

CameraModel::CameraModel(CameraKind kind, int width, int height, const CameraMatrix& matrix,
                         std::vector<double> distortion)
    : kind_(kind),
      width_(width),
      height_(height),
      matrix_(matrix),
      distortion_(std::move(distortion)) {}

CameraModel::~CameraModel() = default;

void CameraModel::require_size_and_matrix() const {
  require(width_ > 0, "width", width_, "positive");
  require(height_ > 0, "height", height_, "positive");
  require_focal_length("fx_px", matrix_.fx);
  require_focal_length("fy_px", matrix_.fy);
  require_finite_value("cx_px", matrix_.cx);
  require_finite_value("cy_px", matrix_.cy);
  require_finite_value("skew_px", matrix_.skew);
}

Eigen::Vector3d CameraModel::origin(const Eigen::Vector2d&) const {
  return Eigen::Vector3d::Zero();
}

double CameraModel::depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const {
  const double depth = point.norm();
  if (gradient) *gradient = point / std::max(depth, std::numeric_limits<double>::min());
  return depth;
}

}  // namespace occ
