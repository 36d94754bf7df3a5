// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/response_basis.hpp"

#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

using Eigen::ArrayXd;

/// Curves of the family without a change of contrast.
std::vector<ArrayXd> plain_curves(const ArrayXd& x) {
  std::vector<ArrayXd> curves;
  for (double gamma = 1; gamma < 3.05; gamma += 0.2) curves.push_back(x.pow(1 / gamma));
  for (const double a : {1.0, 3.0, 10.0, 30.0, 100.0})
    curves.push_back((1 + a * x).log() / std::log(1 + a));
  for (const double power : {0.8, 1.0, 1.25})
    for (const double half : {0.1, 0.3, 1.0}) {
      const double scale = std::pow(half, power);
      curves.push_back(x.pow(power) * (1 + scale) / (x.pow(power) + scale));
    }
  return curves;
}

/// All curves of the family, one per column.
Eigen::MatrixXd family(int samples) {
  const ArrayXd x = ArrayXd::LinSpaced(samples, 0, 1);
  const std::vector<ArrayXd> plain = plain_curves(x);
  Eigen::MatrixXd curves(samples, 3 * static_cast<Eigen::Index>(plain.size()));
  Eigen::Index column = 0;
  for (const ArrayXd& f : plain)
    for (const double contrast : {-0.4, 0.0, 0.4})
      curves.col(column++) = f + contrast * f * (1 - f) * (2 * f - 1);
  return curves;
}

template <typename Count>
void require_count(Count count, const char* name) {
  require(count >= 1 && count <= 8, name, count, "between 1 and 8");
}

}  // namespace

ResponseBasis response_basis(int count, int samples) {
  require_count(count, "count");
  require(samples >= 16 && samples <= 65536, "samples", samples, "between 16 and 65536");
  const Eigen::MatrixXd curves = family(samples);
  ResponseBasis basis;
  basis.mean = curves.rowwise().mean();
  const Eigen::MatrixXd differences = curves.colwise() - basis.mean;
  // Principal components from the Gram matrix of the curves, which is smaller than the covariance.
  const auto solver =
      internal::core::symmetric_eigen<Eigen::MatrixXd>(differences.transpose() * differences);
  basis.functions.resize(samples, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::VectorXd function = differences * solver.eigenvectors().col(curves.cols() - 1 - k);
    function *= std::sqrt(samples / function.squaredNorm());
    basis.functions.col(k) = function.sum() < 0 ? Eigen::VectorXd(-function) : function;
  }
  return basis;
}

std::vector<double> response_curve(const std::vector<double>& coefficients, int samples) {
  require_count(coefficients.size(), "response_coefficients' length");
  const ResponseBasis basis = response_basis(static_cast<int>(coefficients.size()), samples);
  const Eigen::Map<const Eigen::VectorXd> c(coefficients.data(),
                                            static_cast<Eigen::Index>(coefficients.size()));
  require(c.allFinite(), "response_coefficients", c.transpose(), "finite");
  const Eigen::VectorXd curve = basis.mean + basis.functions * c;
  std::vector<double> table(curve.data(), curve.data() + curve.size());
  table.front() = 0;
  table.back() = 1;
  for (std::size_t i = 1; i < table.size(); ++i)
    require(table[i] > table[i - 1], "response_coefficients", c.transpose(),
            "those of a curve that rises everywhere");
  return table;
}

std::vector<double> response_coefficients(const std::vector<double>& table, int count) {
  require(table.size() >= 16, "table's length", table.size(), "at least 16");
  const ResponseBasis basis = response_basis(count, static_cast<int>(table.size()));
  const Eigen::Map<const Eigen::VectorXd> curve(table.data(),
                                                static_cast<Eigen::Index>(table.size()));
  const Eigen::VectorXd c =
      basis.functions.transpose() * (curve - basis.mean) / static_cast<double>(table.size());
  return {c.data(), c.data() + c.size()};
}

}  // namespace occ
