// SPDX-License-Identifier: Apache-2.0
// Internal: normal equations of a chain, H delta = -g, where only consecutive poses share terms:
// block tridiagonal. With S_0 = A_0,
//     S_k+1 = A_k+1 - B_k^T S_k^-1 B_k     (A: diagonal blocks, B_k couples k and k + 1)
// the solution and the blocks of the inverse follow backwards:
//     P_k = S_k^-1 + U_k P_k+1 U_k^T,  P_k,k+1 = -U_k P_k+1,  U_k = S_k^-1 B_k.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cstddef>
#include <vector>

namespace occ::smoothing {

template <int size>
struct ChainNormals {
  using Block = Eigen::Matrix<double, size, size>;
  using Part = Eigen::Matrix<double, size, 1>;
  std::vector<Block> diagonal, coupling;  // coupling[k]: rows of pose k, columns of pose k + 1
  std::vector<Part> gradient;

  explicit ChainNormals(std::size_t poses)
      : diagonal(poses, Block::Zero()),
        coupling(poses > 0 ? poses - 1 : 0, Block::Zero()),
        gradient(poses, Part::Zero()) {}
};

template <int size>
struct ChainCovariance {
  using Block = typename ChainNormals<size>::Block;
  std::vector<Block> diagonal, coupling;  // P_k and P_k,k+1
  std::vector<bool> determined;
};

/// Whether a pivot still holds information in every direction, beside rounding of what it was
/// before earlier poses were eliminated from it.
template <class Block>
bool well_determined(const Block& pivot, const Block& before) {
  if (!pivot.allFinite() || !(before.diagonal().array() > 0).all()) return false;
  const auto unit = before.diagonal().cwiseSqrt().cwiseInverse().eval();
  const Block scaled = unit.asDiagonal() * pivot * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Block> eigen(scaled, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues()[0] > 1e-13 * eigen.eigenvalues()[Block::RowsAtCompileTime - 1] &&
         eigen.eigenvalues()[0] > 1e-14;
}

/// delta of (H + damping) delta = -g, the damping a part of H's diagonal; nothing when that is not
/// positive definite.
template <int size>
bool solve(const ChainNormals<size>& normals, double damping,
           std::vector<typename ChainNormals<size>::Part>& delta) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.diagonal.size();
  double largest = 0;
  for (const Block& block : normals.diagonal)
    largest = std::max(largest, block.diagonal().maxCoeff());
  std::vector<Block> back(count, Block::Zero());
  delta.resize(count);
  Block taken = Block::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    Block pivot = normals.diagonal[k];
    for (int i = 0; i < size; ++i)  // what nothing tells stays where it is
      pivot(i, i) += damping * std::max(pivot(i, i), 1e-9 * largest);
    pivot -= taken;
    const Eigen::LLT<Block> llt(pivot);
    if (llt.info() != Eigen::Success) return false;
    delta[k] = -normals.gradient[k];
    if (k > 0) delta[k] -= normals.coupling[k - 1].transpose() * delta[k - 1];
    delta[k] = llt.solve(delta[k]).eval();
    if (k + 1 < count) {
      const Block half = llt.matrixL().solve(normals.coupling[k]);
      taken.noalias() = half.transpose() * half;
      back[k] = llt.matrixU().solve(half);
    }
  }
  for (std::size_t k = count; k-- > 1;) delta[k - 1] -= back[k - 1] * delta[k];
  for (const auto& part : delta)
    if (!part.allFinite()) return false;
  return true;
}

/// Blocks of H^-1; `linked[k]`: whether pose k + 1 hangs on pose k. A part whose H is singular is
/// not determined, as a whole.
template <int size>
ChainCovariance<size> covariance(const ChainNormals<size>& normals,
                                 const std::vector<bool>& linked) {
  using Block = typename ChainNormals<size>::Block;
  const std::size_t count = normals.diagonal.size();
  ChainCovariance<size> out;
  out.diagonal.assign(count, Block::Zero());
  out.coupling.assign(count > 0 ? count - 1 : 0, Block::Zero());
  out.determined.assign(count, true);
  std::vector<Block> inverse(count), back(count, Block::Zero());
  bool holds = true;
  Block taken = Block::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    if (k == 0 || !linked[k - 1]) {
      taken.setZero();
      holds = true;
    }
    const Block pivot = normals.diagonal[k] - taken;
    holds = holds && well_determined(pivot, normals.diagonal[k]);
    out.determined[k] = holds;
    if (!holds) continue;
    const Eigen::LLT<Block> llt(pivot);
    inverse[k] = llt.solve(Block::Identity());
    if (k + 1 < count && linked[k]) {
      const Block half = llt.matrixL().solve(normals.coupling[k]);
      taken.noalias() = half.transpose() * half;
      back[k] = llt.matrixU().solve(half);
    }
  }
  for (std::size_t k = count; k-- > 0;) {
    const bool follows = k + 1 < count && linked[k];
    if (follows && !out.determined[k + 1]) out.determined[k] = false;
    if (!out.determined[k]) continue;
    out.diagonal[k] = inverse[k];
    if (!follows) continue;
    out.coupling[k] = -back[k] * out.diagonal[k + 1];
    out.diagonal[k] -= out.coupling[k] * back[k].transpose();
    out.diagonal[k] = (0.5 * (out.diagonal[k] + out.diagonal[k].transpose())).eval();
  }
  return out;
}

}  // namespace occ::smoothing
