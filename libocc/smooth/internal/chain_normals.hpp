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
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"

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

/// Blocks of H^-1. `linked[k]`: true if a link joins poses k and k + 1.
template <int size>
ChainCovariance<size> covariance(const ChainNormals<size>& normals,
                                 const std::vector<bool>& linked) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.own.size();
  ChainCovariance<size> out;
  out.diagonal.assign(count, Block::Zero());
  out.coupling.assign(normals.from.size(), Block::Zero());
  out.determined.assign(count, false);
  std::vector<Block> before(count, Block::Zero()), behind(count, Block::Zero());
  for (std::size_t k = 0; k + 1 < count; ++k)
    if (linked[k])
      before[k + 1] = message<Block>(normals.own[k] + before[k], normals.from[k], normals.to[k],
                                     normals.coupling[k]);
  for (std::size_t k = count; k-- > 0;) {
    const Block information = normals.own[k] + before[k] + behind[k];
    out.determined[k] = well_determined<Block>(information, normals.diagonal(k));
    if (out.determined[k]) {
      out.diagonal[k] = core::solve_llt<Block, Block>(information, Block::Identity());
      out.diagonal[k] = (0.5 * (out.diagonal[k] + out.diagonal[k].transpose())).eval();
    }
    if (k > 0 && linked[k - 1])
      behind[k - 1] = message<Block>(normals.own[k] + behind[k], normals.to[k - 1],
                                     normals.from[k - 1], normals.coupling[k - 1].transpose());
  }
  for (std::size_t k = 0; k + 1 < count; ++k) {
    if (!linked[k] || !out.determined[k] || !out.determined[k + 1]) continue;
    const Block pivot = normals.own[k] + before[k] + normals.from[k];
    out.coupling[k] = -core::solve_llt(pivot, normals.coupling[k]) * out.diagonal[k + 1];
  }
  return out;
}

}  // namespace occ::internal::smooth
