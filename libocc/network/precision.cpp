// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/precision.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/parallel.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/network/internal/minimise_network.hpp"
#include "libocc/network/internal/network_checks.hpp"
#include "libocc/network/internal/precision_state.hpp"

namespace occ {

using namespace internal::network;
namespace core = internal::core;

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;

namespace {

/// The 3x3 diagonal blocks of the points without outlines of one batch, in the free datum.
void add_points(const FreePrecision& free, std::size_t number, std::vector<Matrix3d>& all) {
  const Batch& batch = free.layout.batches[number];
  const EliminatedBatch& part = free.batches[number];
  MatrixXd product;
  if (free.layout.reduced > 0) {
    if (batch.rows.empty()) {
      product = core::product(free.covariance, part.w);
    } else {
      const Index n = static_cast<Index>(batch.rows.size());
      MatrixXd own(n, n);
      for (Index c = 0; c < n; ++c)
        for (Index r = 0; r < n; ++r) own(r, c) = free.covariance(batch.rows[r], batch.rows[c]);
      product = core::product(own, part.w);
    }
  }
  for (std::size_t g = batch.first; g < batch.last; ++g) {
    const Group& group = free.layout.groups[g];
    if (group.block.body >= 0 || group.size > 3) continue;
    const Index column = free.locations[g].column;
    Matrix3d inner = Matrix3d::Identity();
    if (product.size() > 0)
      inner +=
          core::transposed_product(part.w.middleCols<3>(column), product.middleCols<3>(column));
    Matrix3d inverse = Matrix3d::Identity();
    core::solve_lower_in_place(part.factors[g - batch.first], inverse);
    all[group.block.point] = inverse.transpose() * inner * inverse;
  }
}

/// H M H^T - H K^T - K H^T between some rows of H and K (precision_state.hpp) and others.
MatrixXd datum_part(const MatrixXd& h_a, const MatrixXd& k_a, const MatrixXd& m,
                    const MatrixXd& h_b, const MatrixXd& k_b) {
  const MatrixXd left = core::product(h_a, m) - k_a;
  return core::product_transposed(left, h_b) - core::product_transposed(h_a, k_b);
}

void require_index(int index, std::size_t size, const char* name) {
  require(index >= 0 && index < static_cast<int>(size), name, index,
          "an index below " + std::to_string(size));
}

/// As unknown_covariance(), of any size.
MatrixXd unknown_matrix(Index size) {
  MatrixXd unknown = MatrixXd::Zero(size, size);
  unknown.diagonal().setConstant(std::numeric_limits<double>::infinity());
  return unknown;
}

Matrix6 pose_block(const PrecisionState& state, Index offset) {
  if (offset == none) return Matrix6::Zero();
  return state.between(offset, 6, offset, 6);
}

}  // namespace

MatrixXd FreePrecision::times(const MatrixXd& columns) const {
  MatrixXd u = columns.topRows(layout.reduced);
  std::vector<MatrixXd> solved(layout.batches.size());
  for (std::size_t b = 0; b < layout.batches.size(); ++b) {
    const Batch& batch = layout.batches[b];
    MatrixXd& y = solved[b];
    y.resize(batch.columns, columns.cols());
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      const Group& group = layout.groups[g];
      auto own = y.middleRows(locations[g].column, group.size);
      own = columns.middleRows(group.offset, group.size);
      core::solve_lower_in_place(batches[b].factors[g - batch.first], own);
    }
    if (layout.reduced == 0) continue;
    const MatrixXd down = core::product(batches[b].w, y);
    if (batch.rows.empty())
      u -= down;
    else
      for (std::size_t k = 0; k < batch.rows.size(); ++k)
        u.row(batch.rows[k]) -= down.row(static_cast<Index>(k));
  }
  MatrixXd result(layout.total, columns.cols());
  const MatrixXd reduced = core::product(covariance, u);
  result.topRows(layout.reduced) = reduced;
  for (std::size_t b = 0; b < layout.batches.size(); ++b) {
    const Batch& batch = layout.batches[b];
    MatrixXd& y = solved[b];
    if (layout.reduced > 0) y -= core::transposed_product(batches[b].w, rows_in(batch, reduced));
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      const Group& group = layout.groups[g];
      auto own = y.middleRows(locations[g].column, group.size);
      core::solve_lower_transposed_in_place(batches[b].factors[g - batch.first], own);
      result.middleRows(group.offset, group.size) = own;
    }
  }
  return result;
}

std::size_t FreePrecision::group_at(Index offset) const {
  const auto after =
      std::upper_bound(layout.groups.begin(), layout.groups.end(), offset,
                       [](Index value, const Group& group) { return value < group.offset; });
  return static_cast<std::size_t>(after - layout.groups.begin() - 1);
}

