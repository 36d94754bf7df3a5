// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/normal_equations.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/parallel.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/internal/outline_rows.hpp"

namespace occ::internal::network {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Number of partial sums. It follows from the network alone, so that the number of threads does
/// not change the order of additions. A partial sum of n x n should hold at least four batches, and
/// all of them together at most 256 MB.
std::size_t lanes_of(const NetworkLayout& layout) {
  constexpr double max_elements = 32e6;
  const double n = static_cast<double>(std::max<Index>(layout.reduced, 1));
  const double by_work = static_cast<double>(layout.batches.size()) / 4;
  return static_cast<std::size_t>(std::clamp(std::min(by_work, max_elements / (n * n)), 2.0, 8.0));
}

/// One partial sum. The image parts of S are summed for each image, where the image's unknowns are
/// contiguous, and added to S at the end.
struct Lane {
  double cost = 0;
  int out_of_view = 0;
  MatrixXd reduced;
  VectorXd rhs, diagonal;
  std::vector<MatrixXd> of_image;  ///< lower triangles, stored transposed
  std::vector<VectorXd> rhs_of_image;
  std::vector<std::size_t> singular_groups;
};

/// Multiplies r and the rows by the square root of the robust weight, which is returned.
double apply_weight(const Loss& loss, ObservationRows& rows, Lane& lane) {
  const double squared = rows.r[0] * rows.r[0] + rows.r[1] * rows.r[1];
  lane.cost += loss.rho(squared);
  const double root = std::sqrt(loss.weight(squared));
  if (root == 1) return root;
  for (int k = 0; k < 2; ++k) {
    rows.r[k] *= root;
    for (int i = 0; i < rows.width; ++i) rows.a[k][i] *= root;
    for (int i = 0; i < rows.size; ++i) rows.b[k][i] *= root;
  }
  return root;
}

void add_image_part(const ObservationRows& rows, MatrixXd& sum, VectorXd& rhs) {
  const double *a0 = rows.a[0], *a1 = rows.a[1];
  double* column = sum.data();
  for (int i = 0; i < rows.width; ++i, column += rows.width) {
    const double f0 = a0[i], f1 = a1[i];
    for (int j = 0; j <= i; ++j) column[j] += f0 * a0[j] + f1 * a1[j];
    rhs[i] -= f0 * rows.r[0] + f1 * rows.r[1];
  }
}

void place_image_parts(const NetworkLayout& layout, Lane& lane) {
  for (std::size_t image = 0; image < layout.images.size(); ++image) {
    const ImageBlock& block = layout.images[image];
    const MatrixXd& sum = lane.of_image[image];
    int row_start = 0;
    for (int s = 0; s < block.segments; row_start += block.size[s++])
      for (int i = 0; i < block.size[s]; ++i) {
        const Index row = block.offset[s] + i;
        lane.rhs[row] += lane.rhs_of_image[image][row_start + i];
        lane.diagonal[row] += sum(row_start + i, row_start + i);
        int column_start = 0;  // segments are sorted by offset
        for (int t = 0; t <= s; column_start += block.size[t++])
          for (int j = 0; j < block.size[t] && column_start + j <= row_start + i; ++j)
            lane.reduced(row, block.offset[t] + j) += sum(column_start + j, row_start + i);
      }
  }
}

/// Loss of distances and control points: Huber's with the stated sigmas whenever the images have a
/// loss. Tukey's could give all of them no weight, and the datum would be undetermined.
Loss known_loss_of(const Loss& loss) {
  return loss.kind == Loss::Kind::squared ? Loss{} : Loss{Loss::Kind::huber, 1};
}

/// Cholesky factor L of V = L L^T in place. A singular direction gets a huge pivot and thus no
/// step; the result is then false. `before`: diagonal without damping.
bool factorise(SmallMatrix& v, const Eigen::Ref<const VectorXd>& before) {
  bool regular = true;
  const Index n = v.rows();
  for (Index c = 0; c < n; ++c) {
    double pivot = v(c, c);
    for (Index k = 0; k < c; ++k) pivot -= v(c, k) * v(c, k);
    if (!(pivot > 1e-14 * before[c])) {
      regular = false;
      pivot = 1e280;
    }
    const double root = std::sqrt(pivot);
    v(c, c) = root;
    for (Index r = c + 1; r < n; ++r) {
      double sum = v(r, c);
      for (Index k = 0; k < c; ++k) sum -= v(r, k) * v(c, k);
      v(r, c) = sum / root;
    }
  }
  return regular;
}

class Builder {
 public:
  Builder(const Network& network, const NetworkLayout& layout, const NetworkState& state,
          const Loss& loss, double damping, std::size_t lanes, NormalEquations& normal)
      : network_(network),
        layout_(layout),
        state_(state),
        loss_(loss),
        known_loss_(known_loss_of(loss)),
        damping_(damping),
        lanes_(lanes),
        normal_(normal) {
    control_of_group_.resize(layout.groups.size());
    for (std::size_t i = 0; i < network.control.size(); ++i) {
      const Target& target = network.control[i].target;
      if (!network.control[i].used || !layout.is_determined(target)) continue;
      const Index offset = layout.offset_of(target);
      if (offset >= layout.reduced)
        control_of_group_[group_at(offset)].push_back(i);
      else
        control_of_reduced_.push_back(i);
    }
  }

