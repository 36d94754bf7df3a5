// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {

using Eigen::MatrixXd;
using View = Eigen::Ref<const MatrixXd>;

namespace {

struct FixedCacheSizes {
  FixedCacheSizes() { Eigen::setCpuCacheSizes(32 << 10, 1 << 20, 8 << 20); }
};
const FixedCacheSizes fixed_cache_sizes;

}  // namespace

std::array<std::ptrdiff_t, 3> cache_bytes_of_products() {
  return {Eigen::l1CacheSize(), Eigen::l2CacheSize(), Eigen::l3CacheSize()};
}

void product(const View& a, const View& b, Eigen::Ref<MatrixXd> out) { out.noalias() = a * b; }
void transposed_product(const View& a, const View& b, Eigen::Ref<MatrixXd> out) {
  out.noalias() = a.transpose() * b;
}
void product_transposed(const View& a, const View& b, Eigen::Ref<MatrixXd> out) {
  out.noalias() = a * b.transpose();
}

MatrixXd product(const View& a, const View& b) {
  MatrixXd out(a.rows(), b.cols());
  product(a, b, out);
  return out;
}
MatrixXd transposed_product(const View& a, const View& b) {
  MatrixXd out(a.cols(), b.cols());
  transposed_product(a, b, out);
  return out;
}
MatrixXd product_transposed(const View& a, const View& b) {
  MatrixXd out(a.rows(), b.rows());
  product_transposed(a, b, out);
  return out;
}

void solve_lower_in_place(const View& l, Eigen::Ref<MatrixXd> b) {
  l.triangularView<Eigen::Lower>().solveInPlace(b);
}
void solve_lower_transposed_in_place(const View& l, Eigen::Ref<MatrixXd> b) {
  l.triangularView<Eigen::Lower>().transpose().solveInPlace(b);
}

MatrixXd gram_matrix(const MatrixXd& a) {
  MatrixXd sum = MatrixXd::Zero(a.cols(), a.cols());
  sum.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
  return sum.selfadjointView<Eigen::Lower>();
}

void subtract_square(const View& w, MatrixXd& a) {
  a.selfadjointView<Eigen::Lower>().rankUpdate(w, -1);
}

}  // namespace occ::internal::core