MatrixXd FreePrecision::dependence(Index offset, Index size) const {
  MatrixXd rows = MatrixXd::Zero(size, layout.reduced);
  if (offset < layout.reduced) {
    rows.middleCols(offset, size).setIdentity();
    return rows;
  }
  const std::size_t g = group_at(offset);
  const Batch& batch = layout.batches[locations[g].batch];
  const EliminatedBatch& part = batches[locations[g].batch];
  MatrixXd own = -part.w.middleCols(locations[g].column, size).transpose();
  core::solve_lower_transposed_in_place(part.factors[locations[g].within], own);
  if (batch.rows.empty()) return own;
  for (std::size_t k = 0; k < batch.rows.size(); ++k)
    rows.col(batch.rows[k]) = own.col(static_cast<Index>(k));
  return rows;
}

MatrixXd FreePrecision::between(Index a, Index a_size, Index b, Index b_size) const {
  MatrixXd block = core::product_transposed(core::product(dependence(a, a_size), covariance),
                                            dependence(b, b_size));
  if (a == b && a >= layout.reduced) {
    const std::size_t g = group_at(a);
    MatrixXd inverse = MatrixXd::Identity(a_size, a_size);
    core::solve_lower_in_place(batches[locations[g].batch].factors[locations[g].within], inverse);
    block += core::transposed_product(inverse, inverse);
  }
  return block;
}

MatrixXd PrecisionState::between(Index a, Index a_size, Index b, Index b_size) const {
  MatrixXd block = free->between(a, a_size, b, b_size);
  block += datum_part(h.middleRows(a, a_size), qb.middleRows(a, a_size), bqb,
                      h.middleRows(b, b_size), qb.middleRows(b, b_size));
  if (a == b) block = (0.5 * (block + block.transpose())).eval();
  return factor * block;
}

Precision::Precision() {
  auto state = std::make_shared<PrecisionState>();
  state->free = std::make_shared<FreePrecision>(Network{});
  state_ = std::move(state);
}
Precision::~Precision() = default;
Precision::Precision(const Precision&) = default;
Precision::Precision(Precision&&) noexcept = default;
Precision& Precision::operator=(const Precision&) = default;
Precision& Precision::operator=(Precision&&) noexcept = default;

int Precision::defect() const { return state_->free->defect.total(); }
int Precision::unknowns() const { return static_cast<int>(state_->free->layout.total); }

Matrix3d Precision::point(int point) const { return position(Target::of_point(point)); }

MatrixXd Precision::outline(int point) const {
  const FreePrecision& free = *state_->free;
  require_index(point, free.layout.points.size(), "point");
  const auto& outline = free.network.points[point].outline;
  const bool is_left_out = !free.layout.determined_point[point];
  const Index size = outline ? 3 + unknowns_of(*outline) : 3;
  require(outline && (is_left_out || free.layout.point_sizes[point] == size), "point", point,
          "a point with an observed outline");
  if (!is_left_out)
    return state_->between(free.layout.points[point], size, free.layout.points[point], size);
  return unknown_matrix(size);
}

double Precision::outline_growth_sigma_px(int camera) const {
  const FreePrecision& free = *state_->free;
  require_index(camera, free.layout.cameras.size(), "camera");
  const CameraBlock& block = free.layout.cameras[camera];
  if (!block.has_growth) return 0;
  const Index offset = block.offset + block.size() - 1;
  return std::sqrt(std::max(0.0, state_->between(offset, 1, offset, 1)(0, 0)));
}

std::vector<Matrix3d> Precision::points() const {
  const FreePrecision& free = *state_->free;
  const NetworkLayout& layout = free.layout;
  std::vector<Matrix3d> all(layout.points.size(), Matrix3d::Zero());
  core::for_each_index(
      layout.batches.size(), [&](std::size_t b) { add_points(free, b, all); }, free.threads);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Index offset = layout.points[i];
    if (!layout.determined_point[i]) {
      all[i] = unknown_covariance<3>();
    } else if (offset != none && (offset < layout.reduced || layout.point_sizes[i] > 3)) {
      const Index size = layout.point_sizes[i];
      all[i] = state_->between(offset, size, offset, size).topLeftCorner<3, 3>();
    } else if (offset != none) {
      const MatrixXd h = state_->h.middleRows<3>(offset), k = state_->qb.middleRows<3>(offset);
      const Matrix3d block = all[i] + datum_part(h, k, state_->bqb, h, k);
      all[i] = 0.5 * state_->factor * (block + block.transpose());
    }
  }
  return all;
}