  void run(std::size_t number, Lane& lane) {
    const Index n = layout_.reduced;
    lane.reduced = MatrixXd::Zero(n, n);
    lane.rhs = lane.diagonal = VectorXd::Zero(n);
    lane.of_image.resize(layout_.images.size());
    lane.rhs_of_image.resize(layout_.images.size());
    for (std::size_t i = 0; i < layout_.images.size(); ++i) {
      lane.of_image[i] = MatrixXd::Zero(layout_.images[i].width, layout_.images[i].width);
      lane.rhs_of_image[i] = VectorXd::Zero(layout_.images[i].width);
    }
    for (std::size_t b = number; b < layout_.batches.size(); b += lanes_) add_batch(b, lane);
    for (std::size_t k = number; k < layout_.direct.size(); k += lanes_)
      add_direct(layout_.direct[k], lane);
    place_image_parts(layout_, lane);
    if (number == 0) add_other_observations(lane);
  }

 private:
  std::size_t group_at(Index offset) const {
    const auto after =
        std::upper_bound(layout_.groups.begin(), layout_.groups.end(), offset,
                         [](Index value, const Group& group) { return value < group.offset; });
    return after - layout_.groups.begin() - 1;
  }

  void add_out_of_view(Lane& lane) const {
    ++lane.out_of_view;
    lane.cost += loss_.rho(out_of_view_residual * out_of_view_residual);
  }

  void add_batch(std::size_t number, Lane& lane) {
    const Batch& batch = layout_.batches[number];
    EliminatedBatch& out = normal_.batches[number];
    const Index rows = batch.rows.empty() ? layout_.reduced : static_cast<Index>(batch.rows.size());
    out.w.setZero(rows, batch.columns);
    out.y.setZero(batch.columns);
    out.factors.resize(batch.last - batch.first);
    Index column = 0;
    for (std::size_t g = batch.first; g < batch.last; ++g) {
      add_group(g, batch, column, out, lane);
      column += layout_.groups[g].size;
    }
    subtract_from_reduced(batch, out, lane);
  }

  void add_group(std::size_t number, const Batch& batch, Index column, EliminatedBatch& out,
                 Lane& lane) {
    const Group& group = layout_.groups[number];
    SmallMatrix& v = out.factors[number - batch.first];
    v.setZero(group.size, group.size);
    auto y = out.y.segment(column, group.size);
    for (const int i : group.observations) {
      const ImageObservation& observation = network_.observations[i];
      ObservationRows rows;
      if (!rows_of(network_, layout_, state_, observation, rows)) {
        add_out_of_view(lane);
        continue;
      }
      auto outline = outline_rows(network_, layout_, state_, i, rows);
      const double root = apply_weight(loss_, rows, lane);
      const int image = observation.image;
      add_image_part(rows, lane.of_image[image], lane.rhs_of_image[image]);
      if (outline) add_outline(*outline, image, root, batch, column, v, y, out, lane);
      for (Index c = 0; c < group.size; ++c) {
        const double b0 = rows.b[0][c], b1 = rows.b[1][c];
        y[c] -= b0 * rows.r[0] + b1 * rows.r[1];
        for (Index k = c; k < group.size; ++k) v(k, c) += b0 * rows.b[0][k] + b1 * rows.b[1][k];
        add_mixed(batch, layout_.images[image], rows, b0, b1, out.w.col(column + c).data());
      }
    }
    for (const std::size_t i : control_of_group_[number]) add_control(i, v, y, lane);

    const VectorXd before = v.diagonal();
    v.diagonal() *= 1 + damping_;
    if (!factorise(v, before)) lane.singular_groups.push_back(number);
    for (Index c = 0; c < group.size; ++c) {
      auto own = out.w.col(column + c);
      for (Index k = 0; k < c; ++k) {
        own -= v(c, k) * out.w.col(column + k);
        y[c] -= v(c, k) * y[k];
      }
      own /= v(c, c);
      y[c] /= v(c, c);
    }
  }

