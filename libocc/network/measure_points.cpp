// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/measure_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/unknown_covariance.hpp"
#include "libocc/network/internal/consensus.hpp"
#include "libocc/network/internal/precision_state.hpp"

namespace occ {

using namespace internal::network;
namespace core = internal::core;

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void check_observations(const Network& network,
                        const std::vector<std::vector<PointObservation>>& points) {
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const PointObservation& observation : points[i]) {
      const std::string name = "points[" + std::to_string(i) + "]";
      require(observation.image >= 0 && observation.image < static_cast<int>(network.images.size()),
              name + ".image", observation.image,
              "one of the " + std::to_string(network.images.size()) + " images");
      require_finite(observation.pixel, name + ".pixel");
      require(observation.sigma_px.minCoeff() > 0 && observation.sigma_px.allFinite(),
              name + ".sigma_px", observation.sigma_px.transpose(), "positive");
    }
}

/// Layout of the cameras and stations of `precision`, for the derivatives of the new points.
NetworkLayout layout_for(const Network& probe, const Precision* precision) {
  NetworkLayout layout;
  layout.cameras.resize(probe.cameras.size());
  layout.images.resize(probe.images.size());
  if (precision) {
    const NetworkLayout& known = precision->state().free->layout;
    require(
        known.cameras.size() == probe.cameras.size() && known.images.size() == probe.images.size(),
        "precision", known.images.size(), "that of the same network");
    layout.cameras = known.cameras;
    layout.images = known.images;
    layout.reduced = known.reduced;
  }
  layout.points.assign(probe.points.size(), 0);  // unknown; the offset is not used
  layout.point_sizes.assign(probe.points.size(), 3);
  return layout;
}

class PointIntersection {
 public:
  /// `covariance`: covariance of the reduced unknowns; empty if they are error-free.
  PointIntersection(const Network& probe, const NetworkLayout& layout,
                    const std::vector<PointObservation>& observations, int point,
                    const MatrixXd& covariance)
      : probe_(probe), layout_(layout), point_(point), state_(probe), covariance_(covariance) {
    for (const PointObservation& observation : observations)
      observations_.push_back({observation.image, Target::of_point(point), observation.pixel,
                               observation.sigma_px, true});
  }

  /// Derivative of the point with respect to the reduced unknowns; nothing when it was not found.
  std::optional<MatrixXd> solve(MeasuredPoint& out) {
    out.covariance_m2 = unknown_covariance<3>();
    const auto start = first_guess(out);
    if (!start) return std::nullopt;
    VectorXd x = *start;
    // The weights are those of the cameras' and stations' errors at the point. They change little
    // with it, so that a second round suffices.
    const int rounds = covariance_.size() > 0 ? 2 : 0;
    for (int round = 0;; ++round) {
      core::LeastSquaresOptions options;
      options.max_iterations = 100;
      options.step_tolerance = 1e-5;
      options.take_last_step = true;
      const core::LeastSquaresResult result = core::minimise_sums(*this, x, options);
      Sums final_sums;
      if (!sums(x, final_sums)) return fail(out, Status::degenerate);
      const core::Cholesky<Matrix3d> cholesky(final_sums.information);
      if (!cholesky.exists() || !(cholesky.rcond() > 1e-15)) return fail(out, Status::degenerate);
      if (!result.converged) return fail(out, Status::not_converged);
      if (round == rounds) return finish(out, final_sums);
      set_weights();
    }
  }

  // Least squares problem in the point's coordinates, for core::minimise_sums().
  static constexpr int unknowns = Eigen::Dynamic;  // three; a fixed size compiles for seconds
  using Sums = core::NormalSums<Eigen::Dynamic>;
  double chi2(const VectorXd& x) {
    Sums at_x;
    return sums(x, at_x) ? at_x.chi2 : std::numeric_limits<double>::infinity();
  }
  /// False when the point is not in view of an image.
  bool sums(const VectorXd& x, Sums& sums) {
    state_.points[point_] = x;
    Linearised rows;
    if (!linearise(rows)) return false;
    const MatrixXd b = whitened(rows.b);
    const VectorXd r = whitened(rows.r);
    sums.information = core::transposed_product(b, b);
    sums.gradient = core::transposed_product(b, r);
    sums.chi2 = r.squaredNorm();
    return true;
  }

