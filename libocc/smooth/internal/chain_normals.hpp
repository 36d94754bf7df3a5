// SPDX-License-Identifier: Apache-2.0
// Normal equations of a chain, H delta = -g. They are block tridiagonal, because only consecutive
// poses share terms. With A_k a diagonal block and B_k the block that couples k and k + 1, the
// factorisation
//     S_0 = A_0,  S_k+1 = A_k+1 - B_k^T S_k^-1 B_k
// gives the solution by forward and backward substitution. The information of all earlier poses
// about pose k is
//     M_k = T_k-1 - B_k-1^T (O_k-1 + M_k-1 + F_k-1)^-1 B_k-1
// where O is the part of A from a pose's own observations, and F and T are the parts from a link at
// its start and its end. M'_k of the later poses follows likewise. The covariance of each pose is
// then P_k = (O_k + M_k + M'_k)^-1, and whether it is determined is tested for each pose
// separately.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/smooth/internal/common_errors.hpp"

namespace occ::internal::smooth {

template <int size>
struct ChainNormals {
  using Block = Eigen::Matrix<double, size, size>;
  using Part = Eigen::Matrix<double, size, 1>;
  std::vector<Block> own;
  std::vector<Block> from, to;  // parts from link k, at pose k and at pose k + 1
  std::vector<Block> coupling;  // rows of pose k, columns of pose k + 1
  std::vector<Part> gradient;

  explicit ChainNormals(std::size_t poses)
      : own(poses, Block::Zero()),
        from(poses > 0 ? poses - 1 : 0, Block::Zero()),
        to(from),
        coupling(from),
        gradient(poses, Part::Zero()) {}

  Block diagonal(std::size_t k) const {
    Block sum = own[k];
    if (k < from.size()) sum += from[k];
    if (k > 0) sum += to[k - 1];
    return sum;
  }
};

template <int size>
struct ChainCovariance {
  using Block = typename ChainNormals<size>::Block;
  std::vector<Block> diagonal, coupling;  // P_k and P_k,k+1
  std::vector<bool> determined;
};

/// True if the information is regular, given the rounding errors of the `terms` it is computed
/// from.
template <class Block>
bool well_determined(const Block& information, const Block& terms) {
  constexpr double rounding = 1e-12;  // accumulated over many poses
  if (!information.allFinite() || !(terms.diagonal().array() > 0).all()) return false;
  const auto unit = terms.diagonal().cwiseSqrt().cwiseInverse().eval();
  const Block scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const auto eigen = core::symmetric_eigen<Block>(scaled, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > rounding;
}

/// Solves (H + damping diag H) delta = -g; false if the matrix is not positive definite.
template <int size>
bool solve(const ChainNormals<size>& normals, double damping,
           std::vector<typename ChainNormals<size>::Part>& delta) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.own.size();
  double largest = 0;
  for (std::size_t k = 0; k < count; ++k)
    largest = std::max(largest, normals.diagonal(k).diagonal().maxCoeff());
  std::vector<Block> back(count, Block::Zero());
  delta.resize(count);
  Block taken = Block::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    Block pivot = normals.diagonal(k);
    for (int i = 0; i < size; ++i)  // the minimum keeps undetermined components where they are
      pivot(i, i) += damping * std::max(pivot(i, i), 1e-9 * largest);
    pivot -= taken;
    const core::Cholesky<Block> cholesky(pivot);
    if (!cholesky.exists()) return false;
    delta[k] = -normals.gradient[k];
    if (k > 0) delta[k] -= normals.coupling[k - 1].transpose() * delta[k - 1];
    delta[k] = cholesky.solve(delta[k]);
    if (k + 1 < count) {
      const Block half = cholesky.solve_lower(normals.coupling[k]);
      taken.noalias() = half.transpose() * half;
      back[k] = cholesky.solve(normals.coupling[k]);
    }
  }
  for (std::size_t k = count; k-- > 1;) delta[k - 1] -= back[k - 1] * delta[k];
  for (const auto& part : delta)
    if (!part.allFinite()) return false;
  return true;
}

/// Information of a link at one end after eliminating the pose at its other end, whose information
/// from elsewhere is `known`; zero if that pose is not determined.
template <class Block>
Block message(const Block& known, const Block& there, const Block& here, const Block& coupling) {
  const Block pivot = known + there;
  if (!well_determined(pivot, pivot)) return Block::Zero();
  const core::Cholesky<Block> cholesky(pivot);
  if (!cholesky.exists()) return Block::Zero();
  const Block half = cholesky.solve_lower(coupling);
  return here - half.transpose() * half;
}

/// Information about each pose from the earlier poses, M_k, and from the later ones, M'_k.
template <int size>
struct ChainMessages {
  std::vector<typename ChainNormals<size>::Block> before, behind;
};

