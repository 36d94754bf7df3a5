// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/datum_directions.hpp"

#include <algorithm>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// All points and corners that are unknown and determined by enough observations.
std::vector<Target> unknown_targets(const Network& network, const NetworkLayout& layout) {
  std::vector<Target> targets;
  for (std::size_t i = 0; i < network.points.size(); ++i)
    if (layout.points[i] != none) targets.push_back(Target::of_point(static_cast<int>(i)));
  for (std::size_t i = 0; i < network.bodies.size(); ++i) {
    if (layout.bodies[i] == none) continue;
    for (int k = 0; k < network.bodies[i].corners_m.cols(); ++k)
      targets.push_back(Target::of_corner(static_cast<int>(i), k));
  }
  return targets;
}

/// Three targets far apart: the farthest from the centroid, the farthest from the first, and the
/// farthest from the line through both.
std::vector<Target> distant_targets(const Network& network, const std::vector<Target>& targets) {
  if (targets.size() < 3) return targets;
  std::vector<Vector3d> positions;
  Vector3d middle = Vector3d::Zero();
  for (const Target& target : targets) {
    positions.push_back(network.position_m(target));
    middle += positions.back() / static_cast<double>(targets.size());
  }
  const auto farthest = [&](const auto& distance) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < positions.size(); ++k)
      if (distance(positions[k]) > distance(positions[best])) best = k;
    return best;
  };
  const std::size_t a = farthest([&](const Vector3d& x) { return (x - middle).squaredNorm(); });
  const std::size_t b =
      farthest([&](const Vector3d& x) { return (x - positions[a]).squaredNorm(); });
  const Vector3d direction = (positions[b] - positions[a]).normalized();
  const std::size_t c = farthest([&](const Vector3d& x) {
    const Vector3d off = x - positions[a];
    return (off - off.dot(direction) * direction).squaredNorm();
  });
  return {targets[a], targets[b], targets[c]};
}

/// Orthonormal basis of the defect's combinations that do not change the scale.
MatrixXd without_scale(const DatumDefect& defect) {
  const Eigen::RowVectorXd scale = defect.directions.row(6);
  if (scale.norm() < 1e-6) return MatrixXd::Identity(scale.size(), scale.size());
  const auto svd = core::jacobi_svd<MatrixXd>(scale, Eigen::ComputeFullV);
  return svd.matrixV().rightCols(scale.size() - 1);
}

/// Inner constraints over some targets, for some combinations of the defect's directions. The
/// rotation of an outline counts with its size as arm.
DatumConditions inner(const Network& network, const NetworkLayout& layout,
                      const std::vector<Target>& targets, const DatumDefect& defect,
                      const MatrixXd& directions) {
  DatumConditions conditions;
  conditions.targets = targets;
  const MatrixXd rotations = core::product(defect.directions.topRows<3>(), directions).transpose();
  for (const Target& target : targets) {
    conditions.rows.push_back(
        core::product(similarity_jacobian(defect, network.position_m(target)), directions)
            .transpose());
    DatumConditions::Rows& outline_rows = conditions.outline_rows.emplace_back();
    if (target.body >= 0 || layout.point_sizes[target.point] == 3) continue;
    const auto& outline = network.points[target.point].outline;
    if (outline) outline_rows = outline->size_m.prod() * rotations;
  }
  return conditions;
}

/// As many coordinates of the targets as the defect, chosen by pivoted QR.
std::optional<DatumConditions> minimal(const Network& network, const std::vector<Target>& targets,
                                       const DatumDefect& defect) {
  MatrixXd columns(3 * static_cast<Index>(targets.size()), defect.total());
  for (std::size_t k = 0; k < targets.size(); ++k)
    columns.middleRows<3>(3 * static_cast<Index>(k)) =
        similarity_jacobian(defect, network.position_m(targets[k]));
  const auto qr = core::pivoted_qr(columns.transpose());
  if (qr.rank() < defect.total()) return std::nullopt;
  DatumConditions conditions;
  conditions.targets = targets;
  conditions.rows.assign(targets.size(), MatrixXd::Zero(defect.total(), 3));
  conditions.outline_rows.resize(targets.size());
  for (Index k = 0; k < defect.total(); ++k) {
    const Index chosen = qr.colsPermutation().indices()[k];
    conditions.rows[chosen / 3](k, chosen % 3) = 1;
  }
  return conditions;
}

}  // namespace

Matrix3Xd similarity_jacobian(const DatumDefect& defect, const Vector3d& position_m) {
  const Vector3d arm = position_m - defect.pivot_m;
  Eigen::Matrix<double, 3, 7> all;
  all << -skew(arm), defect.extent_m * Eigen::Matrix3d::Identity(), arm;
  return core::product(all, defect.directions);
}