 private:
  /// Residuals and derivatives, divided by the sigmas of the image points; two rows for each.
  struct Linearised {
    VectorXd r;
    MatrixXd b;                           ///< derivatives, by the point
    std::vector<ObservationRows> images;  ///< derivatives, by camera and station
  };

  bool linearise(Linearised& all) const {
    const Eigen::Index count = static_cast<Eigen::Index>(observations_.size());
    all.r.resize(2 * count);
    all.b.resize(2 * count, 3);
    all.images.resize(observations_.size());
    for (Eigen::Index i = 0; i < count; ++i) {
      ObservationRows& rows = all.images[i];
      if (!rows_of(probe_, layout_, state_, observations_[i], rows)) return false;
      for (int k = 0; k < 2; ++k) {
        all.r[2 * i + k] = rows.r[k];
        all.b.row(2 * i + k) << rows.b[k][0], rows.b[k][1], rows.b[k][2];
      }
    }
    return true;
  }

  /// Derivatives of the residuals by the reduced unknowns, 2n x reduced.
  MatrixXd derivatives(const Linearised& all) const {
    MatrixXd by_reduced = MatrixXd::Zero(all.r.size(), layout_.reduced);
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const ImageBlock& block = layout_.images[observations_[i].image];
      for (int k = 0; k < 2; ++k) {
        int column = 0;
        for (int s = 0; s < block.segments; ++s)
          for (int c = 0; c < block.size[s]; ++c)
            by_reduced(2 * static_cast<Eigen::Index>(i) + k, block.offset[s] + c) +=
                all.images[i].a[k][column++];
      }
    }
    return by_reduced;
  }

  /// Inverse Cholesky factor of the residuals' covariance I + A Q A^T.
  void set_weights() {
    Linearised all;
    if (!linearise(all)) return;
    const MatrixXd a = derivatives(all);
    MatrixXd total = core::product_transposed(core::product(a, covariance_), a);
    total = (0.5 * (total + total.transpose())).eval();
    total.diagonal().array() += 1;
    const core::Cholesky<MatrixXd> cholesky(total);
    if (!cholesky.exists()) return;
    whitening_ = MatrixXd::Identity(total.rows(), total.rows());
    core::solve_lower_in_place(cholesky.lower(), whitening_);
  }

  MatrixXd whitened(const MatrixXd& rows) const {
    return whitening_.size() > 0 ? core::product(whitening_, rows) : rows;
  }

  static std::nullopt_t fail(MeasuredPoint& out, Status status) {
    out.status = status;
    return std::nullopt;
  }

  std::optional<Vector3d> first_guess(MeasuredPoint& out) const {
    std::vector<Ray> rays;
    int images = 0;
    for (std::size_t k = 0; k < observations_.size(); ++k) {
      const NetworkImage& image = probe_.images[observations_[k].image];
      const auto ray = probe_.cameras[image.camera].camera.ray(observations_[k].pixel);
      const Rigid3 world_from_cam = probe_.cam_from_world(observations_[k].image).inverse();
      if (ray)
        rays.push_back({world_from_cam * ray->origin, world_from_cam.rotation * ray->direction});
      images += std::none_of(
          observations_.begin(), observations_.begin() + static_cast<std::ptrdiff_t>(k),
          [&](const auto& other) { return other.image == observations_[k].image; });
    }
    if (images < 2) {
      out.status = Status::too_few_lamps;
      return std::nullopt;
    }
    for (std::size_t a = 0; a < rays.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        out.angle_rad =
            std::max(out.angle_rad, std::atan2(rays[a].direction.cross(rays[b].direction).norm(),
                                               rays[a].direction.dot(rays[b].direction)));
    const auto point = intersect_rays(rays);
    if (!point) out.status = Status::degenerate;
    return point;
  }

  /// Sets the point with the covariance that its image points' own noise causes.
  MatrixXd finish(MeasuredPoint& out, const Sums& sums) const {
    Linearised all;
    linearise(all);
    out.position_m = state_.points[point_];
    // X = -G r with G = (B^T W B)^-1 B^T W
    const MatrixXd weighted = whitened(all.b);
    const Matrix3d inverse =
        core::solve_llt<Matrix3d, Matrix3d>(Matrix3d(sums.information), Matrix3d::Identity());
    const MatrixXd gain = core::product(
        inverse, whitening_.size() > 0 ? core::transposed_product(weighted, whitening_)
                                       : MatrixXd(weighted.transpose()));
    out.covariance_m2 = core::product_transposed(gain, gain);
    const double redundancy = 2 * static_cast<double>(observations_.size()) - 3;
    out.sigma0 = std::sqrt(sums.chi2 / redundancy);
    out.worst_residual_px = 0;
    for (std::size_t i = 0; i < observations_.size(); ++i)
      for (int k = 0; k < 2; ++k)
        out.worst_residual_px =
            std::max(out.worst_residual_px, std::abs(all.r[2 * static_cast<Eigen::Index>(i) + k]) *
                                                observations_[i].sigma_px[k]);
    return -core::product(gain, derivatives(all));
  }

  const Network& probe_;
  const NetworkLayout& layout_;
  int point_;
  NetworkState state_;
  const MatrixXd& covariance_;
  MatrixXd whitening_;  ///< W^1/2; empty: identity
  std::vector<ImageObservation> observations_;
};

}  // namespace

