// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <map>

#include "libocc/core/internal/dense.hpp"
#include "libocc/network/internal/precision_state.hpp"

namespace occ {

using namespace internal::network;
namespace core = internal::core;

using Eigen::Index;
using Eigen::MatrixXd;

// With the rows J of a target's Jacobian by its own unknowns, which depend on the reduced unknowns
// by D, the covariance is J D Q D^T J^T, plus J (L L^T)^-1 J^T between targets of one eliminated
// point or body, plus the part of the datum (precision_state.hpp).
MatrixXd Precision::joint(const std::vector<Target>& targets) const {
  const FreePrecision& free = *state_->free;
  const NetworkLayout& layout = free.layout;
  const Index count = 3 * static_cast<Index>(targets.size());
  MatrixXd by_reduced = MatrixXd::Zero(count, layout.reduced);
  MatrixXd h = MatrixXd::Zero(count, state_->h.cols()), k = MatrixXd::Zero(count, h.cols());
  std::map<std::size_t, std::vector<std::pair<Index, MatrixXd>>> of_group;  // rows L^-1 J^T
  std::vector<Index> unknown;
  for (Index i = 0; i < count / 3; ++i) {
    const Target& target = targets[static_cast<std::size_t>(i)];
    free.network.name_of(target);  // throws for an invalid target
    if (!layout.is_determined(target)) {
      unknown.push_back(i);
      continue;
    }
    const Index offset = layout.offset_of(target);
    if (offset == none) continue;  // fixed
    const Index size = layout.size_of(target);
    const MatrixXd jacobian = target_jacobian(free.network, layout, free.state, target);
    by_reduced.middleRows(3 * i, 3) = core::product(jacobian, free.dependence(offset, size));
    h.middleRows(3 * i, 3) = core::product(jacobian, state_->h.middleRows(offset, size));
    k.middleRows(3 * i, 3) = core::product(jacobian, state_->qb.middleRows(offset, size));
    if (offset < layout.reduced) continue;
    const std::size_t group = free.group_at(offset);
    const FreePrecision::GroupLocation& at = free.locations[group];
    MatrixXd solved = jacobian.transpose();
    core::solve_lower_in_place(free.batches[at.batch].factors[at.within], solved);
    of_group[group].push_back({3 * i, std::move(solved)});
  }
  MatrixXd joint = core::product_transposed(core::product(by_reduced, free.covariance), by_reduced);
  for (const auto& [group, members] : of_group)
    for (const auto& [row, a] : members)
      for (const auto& [column, b] : members)
        joint.block(row, column, 3, 3) += core::transposed_product(a, b);
  joint += core::product_transposed(core::product(h, state_->bqb) - k, h) -
           core::product_transposed(h, k);
  joint = (0.5 * state_->factor * (joint + joint.transpose())).eval();
  for (const Index i : unknown)
    joint.diagonal().segment<3>(3 * i).setConstant(std::numeric_limits<double>::infinity());
  return joint;
}

}  // namespace occ