MatrixXd datum_null_space(const Network& network, const NetworkLayout& layout,
                          const NetworkState& state, const DatumDefect& defect) {
  MatrixXd columns = MatrixXd::Zero(layout.total, defect.total());
  if (defect.total() == 0) return columns;
  const auto rotation = defect.directions.topRows<3>();
  const auto translation = defect.extent_m * defect.directions.middleRows<3>(3);
  const auto scale = defect.directions.row(6);
  const ScaleCentres centres = scale_centres(network, state);
  for (std::size_t i = 0; i < layout.cameras.size(); ++i) {
    if (layout.cameras[i].offset == none) continue;
    const std::vector<CameraParameter> parameters = state.cameras[i].parameters();
    Index row = layout.cameras[i].offset;
    for (const auto& [k, tied] : layout.cameras[i].columns) {
      const bool compensated = centres.height_compensated[i] && parameters[k].name == height_name;
      if (parameters[k].is_length && !compensated) columns.row(row) = parameters[k].value * scale;
      ++row;
    }
  }
  for (std::size_t i = 0; i < layout.mounts.size(); ++i)
    if (layout.mounts[i] != none)
      columns.middleRows<3>(layout.mounts[i] + 3) =
          (state.mounts[i].translation - centres.mount[i]) * scale;
  for (std::size_t i = 0; i < layout.stations.size(); ++i) {
    if (layout.stations[i] == none) continue;
    const Rigid3& pose = state.stations[i];
    const Vector3d middle = pose * defect.pivot_m;
    const Matrix3Xd rotated = pose.rotation * rotation;
    columns.middleRows<3>(layout.stations[i]) = -rotated;
    columns.middleRows<3>(layout.stations[i] + 3) = (middle - centres.station[i]) * scale -
                                                    skew(middle) * rotated -
                                                    pose.rotation * translation;
  }
  for (std::size_t i = 0; i < layout.points.size(); ++i)
    if (layout.points[i] != none) {
      const Index offset = layout.points[i];
      columns.middleRows<3>(offset) = similarity_jacobian(defect, state.points[i]);
      if (layout.point_sizes[i] == 3) continue;
      const int rotations = rotations_of(state.outlines[i]);
      columns.middleRows(offset + 3, rotations) =
          rotation_axes(state.outlines[i]).transpose() * rotation;
      for (int k = 3 + rotations; k < layout.point_sizes[i]; ++k) columns.row(offset + k) = scale;
    }
  for (std::size_t i = 0; i < layout.bodies.size(); ++i) {
    const Index offset = layout.bodies[i];
    if (offset == none) continue;
    columns.middleRows<3>(offset) = rotation;
    columns.middleRows<3>(offset + 3) = similarity_jacobian(defect, state.bodies[i].translation);
    if (layout.body_sizes[i] == 7) columns.row(offset + 6) = scale;
  }
  return columns;
}

void add_outlines(const DatumConditions& conditions, const Network& network,
                  const DatumDefect& defect, MatrixXd& sum) {
  for (std::size_t k = 0; k < conditions.targets.size(); ++k) {
    const DatumConditions::Rows& rows = conditions.outline_rows[k];
    if (rows.rows() == 0) continue;
    const Matrix3Xd axes = rotation_axes(*network.points[conditions.targets[k].point].outline);
    sum.topRows(rows.rows()) += core::product(
        core::product(rows, axes), core::product(axes.transpose(), defect.directions.topRows<3>()));
  }
}

std::optional<DatumConditions> datum_conditions(const Network& network, const NetworkLayout& layout,
                                                const Datum& datum, const DatumDefect& defect) {
  const MatrixXd all = MatrixXd::Identity(defect.total(), defect.total());
  if (defect.total() == 0) return DatumConditions{};
  std::vector<Target> targets;
  for (const Target& target : datum.targets)
    if (layout.is_determined(target)) targets.push_back(target);
  const std::vector<Target> all_targets = unknown_targets(network, layout);
  switch (datum.kind) {
    case DatumKind::control:
      return std::nullopt;
    case DatumKind::minimal:
      if (datum.targets.empty()) targets = distant_targets(network, all_targets);
      if (targets.size() < 3) return std::nullopt;
      return minimal(network, targets, defect);
    case DatumKind::scale_only: {
      if (datum.targets.empty()) targets = distant_targets(network, all_targets);
      if (targets.size() < 2) return std::nullopt;
      const MatrixXd unscaled = without_scale(defect);
      DatumConditions conditions = inner(network, layout, all_targets, defect, unscaled);
      if (unscaled.cols() < defect.total()) conditions.distance = {targets[0], targets[1]};
      return conditions;
    }
    case DatumKind::inner:
      break;
  }
  if (datum.targets.empty()) targets = all_targets;
  if (targets.empty()) return std::nullopt;
  DatumConditions conditions = inner(network, layout, targets, defect, all);
  MatrixXd normal = MatrixXd::Zero(defect.total(), defect.total());
  for (const auto& rows : conditions.rows) normal += core::product_transposed(rows, rows);
  add_outlines(conditions, network, defect, normal);
  const auto svd = core::jacobi_svd<MatrixXd>(normal);
  const auto& singular_values = svd.singularValues();
  if (!(singular_values.minCoeff() > 1e-12 * singular_values.maxCoeff())) return std::nullopt;
  return conditions;
}

MatrixXd condition_matrix(const DatumConditions& conditions, const Network& network,
                          const NetworkLayout& layout, const NetworkState& state) {
  const Index count = conditions.rows.empty() ? 0 : conditions.rows[0].rows();
  MatrixXd all = MatrixXd::Zero(layout.total, count + (conditions.distance.empty() ? 0 : 1));
  const auto add = [&](const Target& target, Index first, const MatrixXd& rows) {
    const Index offset = layout.offset_of(target);
    if (offset == none) return;
    all.block(offset, first, layout.size_of(target), rows.rows()) +=
        (rows * target_jacobian(network, layout, state, target)).transpose();
  };
  for (std::size_t k = 0; k < conditions.targets.size(); ++k) {
    const Target& target = conditions.targets[k];
    add(target, 0, conditions.rows[k]);
    if (conditions.outline_rows[k].rows() == 0) continue;
    const Matrix3Xd axes = rotation_axes(state.outlines[target.point]);
    all.block(layout.offset_of(target) + 3, 0, axes.cols(), count) =
        (conditions.outline_rows[k] * axes).transpose();
  }
  if (!conditions.distance.empty()) {
    const Target &from = conditions.distance[0], &to = conditions.distance[1];
    const Eigen::RowVector3d along =
        (target_position(network, state, to) - target_position(network, state, from))
            .normalized()
            .transpose();
    add(from, count, -along);
    add(to, count, along);
  }
  return all;
}

}  // namespace occ::internal::network