Measurement measure_points(const Network& network,
                           const std::vector<std::vector<PointObservation>>& points,
                           const Precision* precision) {
  check_network(network);
  check_observations(network, points);
  Network probe = without_observations(network);
  probe.points.assign(1, {});  // scratch point, one at a time
  probe.bodies.clear();
  const NetworkLayout layout = layout_for(probe, precision);
  Measurement out;
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(points.size());
  out.covariance_m2 = MatrixXd::Zero(size, size);
  MatrixXd dependence = MatrixXd::Zero(size, layout.reduced);
  const MatrixXd covariance = precision && layout.reduced > 0
                                  ? precision->state().between(0, layout.reduced, 0, layout.reduced)
                                  : MatrixXd();
  for (std::size_t i = 0; i < points.size(); ++i) {
    MeasuredPoint point;
    point.observations = points[i];
    PointIntersection intersection(probe, layout, points[i], 0, covariance);
    const auto jacobian = intersection.solve(point);
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    if (jacobian) dependence.middleRows<3>(row) = *jacobian;
    out.points.push_back(point);
  }
  if (covariance.size() > 0) {
    const MatrixXd half = internal::core::product(dependence, covariance);
    out.covariance_m2 = internal::core::product_transposed(half, dependence);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    auto own = out.covariance_m2.block<3, 3>(row, row);
    own += out.points[i].covariance_m2;
    own = (0.5 * (own + own.transpose())).eval();
    out.points[i].covariance_m2 = own;
  }
  return out;
}

MeasuredDistance distance_between(const Measurement& measurement, int from, int to) {
  const auto is_index = [&](int index) {
    return index >= 0 && index < static_cast<int>(measurement.points.size());
  };
  require(is_index(from), "from", from, "one of the points");
  require(is_index(to), "to", to, "one of the points");
  const MeasuredPoint &a = measurement.points[from], &b = measurement.points[to];
  MeasuredDistance distance{0, std::numeric_limits<double>::infinity()};
  if (a.status != Status::ok || b.status != Status::ok) return distance;
  const Vector3d difference = b.position_m - a.position_m;
  distance.length_m = difference.norm();
  if (distance.length_m == 0) return distance;
  const Vector3d along = difference / distance.length_m;
  const auto block = [&](int i, int j) {
    return measurement.covariance_m2.block<3, 3>(3 * i, 3 * j);
  };
  const Matrix3d q = block(from, from) + block(to, to) - block(from, to) - block(to, from);
  distance.sigma_m = std::sqrt(std::max(0.0, along.dot(q * along)));
  return distance;
}

}  // namespace occ
