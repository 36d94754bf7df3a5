// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/residual_cofactors.hpp"

#include <algorithm>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/parallel.hpp"
#include "libocc/network/internal/outline_rows.hpp"

namespace occ::internal::network {

namespace {

using Eigen::MatrixXd;

MatrixXd block_in(const Batch& batch, const MatrixXd& covariance) {
  if (batch.rows.empty()) return covariance;
  const Index n = static_cast<Index>(batch.rows.size());
  MatrixXd block(n, n);
  for (Index c = 0; c < n; ++c)
    for (Index r = 0; r < n; ++r) block(r, c) = covariance(batch.rows[r], batch.rows[c]);
  return block;
}

MatrixXd inverse_of(const SmallMatrix& lower) {
  MatrixXd inverse = MatrixXd::Identity(lower.rows(), lower.rows());
  core::solve_lower_in_place(lower, inverse);
  return inverse;
}

/// Covariance L^-T (I + W^T Q W) L^-1 of a group's unknowns; `qw`: Q W, `inverse`: L^-1.
MatrixXd covariance_of_group(const Eigen::Ref<const MatrixXd>& w,
                             const Eigen::Ref<const MatrixXd>& qw, const MatrixXd& inverse) {
  MatrixXd inner = core::transposed_product(w, qw);
  inner.diagonal().array() += 1;
  return core::product(core::transposed_product(inverse, inner), inverse);
}

/// Rows of an observation over the reduced unknowns that they involve.
struct ReducedRows {
  std::vector<Index> unknowns;
  Eigen::Matrix<double, 2, Eigen::Dynamic> values;

  ReducedRows(const NetworkLayout& layout, const ImageObservation& observation,
              const ObservationRows& rows, bool with_target) {
    const ImageBlock& block = layout.images[observation.image];
    const int width = block.width + (with_target ? rows.size : 0);
    values.resize(2, width);
    for (int s = 0; s < block.segments; ++s)
      for (int k = 0; k < block.size[s]; ++k) unknowns.push_back(block.offset[s] + k);
    for (int k = 0; k < block.width; ++k) values.col(k) << rows.a[0][k], rows.a[1][k];
    for (int k = block.width; k < width; ++k) {
      unknowns.push_back(layout.offset_of(observation.target) + k - block.width);
      values.col(k) << rows.b[0][k - block.width], rows.b[1][k - block.width];
    }
  }

  /// J Q J^T.
  Eigen::Matrix2d quadratic(const MatrixXd& covariance) const {
    const Index n = values.cols();
    MatrixXd block(n, n);
    for (Index c = 0; c < n; ++c)
      for (Index r = 0; r < n; ++r) block(r, c) = covariance(unknowns[r], unknowns[c]);
    return core::product_transposed(core::product(values, block), values);
  }
};

}  // namespace

std::vector<ResidualCofactor> residual_cofactors(const Network& network,
                                                 const NetworkLayout& layout,
                                                 const NetworkState& state,
                                                 const NormalEquations& normal,
                                                 const MatrixXd& covariance, int threads) {
  std::vector<ResidualCofactor> cofactors(network.observations.size());
  const auto store = [&](int index, const ObservationRows& rows, const Eigen::Matrix2d& absorbed) {
    ResidualCofactor& result = cofactors[index];
    result.used = true;
    result.residual << rows.r[0], rows.r[1];
    result.absorbed = 0.5 * (absorbed + absorbed.transpose());
  };
  const auto eliminated = [&](std::size_t b) {
    const Batch& batch = layout.batches[b];
    const EliminatedBatch& part = normal.batches[b];
    const MatrixXd own = block_in(batch, covariance);
    const MatrixXd product = core::product(own, part.w);
    Index column = 0;
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      const Group& group = layout.groups[g];
      const auto w = part.w.middleCols(column, group.size);
      const auto qw = product.middleCols(column, group.size);
      const MatrixXd inverse = inverse_of(part.factors[g - batch.first]);
      const MatrixXd of_group = covariance_of_group(w, qw, inverse);
      // Covariance of the reduced unknowns with the group's.
      const MatrixXd mixed = -core::product(qw, inverse);
      for (const int i : group.observations) {
        const ImageObservation& observation = network.observations[i];
        ObservationRows rows;
        if (!rows_of(network, layout, state, observation, rows)) continue;
        outline_rows(network, layout, state, i, rows);  // completes the rows of a centre
        const ReducedRows reduced(layout, observation, rows, false);
        Eigen::Matrix<double, 2, Eigen::Dynamic> target(2, group.size);
        for (int k = 0; k < group.size; ++k) target.col(k) << rows.b[0][k], rows.b[1][k];
        MatrixXd at_rows(static_cast<Index>(reduced.unknowns.size()), group.size);
        for (std::size_t k = 0; k < reduced.unknowns.size(); ++k) {
          const Index row =
              batch.rows.empty() ? reduced.unknowns[k] : batch.position[reduced.unknowns[k]];
          at_rows.row(static_cast<Index>(k)) = mixed.row(row);
        }
        const Eigen::Matrix2d cross =
            core::product_transposed(core::product(reduced.values, at_rows), target);
        const Eigen::Matrix2d own_part =
            core::product_transposed(core::product(target, of_group), target);
        store(i, rows, reduced.quadratic(covariance) + cross + cross.transpose() + own_part);
      }
      column += group.size;
    }
  };
  core::for_each_index(layout.batches.size(), eliminated, threads);
  for (const int i : layout.direct) {
    const ImageObservation& observation = network.observations[i];
    ObservationRows rows;
    if (!rows_of(network, layout, state, observation, rows)) continue;
    outline_rows(network, layout, state, i, rows);  // completes the rows of a centre
    store(i, rows, ReducedRows(layout, observation, rows, true).quadratic(covariance));
  }
  return cofactors;
}