  /// Multiplies the rows of an outline by the square root of the robust weight of its centre, and
  /// adds the part of its image.
  static void add_weighted(int image, double root, OutlineRows& rows, Lane& lane) {
    rows.r *= root;
    rows.a *= root;
    rows.b *= root;
    lane.cost += 0.5 * rows.r.squaredNorm();
    lane.of_image[image].triangularView<Eigen::Upper>() += core::transposed_product(rows.a, rows.a);
    lane.rhs_of_image[image] -= rows.a.transpose() * rows.r;
  }

  template <typename Vector>
  void add_outline(OutlineRows& rows, int image, double root, const Batch& batch, Index column,
                   SmallMatrix& v, Vector& y, EliminatedBatch& out, Lane& lane) const {
    add_weighted(image, root, rows, lane);
    y -= rows.b.transpose() * rows.r;
    v += core::transposed_product(rows.b, rows.b);
    const ImageBlock& block = layout_.images[image];
    const MatrixXd mixed = core::transposed_product(rows.a, rows.b);
    int first = 0;
    for (int s = 0; s < block.segments; first += block.size[s++]) {
      const Index start = batch.rows.empty() ? block.offset[s] : batch.position[block.offset[s]];
      out.w.block(start, column, block.size[s], mixed.cols()) +=
          mixed.middleRows(first, block.size[s]);
    }
  }

  /// Adds the outline of a point that belongs to the reduced unknowns.
  void add_direct_outline(OutlineRows& rows, int image, double root, Index offset,
                          Lane& lane) const {
    add_weighted(image, root, rows, lane);
    const MatrixXd own = core::transposed_product(rows.b, rows.b);
    lane.rhs.segment(offset, own.rows()) -= rows.b.transpose() * rows.r;
    lane.diagonal.segment(offset, own.rows()) += own.diagonal();
    lane.reduced.block(offset, offset, own.rows(), own.cols()) += own;
    const ImageBlock& block = layout_.images[image];
    const MatrixXd mixed = core::transposed_product(rows.b, rows.a);
    int first = 0;
    for (int s = 0; s < block.segments; first += block.size[s++])
      lane.reduced.block(offset, block.offset[s], own.rows(), block.size[s]) +=
          mixed.middleCols(first, block.size[s]);
  }

  void add_mixed(const Batch& batch, const ImageBlock& block, const ObservationRows& rows,
                 double b0, double b1, double* column) const {
    const double *a0 = rows.a[0], *a1 = rows.a[1];
    for (int s = 0; s < block.segments; ++s) {
      const Index start = batch.rows.empty() ? block.offset[s] : batch.position[block.offset[s]];
      double* e = column + start;
      for (int k = 0; k < block.size[s]; ++k) e[k] += a0[k] * b0 + a1[k] * b1;
      a0 += block.size[s];
      a1 += block.size[s];
    }
  }

  void subtract_from_reduced(const Batch& batch, const EliminatedBatch& out, Lane& lane) const {
    if (out.w.rows() == 0) return;  // no reduced unknowns
    const VectorXd down = out.w * out.y;
    if (batch.rows.empty()) {
      core::subtract_square(out.w, lane.reduced);
      lane.rhs -= down;
      return;
    }
    const Index rows = out.w.rows();
    MatrixXd product = MatrixXd::Zero(rows, rows);
    core::subtract_square(out.w, product);
    for (Index c = 0; c < rows; ++c) {
      lane.rhs[batch.rows[c]] -= down[c];
      for (Index r = c; r < rows; ++r) lane.reduced(batch.rows[r], batch.rows[c]) += product(r, c);
    }
  }

  template <typename Vector>
  void add_control(std::size_t index, SmallMatrix& v, Vector& rhs, Lane& lane) const {
    const ControlPoint& known = network_.control[index];
    const Eigen::Matrix3d weight = known.covariance_m2.inverse();
    const Eigen::Vector3d residual =
        target_position(network_, state_, known.target) - known.position_m;
    const double squared = residual.dot(weight * residual);
    const double robust = known_loss_.weight(squared);
    lane.cost += known_loss_.rho(squared);
    const auto jacobian = target_jacobian(network_, layout_, state_, known.target);
    v += robust * jacobian.transpose() * weight * jacobian;
    rhs -= robust * jacobian.transpose() * (weight * residual);
  }