/// `linked[k]`: true if a link joins poses k and k + 1.
template <int size>
ChainMessages<size> messages(const ChainNormals<size>& normals, const std::vector<bool>& linked) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.own.size();
  ChainMessages<size> out;
  out.before.assign(count, Block::Zero());
  out.behind = out.before;
  for (std::size_t k = 0; k + 1 < count; ++k)
    if (linked[k])
      out.before[k + 1] = message<Block>(normals.own[k] + out.before[k], normals.from[k],
                                         normals.to[k], normals.coupling[k]);
  for (std::size_t k = count; k-- > 1;)
    if (linked[k - 1])
      out.behind[k - 1] = message<Block>(normals.own[k] + out.behind[k], normals.to[k - 1],
                                         normals.from[k - 1], normals.coupling[k - 1].transpose());
  return out;
}

/// Blocks of H^-1.
template <int size>
ChainCovariance<size> covariance(const ChainNormals<size>& normals,
                                 const std::vector<bool>& linked) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.own.size();
  const auto [before, behind] = messages(normals, linked);
  ChainCovariance<size> out;
  out.diagonal.assign(count, Block::Zero());
  out.coupling.assign(normals.from.size(), Block::Zero());
  out.determined.assign(count, false);
  for (std::size_t k = 0; k < count; ++k) {
    const Block information = normals.own[k] + before[k] + behind[k];
    out.determined[k] = well_determined<Block>(information, normals.diagonal(k));
    if (out.determined[k]) {
      out.diagonal[k] = core::solve_llt<Block, Block>(information, Block::Identity());
      out.diagonal[k] = (0.5 * (out.diagonal[k] + out.diagonal[k].transpose())).eval();
    }
  }
  for (std::size_t k = 0; k + 1 < count; ++k) {
    if (!linked[k] || !out.determined[k] || !out.determined[k + 1]) continue;
    const Block pivot = normals.own[k] + before[k] + normals.from[k];
    out.coupling[k] = -core::solve_llt(pivot, normals.coupling[k]) * out.diagonal[k + 1];
  }
  return out;
}

/// Covariance of each pose with common errors, see common_errors.hpp; `independent` is that of
/// covariance(). The gradient at a pose and that which reaches it from others add up as the
/// information does.
template <int size>
std::vector<typename ChainNormals<size>::Block> with_common_errors(
    const ChainNormals<size>& normals, const std::vector<bool>& linked,
    const std::vector<CommonErrors<size>>& errors, const ChainCovariance<size>& independent) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.own.size();
  std::map<int, Eigen::Index> columns;
  for (const auto& some : errors)
    for (const int number : some.numbers)
      columns.emplace(number, static_cast<Eigen::Index>(columns.size()));
  struct Gradient {
    Eigen::Matrix<double, size, Eigen::Dynamic> by_errors;
    Block counted;
    Gradient& operator+=(const Gradient& other) {
      by_errors += other.by_errors;
      counted += other.counted;
      return *this;
    }
  };
  const auto own = [&](std::size_t k) {
    Gradient out{Eigen::MatrixXd::Zero(size, static_cast<Eigen::Index>(columns.size())),
                 errors[k].counted};
    for (std::size_t j = 0; j < errors[k].numbers.size(); ++j)
      out.by_errors.col(columns.at(errors[k].numbers[j])) +=
          errors[k].columns.col(static_cast<Eigen::Index>(j));
    return out;
  };
  // The gradient that reaches a pose if that at the other end of a link is eliminated.
  const auto carried = [](const Gradient& there, const Block& pivot, const Block& coupling) {
    Gradient out{Eigen::MatrixXd::Zero(size, there.by_errors.cols()), Block::Zero()};
    if (!well_determined(pivot, pivot)) return out;
    const Block carry = -core::solve_llt(pivot, coupling).transpose();
    out.by_errors = carry * there.by_errors;
    out.counted = carry * there.counted * carry.transpose();
    return out;
  };
  const auto [before, behind] = messages(normals, linked);
  std::vector<Gradient> sums;
  for (std::size_t k = 0; k < count; ++k) {
    sums.push_back(own(k));
    if (k > 0 && linked[k - 1])
      sums[k] += carried(sums[k - 1], normals.own[k - 1] + before[k - 1] + normals.from[k - 1],
                         normals.coupling[k - 1]);
  }
  std::vector<Block> out(count, Block::Zero());
  Gradient later = own(count - 1);  // of pose k and all after it
  for (std::size_t k = count; k-- > 0;) {
    if (k + 1 < count) {
      Gradient next{Eigen::MatrixXd::Zero(size, later.by_errors.cols()), Block::Zero()};
      if (linked[k])
        next = carried(later, normals.own[k + 1] + behind[k + 1] + normals.to[k],
                       normals.coupling[k].transpose());
      sums[k] += next;
      later = own(k);
      later += next;
    }
    if (!independent.determined[k]) continue;
    const Block& p = independent.diagonal[k];
    const Eigen::Matrix<double, size, Eigen::Dynamic> shifts = p * sums[k].by_errors;
    const Block sum = p + shifts * shifts.transpose() - p * sums[k].counted * p;
    out[k] = 0.5 * (sum + sum.transpose());
  }
  return out;
}

}  // namespace occ::internal::smooth