Eigen::Matrix3d position_cofactor(const Network& network, const NetworkLayout& layout,
                                  const NetworkState& state, const NormalEquations& normal,
                                  const MatrixXd& covariance, const Target& target) {
  const Index offset = layout.offset_of(target);
  if (offset == none) return Eigen::Matrix3d::Zero();
  const int size = layout.size_of(target);
  MatrixXd own;
  if (offset < layout.reduced) {
    own = covariance.block(offset, offset, size, size);
  } else {
    for (std::size_t b = 0; b < layout.batches.size(); ++b) {
      const Batch& batch = layout.batches[b];
      Index column = 0;
      for (std::size_t g = batch.first; g < batch.last; ++g) {
        const Group& group = layout.groups[g];
        if (group.offset == offset) {
          const MatrixXd w = normal.batches[b].w.middleCols(column, group.size);
          const MatrixXd qw = core::product(block_in(batch, covariance), w);
          own = covariance_of_group(w, qw, inverse_of(normal.batches[b].factors[g - batch.first]));
        }
        column += group.size;
      }
    }
  }
  const MatrixXd jacobian = target_jacobian(network, layout, state, target);
  return core::product_transposed(core::product(jacobian, own), jacobian);
}

DistanceCofactor distance_cofactor(const Network& network, const NetworkLayout& layout,
                                   const NetworkState& state,
                                   const DistanceObservation& observation,
                                   const MatrixXd& covariance) {
  DistanceCofactor result;
  const Eigen::Vector3d difference = target_position(network, state, observation.to) -
                                     target_position(network, state, observation.from);
  result.used = observation.used && layout.is_determined(observation.from) &&
                layout.is_determined(observation.to) && difference.norm() > 0;
  if (!result.used) return result;
  result.residual = (difference.norm() - observation.length_m) / observation.sigma_m;
  Eigen::VectorXd row = Eigen::VectorXd::Zero(layout.reduced);
  const auto add = [&](const Target& target, double sign) {
    if (layout.offset_of(target) == none) return;
    row.segment(layout.offset_of(target), layout.size_of(target)) +=
        sign / observation.sigma_m *
        (difference.normalized().transpose() * target_jacobian(network, layout, state, target))
            .transpose();
  };
  add(observation.from, -1);
  add(observation.to, 1);
  result.redundancy = std::clamp(1 - row.dot(covariance * row), 0.0, 1.0);
  return result;
}

}  // namespace occ::internal::network