  /// Adds an observation of a target that is fixed or belongs to the reduced unknowns.
  void add_direct(int index, Lane& lane) const {
    const ImageObservation& observation = network_.observations[index];
    ObservationRows rows;
    if (!rows_of(network_, layout_, state_, observation, rows)) return add_out_of_view(lane);
    auto outline = outline_rows(network_, layout_, state_, index, rows);
    const double root = apply_weight(loss_, rows, lane);
    const int image = observation.image;
    add_image_part(rows, lane.of_image[image], lane.rhs_of_image[image]);
    if (rows.size == 0) return;
    const Index offset = layout_.offset_of(observation.target);
    if (outline) add_direct_outline(*outline, image, root, offset, lane);
    const ImageBlock& block = layout_.images[image];
    for (Index c = 0; c < rows.size; ++c) {
      const double b0 = rows.b[0][c], b1 = rows.b[1][c];
      lane.rhs[offset + c] -= b0 * rows.r[0] + b1 * rows.r[1];
      lane.diagonal[offset + c] += b0 * b0 + b1 * b1;
      for (Index k = c; k < rows.size; ++k)
        lane.reduced(offset + k, offset + c) += b0 * rows.b[0][k] + b1 * rows.b[1][k];
      int start = 0;  // targets follow all images' unknowns: lower triangle
      for (int s = 0; s < block.segments; start += block.size[s++])
        for (int k = 0; k < block.size[s]; ++k)
          lane.reduced(offset + c, block.offset[s] + k) +=
              b0 * rows.a[0][start + k] + b1 * rows.a[1][start + k];
    }
  }

  /// Adds an observation given by its rows over some reduced unknowns (none: fixed).
  void add_rows(const std::vector<Index>& unknowns, const MatrixXd& jacobian, const VectorXd& r,
                Lane& lane) const {
    lane.cost += 0.5 * r.squaredNorm();
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      if (unknowns[i] == none) continue;
      const auto own = jacobian.col(static_cast<Index>(i));
      lane.rhs[unknowns[i]] -= own.dot(r);
      lane.diagonal[unknowns[i]] += own.squaredNorm();
      for (std::size_t j = 0; j < unknowns.size(); ++j)
        if (unknowns[j] != none && unknowns[j] <= unknowns[i])
          lane.reduced(unknowns[i], unknowns[j]) += own.dot(jacobian.col(static_cast<Index>(j)));
    }
  }

  void add_distance(const DistanceObservation& known, Lane& lane) const {
    const Eigen::Vector3d difference =
        target_position(network_, state_, known.to) - target_position(network_, state_, known.from);
    const double length = difference.norm();
    if (length == 0) return add_out_of_view(lane);
    const bool same_body = known.from.body >= 0 && known.from.body == known.to.body;
    std::vector<Index> unknowns;
    MatrixXd jacobian(1, 2 * max_group);
    Index columns = 0;
    const auto add = [&](const Target& target, double sign) {
      const Index offset = layout_.offset_of(target);
      if (offset == none) return;
      const Eigen::RowVectorXd row = (sign / (known.sigma_m * length)) * difference.transpose() *
                                     target_jacobian(network_, layout_, state_, target);
      const bool again = same_body && columns > 0;
      for (Index k = 0; k < row.size(); ++k) {
        if (again) {
          jacobian(0, k) += row[k];
          continue;
        }
        jacobian(0, columns++) = row[k];
        unknowns.push_back(offset + k);
      }
    };
    add(known.from, -1);
    add(known.to, 1);
    const double residual = (length - known.length_m) / known.sigma_m;
    const double weight = known_loss_.weight(residual * residual), root = std::sqrt(weight);
    lane.cost += known_loss_.rho(residual * residual) -
                 0.5 * weight * residual * residual;  // add_rows adds the rest
    add_rows(unknowns, root * jacobian.leftCols(columns), VectorXd::Constant(1, root * residual),
             lane);
  }