Matrix3d Precision::position(const Target& target) const {
  return positions(target, target).topLeftCorner<3, 3>();
}

Matrix6 Precision::positions(const Target& a, const Target& b) const {
  const FreePrecision& free = *state_->free;
  free.network.name_of(a);  // throws for an invalid target
  free.network.name_of(b);
  if (!free.layout.is_determined(a) || !free.layout.is_determined(b))
    return unknown_covariance<6>();
  Matrix6 joint = Matrix6::Zero();
  const Target targets[2] = {a, b};
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const Index from = free.layout.offset_of(targets[i]), to = free.layout.offset_of(targets[j]);
      if (from == none || to == none) continue;
      joint.block<3, 3>(3 * i, 3 * j) =
          target_jacobian(free.network, free.layout, free.state, targets[i]) *
          state_->between(from, free.layout.size_of(targets[i]), to,
                          free.layout.size_of(targets[j])) *
          target_jacobian(free.network, free.layout, free.state, targets[j]).transpose();
    }
  return joint;
}

double Precision::distance_sigma_m(const Target& a, const Target& b) const {
  const FreePrecision& free = *state_->free;
  const Eigen::Vector3d apart = free.network.position_m(b) - free.network.position_m(a);
  if (!free.layout.is_determined(a) || !free.layout.is_determined(b) || apart.norm() == 0)
    return std::numeric_limits<double>::infinity();
  Vector6 gradient;
  gradient << -apart.normalized(), apart.normalized();
  return std::sqrt(std::max(0.0, gradient.dot(positions(a, b) * gradient)));
}

double Precision::scale_sigma() const {
  const FreePrecision& free = *state_->free;
  DatumDefect all = free.defect;
  all.directions = Eigen::Matrix<double, 7, 7>::Identity();
  const auto conditions = datum_conditions(free.network, free.layout, {}, all);
  if (!conditions) return std::numeric_limits<double>::infinity();
  const MatrixXd b = condition_matrix(*conditions, free.network, free.layout, free.state);
  MatrixXd normal = MatrixXd::Zero(7, 7);
  for (const auto& rows : conditions->rows) normal += core::product_transposed(rows, rows);
  add_outlines(*conditions, free.network, all, normal);
  const MatrixXd h = core::transposed_product(b, state_->h);
  const MatrixXd k = core::transposed_product(b, state_->qb);
  const MatrixXd q =
      core::transposed_product(b, free.times(b)) + datum_part(h, k, state_->bqb, h, k);
  const Eigen::VectorXd of_scale = core::inverse(normal).col(6);
  const double variance = of_scale.dot(q * of_scale);
  return std::sqrt(std::max(0.0, state_->factor * variance));
}

Matrix6 Precision::station(int station) const {
  const FreePrecision& free = *state_->free;
  require_index(station, free.layout.stations.size(), "station");
  if (free.layout.stations[station] == none && !free.network.stations[station].fixed)
    return unknown_covariance<6>();
  return pose_block(*state_, free.layout.stations[station]);
}

Matrix6 Precision::mount(int mount) const {
  const FreePrecision& free = *state_->free;
  require_index(mount, free.layout.mounts.size(), "mount");
  if (free.layout.mounts[mount] == none && !free.network.mounts[mount].fixed)
    return unknown_covariance<6>();
  return pose_block(*state_, free.layout.mounts[mount]);
}

Matrix6 Precision::body(int body) const {
  const FreePrecision& free = *state_->free;
  require_index(body, free.layout.bodies.size(), "body");
  if (!free.layout.determined_body[body]) return unknown_covariance<6>();
  Matrix6 about_world = Matrix6::Identity();
  about_world.bottomLeftCorner<3, 3>() = skew(free.state.bodies[body].translation);
  return about_world * pose_block(*state_, free.layout.bodies[body]) * about_world.transpose();
}

Matrix3d Precision::station_position(int station) const {
  const Matrix6 covariance = this->station(station);
  if (!covariance.allFinite()) return unknown_covariance<3>();
  return position_covariance(state_->free->state.stations[station], covariance);
}

double Precision::body_scale_sigma(int body) const {
  const FreePrecision& free = *state_->free;
  require_index(body, free.layout.bodies.size(), "body");
  if (!free.layout.determined_body[body]) return std::numeric_limits<double>::infinity();
  if (free.layout.bodies[body] == none || free.layout.body_sizes[body] < 7) return 0;
  const Index offset = free.layout.bodies[body] + 6;
  const MatrixXd block = state_->between(offset - 6, 7, offset - 6, 7);
  return std::sqrt(std::max(0.0, block(6, 6)));
}

