// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/covariance.hpp"

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::core {
namespace {

constexpr double tolerance = 1e-6, min_variance_ratio = 1e-6;

template <class Matrix>
using Column = Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1>;

template <class Matrix>
Column<Matrix> inverse_scale(const Matrix& a) {
  const Column<Matrix> diagonal = a.diagonal();
  return diagonal.cwiseMax(min_variance_ratio * diagonal.maxCoeff()).cwiseSqrt().cwiseInverse();
}

template <class Matrix>
Matrix symmetric_part(const Matrix& a) {
  return 0.5 * (a + a.transpose());
}

template <class Matrix>
void require_symmetric(const Matrix& a, const Matrix& scaled, std::string_view name) {
  const Matrix skewed = scaled - scaled.transpose();
  require(skewed.cwiseAbs().maxCoeff() <= tolerance, name, a, "symmetric");
}

template <class Matrix>
void check_semidefinite(const Matrix& a, std::string_view name) {
  require(a.allFinite(), name, a, "finite");
  if (a.isZero(0)) return;
  constexpr std::string_view rule = "positive semi-definite";
  require(a.diagonal().maxCoeff() > 0, name, a, rule);
  const Column<Matrix> unit = inverse_scale(a);
  const Matrix scaled = unit.asDiagonal() * a * unit.asDiagonal();
  require_symmetric(a, scaled, name);
  if (is_positive_definite(scaled)) return;
  const auto eigen = symmetric_eigen<Matrix>(symmetric_part(scaled), Eigen::EigenvaluesOnly);
  require(eigen.eigenvalues()[0] >= -tolerance, name, a, rule);
}

template <class Matrix>
void check_definite(const Matrix& a, std::string_view name) {
  require(a.allFinite(), name, a, "finite");
  constexpr std::string_view rule = "positive definite";
  require(a.diagonal().minCoeff() > 0, name, a, rule);
  const Column<Matrix> unit = inverse_scale(a);
  require_symmetric<Matrix>(a, unit.asDiagonal() * a * unit.asDiagonal(), name);
  require(is_positive_definite(symmetric_part(a)), name, a, rule);
}

template <class Matrix>
Matrix root_of(const Matrix& a) {
  const Cholesky<Matrix> cholesky(a);
  if (cholesky.exists()) return cholesky.lower().transpose();
  const Column<Matrix> scale = a.diagonal().cwiseMax(0).cwiseSqrt();
  const Column<Matrix> unit = (scale.array() > 0).select(scale.cwiseInverse(), 0);
  const auto eigen = symmetric_eigen<Matrix>(unit.asDiagonal() * a * unit.asDiagonal());
  return eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose() * scale.asDiagonal();
}

}  // namespace

void require_semidefinite(const Matrix3& a, std::string_view name) { check_semidefinite(a, name); }
void require_semidefinite(const Matrix6& a, std::string_view name) { check_semidefinite(a, name); }

void require_positive_definite(const Matrix2& a, std::string_view name) { check_definite(a, name); }
void require_positive_definite(const Matrix3& a, std::string_view name) { check_definite(a, name); }
void require_positive_definite(const Matrix6& a, std::string_view name) { check_definite(a, name); }

Matrix3 semidefinite_root(const Matrix3& a) { return root_of(a); }
Matrix6 semidefinite_root(const Matrix6& a) { return root_of(a); }

}  // namespace occ::internal::core