  void add_pose_prior(const PosePrior& prior, Lane& lane) const {
    const int station = prior.station;
    const Rigid3& pose = state_.stations[station];
    const Vector6 residual = difference(pose, prior.station_from_world);
    Matrix6 jacobian = Matrix6::Identity();
    jacobian.topLeftCorner<3, 3>() = so3_left_jacobian(residual.head<3>()).inverse();
    jacobian.bottomLeftCorner<3, 3>() = -skew(residual.tail<3>());
    const core::Cholesky<Matrix6> cholesky(prior.covariance);
    const MatrixXd whitened = cholesky.solve_lower(jacobian);
    const VectorXd r = cholesky.solve_lower(residual);
    std::vector<Index> unknowns;
    for (Index k = 0; k < 6; ++k)
      unknowns.push_back(layout_.stations[station] == none ? none : layout_.stations[station] + k);
    add_rows(unknowns, whitened, r, lane);
  }

  void add_parameter_prior(const ParameterPrior& prior, Lane& lane) const {
    const CameraBlock& block = layout_.cameras[prior.camera];
    if (block.offset == none) return;
    const auto& names = network_.cameras[prior.camera].free_parameters;
    const double value = free_parameter(state_.cameras[prior.camera], prior.parameter).value;
    for (std::size_t k = 0; k < names.size(); ++k)
      if (names[k] == prior.parameter)
        add_rows({block.offset + static_cast<Index>(k)}, MatrixXd::Constant(1, 1, 1 / prior.sigma),
                 VectorXd::Constant(1, (value - prior.value) / prior.sigma), lane);
  }

  void add_other_observations(Lane& lane) const {
    for (const std::size_t i : control_of_reduced_) {
      const Target& target = network_.control[i].target;
      const Index offset = layout_.offset_of(target);
      SmallMatrix v = SmallMatrix::Zero(layout_.size_of(target), layout_.size_of(target));
      VectorXd rhs = VectorXd::Zero(v.rows());
      add_control(i, v, rhs, lane);
      if (offset == none) continue;
      lane.rhs.segment(offset, v.rows()) += rhs;
      lane.diagonal.segment(offset, v.rows()) += v.diagonal();
      lane.reduced.block(offset, offset, v.rows(), v.cols()) += v;
    }
    for (const DistanceObservation& known : network_.distances)
      if (known.used && layout_.is_determined(known.from) && layout_.is_determined(known.to))
        add_distance(known, lane);
    for (const ParameterPrior& prior : network_.parameter_priors) add_parameter_prior(prior, lane);
    for (std::size_t i = 0; i < layout_.cameras.size(); ++i) {
      const CameraBlock& block = layout_.cameras[i];
      const double sigma = network_.cameras[i].outline_growth_sigma_px;
      if (block.has_growth)
        add_rows({block.offset + block.size() - 1}, MatrixXd::Constant(1, 1, 1 / sigma),
                 VectorXd::Constant(1, state_.growths[i] / sigma), lane);
    }
    for (const PosePrior& prior : network_.pose_priors) add_pose_prior(prior, lane);
  }

  const Network& network_;
  const NetworkLayout& layout_;
  const NetworkState& state_;
  const Loss& loss_;
  Loss known_loss_;  ///< loss of distances and control points
  double damping_;
  std::size_t lanes_;
  NormalEquations& normal_;
  std::vector<std::vector<std::size_t>> control_of_group_;
  std::vector<std::size_t> control_of_reduced_;
};

}  // namespace

void build(const Network& network, const NetworkLayout& layout, const NetworkState& state,
           const Loss& loss, double damping, int threads, NormalEquations& normal) {
  normal.batches.resize(layout.batches.size());
  std::vector<Lane> parts(lanes_of(layout));
  Builder builder(network, layout, state, loss, damping, parts.size(), normal);
  core::for_each_index(
      parts.size(), [&](std::size_t k) { builder.run(k, parts[k]); }, threads);
  Lane& sum = parts[0];
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const Lane& part = parts[k];
    sum.cost += part.cost;
    sum.out_of_view += part.out_of_view;
    sum.reduced += part.reduced;
    sum.rhs += part.rhs;
    sum.diagonal += part.diagonal;
    sum.singular_groups.insert(sum.singular_groups.end(), part.singular_groups.begin(),
                               part.singular_groups.end());
  }
  normal.cost = sum.cost;
  normal.out_of_view = sum.out_of_view;
  normal.reduced = std::move(sum.reduced);
  normal.rhs = std::move(sum.rhs);
  normal.diagonal = std::move(sum.diagonal);
  normal.reduced.diagonal() += damping * normal.diagonal;
  normal.singular_groups = std::move(sum.singular_groups);
}

}  // namespace occ::internal::network