MatrixXd Precision::parameters(int camera) const {
  const FreePrecision& free = *state_->free;
  require_index(camera, free.layout.cameras.size(), "camera");
  const CameraBlock& block = free.layout.cameras[camera];
  const Index size = static_cast<Index>(free.network.cameras[camera].free_parameters.size());
  if (block.offset == none) {
    return unknown_matrix(size);
  }
  return state_->between(block.offset, size, block.offset, size);
}

MatrixXd Precision::parameter_correlation(int camera) const {
  MatrixXd correlation = parameters(camera);
  const Eigen::VectorXd sigma = correlation.diagonal().cwiseSqrt();
  for (Index r = 0; r < correlation.rows(); ++r)
    for (Index c = 0; c < correlation.cols(); ++c) {
      const double product = sigma[r] * sigma[c];
      if (r == c)
        correlation(r, c) = 1;
      else
        correlation(r, c) = product > 0 && std::isfinite(product) ? correlation(r, c) / product : 0;
    }
  return correlation;
}

Result<Precision> Precision::in_datum(const Datum& datum) const {
  const FreePrecision& free = *state_->free;
  check_datum(free.network, datum);
  Result<Precision> result;
  auto state = std::make_shared<PrecisionState>();
  state->free = state_->free;
  state->factor = state_->factor;
  const Index defect = free.defect.total();
  state->h = state->qb = MatrixXd::Zero(free.layout.total, defect);
  state->bqb = MatrixXd::Zero(defect, defect);
  if (defect > 0) {
    const auto conditions = datum_conditions(free.network, free.layout, datum, free.defect);
    MatrixXd b, inverse;
    bool is_determined = conditions.has_value();
    if (conditions) {
      b = condition_matrix(*conditions, free.network, free.layout, free.state);
      const MatrixXd normal = core::transposed_product(b, free.null_space);
      inverse = core::inverse(normal);
      is_determined = 1 / (normal.norm() * inverse.norm()) > 1e-12;
    }
    if (!is_determined) {
      result.status = Status::degenerate;
      result.message = datum.kind == DatumKind::control
                           ? "control points and other observations do not determine the datum"
                           : "the datum's targets do not determine it";
      result.value = *this;
      return result;
    }
    state->h = core::product(free.null_space, inverse);
    state->qb = free.times(b);
    state->bqb = core::transposed_product(b, state->qb);
  }
  result.value.state_ = std::move(state);
  return result;
}

Precision Precision::scaled(double variance_factor) const {
  require(variance_factor >= 0 && std::isfinite(variance_factor), "variance_factor",
          variance_factor, "zero or positive");
  auto state = std::make_shared<PrecisionState>(*state_);
  state->factor *= variance_factor;
  Precision copy(*this);
  copy.state_ = std::move(state);
  return copy;
}

Result<Precision> precision(const Network& network, const Datum& datum, int threads) {
  check_network(network);
  check_datum(network, datum);
  require(threads >= 1, "threads", threads, "at least 1");
  Result<Precision> result;
  auto free = std::make_shared<FreePrecision>(network);
  free->network = without_observations(network);
  free->layout = layout_of(network);
  free->threads = threads;
  const CheckOutcome check = check_solvable(network, free->layout);
  result.status = check.status;
  result.message = check.message;
  if (!result.ok()) return result;

  NormalEquations normal;
  build(network, free->layout, free->state, {}, 0, threads, normal);
  free->defect = defect_at(network, free->state);
  free->null_space = datum_null_space(network, free->layout, free->state, free->defect);
  const ReducedSystem system(normal, free->null_space.topRows(free->layout.reduced));
  if (!system.determined() || !normal.singular_groups.empty()) {
    result.status = Status::degenerate;
    result.message =
        "no observation determines " +
        (system.determined() ? network.name_of(free->layout.groups[normal.singular_groups[0]].block)
                             : names_of_unknowns(network, free->layout, system.undetermined()));
    return result;
  }
  free->covariance = system.covariance();
  free->batches = std::move(normal.batches);
  free->locations.resize(free->layout.groups.size());
  for (std::size_t b = 0; b < free->layout.batches.size(); ++b) {
    Index column = 0;
    const Batch& batch = free->layout.batches[b];
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      free->locations[g] = {b, g - batch.first, column};
      column += free->layout.groups[g].size;
    }
  }
  auto state = std::make_shared<PrecisionState>();
  state->free = free;
  Precision in_free_datum;
  in_free_datum.state_ = state;
  return in_free_datum.in_datum(datum);
}

}  // namespace occ
