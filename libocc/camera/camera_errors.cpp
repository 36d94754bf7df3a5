// SPDX-License-Identifier: Apache-2.0
// Errors of a camera's parameters.
#include <array>
#include <cmath>
#include <string>

#include "libocc/camera/camera.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::core;
namespace {

constexpr double tolerance = 1e-6;  // of symmetry and of negative eigenvalues: single precision

/// Numbers of coefficients that the models of lenses have.
constexpr std::array<std::size_t, 6> coefficient_counts = {0, 4, 5, 8, 12, 14};

std::string names_of(const Camera& camera) {
  std::string names;
  for (const CameraParameter& parameter : camera.parameters())
    names += (names.empty() ? "" : ", ") + parameter.name;
  return names;
}

int index_of(const Camera& camera, const std::string& name) {
  const std::vector<CameraParameter> all = camera.parameters();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i].name == name) return static_cast<int>(i);
  return -1;
}

/// The camera with so many distortion coefficients that it has the parameter, if its model can.
Camera with_parameter(const Camera& camera, const std::string& name) {
  const bool is_forward = camera.kind() == CameraKind::brown_forward;
  if ((is_forward || camera.kind() == CameraKind::brown_backward) && camera.distortion().empty()) {
    const auto make = is_forward ? &Camera::brown_forward : &Camera::brown_backward;
    const std::vector<CameraParameter> constants = camera.constants();
    return make(camera.width(), camera.height(), camera.fx_px(), camera.fy_px(), camera.cx_px(),
                camera.cy_px(), std::vector<double>(7), constants[0].value, constants[1].value,
                camera.skew_px());
  }
  const bool is_lens = camera.is_pinhole() || camera.kind() == CameraKind::fisheye;
  if (!is_lens) return camera;
  for (const std::size_t count : coefficient_counts) {
    if (count < camera.distortion().size() || (!camera.is_pinhole() && count > 4)) continue;
    std::vector<double> coefficients = camera.distortion();
    coefficients.resize(count, 0.0);
    const auto make = camera.is_pinhole() ? &Camera::pinhole : &Camera::fisheye;
    const Camera longer = make(camera.width(), camera.height(), camera.fx_px(), camera.fy_px(),
                               camera.cx_px(), camera.cy_px(), coefficients, camera.skew_px());
    if (index_of(longer, name) >= 0) return longer;
  }
  return camera;
}

}  // namespace

Eigen::MatrixXd Camera::root_of_covariance() const {
  return errors_ ? errors_->root : Eigen::MatrixXd::Zero(model_->parameter_count(), 0);
}

Eigen::MatrixXd Camera::parameter_covariance() const {
  const Eigen::Index count = model_->parameter_count();
  return errors_ ? errors_->covariance : Eigen::MatrixXd::Zero(count, count);
}

std::optional<std::map<std::string, double>> Camera::independent_sigmas() const {
  const Eigen::MatrixXd covariance = parameter_covariance();
  if (!covariance.isDiagonal(0)) return std::nullopt;
  std::map<std::string, double> sigmas;
  Eigen::Index i = 0;
  for (const CameraParameter& parameter : parameters()) {
    const double variance = covariance(i, i);
    if (variance > 0) sigmas[parameter.name] = std::sqrt(variance);
    ++i;
  }
  return sigmas;
}

Camera Camera::with_parameter_covariance(const Eigen::MatrixXd& covariance) const {
  const Eigen::Index count = model_->parameter_count();
  const std::string size = std::to_string(count) + " x " + std::to_string(count);
  require(covariance.rows() == count && covariance.cols() == count, "parameter_covariance",
          std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()),
          size + ", one row for each of " + names_of(*this));
  require(covariance.allFinite(), "parameter_covariance", "a number that is not", "finite");
  const Eigen::VectorXd sigmas = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigmas.array() > 0).select(sigmas, 1);
  const Eigen::MatrixXd inverse = scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd scaled = inverse * covariance * inverse;
  require((scaled - scaled.transpose()).cwiseAbs().maxCoeff() <= tolerance, "parameter_covariance",
          vector_text(covariance.diagonal()) + " on its diagonal", "symmetric");
  const auto eigen = symmetric_eigen<Eigen::MatrixXd>(scaled);
  require(eigen.eigenvalues()[0] >= -tolerance, "parameter_covariance",
          "the eigenvalue " + std::to_string(eigen.eigenvalues()[0]) + " of its correlations",
          "positive semidefinite");
  Camera changed = *this;
  const Eigen::Index first = (eigen.eigenvalues().array() <= 1e-12).count();
  const Eigen::Index rank = count - first;
  changed.errors_.reset();
  if (rank > 0)
    changed.errors_ = std::make_shared<Errors>(
        Errors{covariance, scale.asDiagonal() * eigen.eigenvectors().rightCols(rank) *
                               eigen.eigenvalues().tail(rank).cwiseSqrt().asDiagonal()});
  return changed;
}

Camera Camera::with_parameter_sigmas(const std::map<std::string, double>& sigmas) const {
  Camera changed = *this;
  const int fx = index_of(*this, "fx_px"), fy = index_of(*this, "fy_px");
  const auto is_common = [&](const std::string& name) {
    return name == common_focal_length && fx >= 0 && fy >= 0;
  };
  for (const auto& [name, sigma] : sigmas) {
    if (!is_common(name) && index_of(changed, name) < 0) changed = with_parameter(changed, name);
    require(is_common(name) || index_of(changed, name) >= 0, "parameter_sigmas", "`" + name + "`",
            "standard deviations of parameters that a " + std::string(name_of(kind())) +
                " camera has: " + names_of(*this));
    require(sigma >= 0 && std::isfinite(sigma), "parameter_sigmas." + name, sigma,
            "zero or positive");
  }
  const Eigen::Index count = changed.model_->parameter_count();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  for (const auto& [name, sigma] : sigmas) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(count);
    if (is_common(name)) {
      change[fx] = sigma;
      change[fy] = sigma * fy_px() / fx_px();
    } else {
      change[index_of(changed, name)] = sigma;
    }
    covariance += change * change.transpose();
  }
  require(sigmas.empty() || covariance.diagonal().maxCoeff() > 0, "parameter_sigmas", 0.0,
          "positive for one parameter or more; leave them out if the camera is exact");
  return changed.with_parameter_covariance(covariance);
}

}  // namespace occ
