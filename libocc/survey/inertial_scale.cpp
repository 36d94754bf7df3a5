// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/inertial_scale.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/survey/internal/inertial_axes.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Standard deviations before the measurement. Gravity: over all latitudes and heights; the others:
// of phones and of units of robots.
constexpr double gravity_m_s2 = 9.807, gravity_sigma_m_s2 = 0.03;
constexpr double gain_sigma = 0.01, bias_sigma_m_s2 = 0.2, lever_sigma_m = 0.1;
constexpr double speed_sigma_m_s = 10;
constexpr double pose_floor = 1e-5;  // of the covariances of poses, rad and units of the map

/// Accelerations integrated once and twice in the unit's frame at the begin, and their derivatives
/// by a bias that is subtracted from the accelerations.
struct Integrals {
  Vector3d velocity = Vector3d::Zero(), position = Vector3d::Zero();
  Matrix3d velocity_by_bias = Matrix3d::Zero(), position_by_bias = Matrix3d::Zero();
};

Integrals integrals_of(const std::vector<ImuSample>& imu, double from_s, double to_s,
                       const Vector3d& turn_bias_rad_s) {
  Integrals sums;
  Matrix3d rotation = Matrix3d::Identity();
  std::size_t k = sample_before(imu, from_s);
  ImuSample a = sample_between(imu[k], imu[k + 1], from_s);
  while (a.time_s < to_s) {
    // Beyond the last sample, the rates of the last two are continued.
    const bool is_next = k + 2 < imu.size() && imu[k + 1].time_s < to_s;
    const ImuSample b = is_next ? imu[k + 1] : sample_between(imu[k], imu[k + 1], to_s);
    const double dt = b.time_s - a.time_s;
    const Vector3d turn = dt * (0.5 * (a.turn_rate_rad_s + b.turn_rate_rad_s) - turn_bias_rad_s);
    const Matrix3d half = rotation * so3_exp(0.5 * turn);
    const Vector3d acceleration = half * (0.5 * (a.acceleration_m_s2 + b.acceleration_m_s2));
    sums.position += dt * sums.velocity + 0.5 * dt * dt * acceleration;
    sums.velocity += dt * acceleration;
    sums.position_by_bias += dt * sums.velocity_by_bias - 0.5 * dt * dt * half;
    sums.velocity_by_bias -= dt * half;
    rotation *= so3_exp(turn);
    a = b;
    k = std::min(k + 1, imu.size() - 2);
  }
  return sums;
}

// Unknowns that all pictures share, and those of one picture.
constexpr Eigen::Index scale = 0, gain = 1, bias = 2, gravity = 5, lever = 8, axes_error = 11,
                       offset_error = 14, shared = 15;
constexpr Eigen::Index velocity = 0, place_error = 3, turn_error = 6, own = 9;

/// The equations of step 2, for a given noise.
class ScaleEquations {
 public:
  ScaleEquations(const InertialMotion& motion, const InertialAxes& axes)
      : motion_(motion), axes_(axes) {
    for (std::size_t i = 0; i < motion.pairs(); ++i) {
      if (!axes.used[i]) {
        pairs_.emplace_back();
        continue;
      }
      const double from_s = motion.poses()[i].time_s + axes.offset_s,
                   to_s = from_s + motion.duration_s(i);
      constexpr double step_s = 2e-3;
      const auto at = [&](double shift_s) {
        return integrals_of(motion.imu(), from_s + shift_s, to_s + shift_s, axes.bias_rad_s);
      };
      const Integrals later = at(step_s), earlier = at(-step_s);
      Pair pair;
      pair.integrals = at(0);
      pair.velocity_by_offset = (later.velocity - earlier.velocity) / (2 * step_s);
      pair.position_by_offset = (later.position - earlier.position) / (2 * step_s);
      pairs_.push_back(pair);
    }
  }

  struct Solution {
    Eigen::Matrix<double, shared, 1> values = Eigen::Matrix<double, shared, 1>::Zero();
    double scale_sigma = infinity;
    double minus_2_log_likelihood = infinity;  // restricted, but for a constant
  };

  /// Solves for the unknowns by orthogonal transformations, picture after picture.
  Solution solve(double noise_m_s2_sqrt_hz, const Solution& near) const {
    MatrixXd rows = priors(near);
    double log_determinant = 0, chi2 = 0;
    for (std::size_t i = 0; i <= pairs_.size(); ++i) {
      // Columns: those of picture i, shared ones, those of the next picture, right side.
      const bool is_last = i == pairs_.size();
      MatrixXd next = is_last ? MatrixXd(0, 2 * own + shared + 1)
                              : equations(i, noise_m_s2_sqrt_hz, near, log_determinant);
      MatrixXd all = MatrixXd::Zero(rows.rows() + next.rows(), 2 * own + shared + 1);
      all.topLeftCorner(rows.rows(), own + shared) = rows.leftCols(own + shared);
      all.col(all.cols() - 1).head(rows.rows()) = rows.col(rows.cols() - 1);
      all.bottomRows(next.rows()) = next;
      const Eigen::Index unknowns = is_last ? own + shared : 2 * own + shared;
      if (is_last) all.col(unknowns).swap(all.col(all.cols() - 1));
      const Eigen::HouseholderQR<MatrixXd> qr(all.leftCols(unknowns + 1));
      const MatrixXd upper = qr.matrixQR().triangularView<Eigen::Upper>();
      const Eigen::Index eliminated = is_last ? unknowns : own;
      for (Eigen::Index k = 0; k < eliminated; ++k)
        log_determinant += 2 * std::log(std::abs(upper(k, k)));
      if (upper.rows() > unknowns) chi2 += square(upper(unknowns, unknowns));
      if (is_last) return solution_of(upper, chi2, log_determinant);
      // The remaining information, with the next picture's columns first.
      const Eigen::Index count = std::min(upper.rows(), unknowns) - own;
      MatrixXd rest(count, own + shared + 1);
      rest.leftCols(own) = upper.block(own, own + shared, count, own);
      rest.middleCols(own, shared) = upper.block(own, own, count, shared);
      rest.col(own + shared) = upper.col(unknowns).segment(own, count);
      rows = rest;
    }
    return {};
  }

 private:
  struct Pair {
    std::optional<Integrals> integrals;  // nothing without samples
    Vector3d velocity_by_offset = Vector3d::Zero(), position_by_offset = Vector3d::Zero();
  };

  static Solution solution_of(const MatrixXd& upper, double chi2, double log_determinant) {
    const MatrixXd triangle = upper.block(own, own, shared, shared);
    const auto solver = triangle.triangularView<Eigen::Upper>();
    Solution found;
    found.values = solver.solve(VectorXd(upper.col(own + shared).segment(own, shared)));
    const MatrixXd inverse = solver.solve(MatrixXd::Identity(shared, shared));
    found.scale_sigma = inverse.row(scale).norm();
    found.minus_2_log_likelihood = chi2 + log_determinant;
    return found;
  }

  /// Rows of the first picture and of the shared unknowns; columns: picture, shared, right side.
  MatrixXd priors(const Solution& near) const {
    MatrixXd rows = MatrixXd::Zero(own + shared, own + shared + 1);
    rows.topLeftCorner(own, own) = errors_of(0, near);
    auto fixed = rows.block(own, own, shared, shared);
    auto right = rows.col(own + shared).tail(shared);
    fixed(scale, scale) = 1e-6;
    fixed(gain, gain) = right[gain] = 1 / gain_sigma;
    const Vector3d down = near.values.segment<3>(gravity);
    for (Eigen::Index k = 0; k < 3; ++k) {
      fixed(bias + k, bias + k) = 1 / bias_sigma_m_s2;
      fixed(gravity + k, gravity + k) = 1e-3;
      fixed(lever + k, lever + k) = 1 / lever_sigma_m;
    }
    if (down.norm() > 0) {
      fixed.block<1, 3>(gravity, gravity) = down.normalized().transpose() / gravity_sigma_m_s2;
      right[gravity] = gravity_m_s2 / gravity_sigma_m_s2;
      const Vector3d across = down.unitOrthogonal();
      fixed.block<1, 3>(gravity + 1, gravity) = 1e-3 * across.transpose();
      fixed.block<1, 3>(gravity + 2, gravity) = 1e-3 * down.normalized().cross(across).transpose();
    }
    Eigen::Matrix4d errors;
    errors << axes_.covariance.topLeftCorner<3, 3>(), axes_.covariance.block<3, 1>(0, 6),
        axes_.covariance.block<1, 3>(6, 0), axes_.covariance(6, 6);
    fixed.block<4, 4>(axes_error, axes_error) =
        errors.llt().matrixL().solve(Eigen::Matrix4d::Identity());
    return rows;
  }

  /// Prior rows of the errors of a picture's pose, in metres and rad in the map, and of its
  /// velocity.
  MatrixXd errors_of(std::size_t i, const Solution& near) const {
    const TimedPose& pose = motion_.poses()[i];
    const Matrix3d map_from_cam = pose.cam_from_map.rotation.transpose();
    const double metres = near.values[scale];
    Matrix6 by_pose = Matrix6::Zero();
    by_pose.topRightCorner<3, 3>() = -metres * map_from_cam;
    by_pose.bottomLeftCorner<3, 3>() = -map_from_cam;
    Matrix6 covariance = pose.covariance;
    covariance.diagonal().array() += square(pose_floor);
    const Matrix6 errors = by_pose * covariance * by_pose.transpose();
    MatrixXd rows = MatrixXd::Zero(own, own);
    rows.topLeftCorner<3, 3>() = Matrix3d::Identity() / speed_sigma_m_s;
    rows.block<6, 6>(3, 3) = errors.llt().matrixL().solve(Matrix6::Identity());
    return rows;
  }

  /// Rows of the motion from picture i to the next, and of the next picture's errors.
  MatrixXd equations(std::size_t i, double noise, const Solution& near,
                     double& log_determinant) const {
    const Eigen::Index columns = 2 * own + shared + 1, next = own + shared;
    MatrixXd rows = MatrixXd::Zero(6 + own, columns);
    rows.block(6, next, own, own) = errors_of(i + 1, near);
    const Pair& pair = pairs_[i];
    if (!pair.integrals) return rows.bottomRows(own);
    const Rigid3& a = motion_.poses()[i].cam_from_map;
    const Rigid3& b = motion_.poses()[i + 1].cam_from_map;
    const Matrix3d map_from_a = a.rotation.transpose(),
                   map_from_imu = map_from_a * axes_.cam_from_imu;
    const double dt = motion_.duration_s(i);
    const Integrals& by_unit = *pair.integrals;
    const Matrix3d one = Matrix3d::Identity();

    auto position = rows.topRows<3>();
    position.col(own + scale) = b.origin_in_source() - a.origin_in_source();
    position.middleCols<3>(next + place_error) = one;
    position.middleCols<3>(place_error) = -one;
    position.middleCols<3>(own + lever) = b.rotation.transpose() - map_from_a;
    position.middleCols<3>(velocity) = -dt * one;
    position.middleCols<3>(own + gravity) = -0.5 * dt * dt * one;

    auto speed = rows.middleRows<3>(3);
    speed.middleCols<3>(next + velocity) = one;
    speed.middleCols<3>(velocity) = -one;
    speed.middleCols<3>(own + gravity) = -dt * one;

    const auto add_unit = [&](auto part, const Vector3d& integral, const Matrix3d& by_bias,
                              const Vector3d& by_offset) {
      const Vector3d in_map = map_from_imu * integral;
      part.col(own + gain) = -in_map;
      part.template middleCols<3>(own + bias) = -map_from_imu * by_bias;
      part.template middleCols<3>(own + axes_error) = map_from_imu * skew(integral);
      part.col(own + offset_error) = -map_from_imu * by_offset;
      part.template middleCols<3>(turn_error) = skew(in_map);
    };
    add_unit(position, by_unit.position, by_unit.position_by_bias, pair.position_by_offset);
    add_unit(speed, by_unit.velocity, by_unit.velocity_by_bias, pair.velocity_by_offset);

    // White noise of accelerations, and a drift of the orientation that tilts gravity.
    const double white = square(noise), drift = square(gravity_m_s2 * axes_.turn_noise_rad_sqrt_s);
    const double dt2 = dt * dt, dt3 = dt2 * dt;
    Eigen::Matrix2d covariance;
    covariance << white * dt3 / 3 + drift * dt3 * dt2 / 20, white * dt2 / 2 + drift * dt2 * dt2 / 8,
        white * dt2 / 2 + drift * dt2 * dt2 / 8, white * dt + drift * dt3 / 3;
    const Eigen::Matrix2d root = covariance.llt().matrixL();
    position /= root(0, 0);
    speed = (speed - root(1, 0) * position).eval() / root(1, 1);
    log_determinant += 6 * std::log(root(0, 0) * root(1, 1));
    return rows;
  }

  const InertialMotion& motion_;
  const InertialAxes& axes_;
  std::vector<Pair> pairs_;
};

/// Solution with the noise of greatest restricted likelihood: golden section over its logarithm.
ScaleEquations::Solution likeliest(const ScaleEquations& equations,
                                   const ScaleEquations::Solution& near) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double low = std::log(1e-4), high = std::log(10.0);
  const auto at = [&](double log_noise) { return equations.solve(std::exp(log_noise), near); };
  double a = high - golden * (high - low), b = low + golden * (high - low);
  ScaleEquations::Solution at_a = at(a), at_b = at(b);
  while (high - low > 0.02) {
    if (at_a.minus_2_log_likelihood < at_b.minus_2_log_likelihood) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = at(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = at(b);
    }
  }
  return at_a.minus_2_log_likelihood < at_b.minus_2_log_likelihood ? at_a : at_b;
}

Result<InertialAlignment> failed(Status status, const std::string& message) {
  Result<InertialAlignment> result;
  result.status = status;
  result.message = message;
  return result;
}

std::string figure(double value, const char* unit) {
  std::ostringstream text;
  text.precision(2);
  text << value << unit;
  return text.str();
}

}  // namespace

Result<InertialAlignment> align_inertial(const std::vector<TimedPose>& poses,
                                         const std::vector<ImuSample>& imu) {
  constexpr double degree = pi / 180, max_axes_sigma_rad = 2 * degree;
  constexpr double max_misfit = 0.2, max_scale_sigma = 0.2;
  const std::string few = "fewer than " + std::to_string(min_inertial_poses) +
                          " pictures of the map have inertial measurements around them";
  if (poses.size() < min_inertial_poses || imu.size() < 2)
    return failed(Status::too_few_lamps, few);
  const InertialMotion motion(poses, imu);
  const auto aligned = inertial_axes(motion);
  if (!aligned) return failed(Status::too_few_lamps, few);
  const InertialAxes& axes = *aligned;
  const auto used = static_cast<std::size_t>(std::count(axes.used.begin(), axes.used.end(), true));
  const double misfit = axes.residual_sigma_rad * std::sqrt(3.0);
  if (used + 1 < min_inertial_poses || used < 3 * axes.contradictions.size() ||
      !(misfit < max_misfit * axes.turn_rms_rad))
    return failed(axes.turn_rms_rad < degree ? Status::degenerate : Status::no_pose,
                  "the camera turns by " + figure(axes.turn_rms_rad / degree, " deg") +
                      " between two pictures, from which the unit's turns differ by " +
                      figure(misfit / degree, " deg") + "; the root mean squares");
  const double axes_sigma = std::sqrt(
      core::symmetric_eigen<Matrix3d>(axes.covariance.topLeftCorner<3, 3>()).eigenvalues()[2]);
  if (!(axes_sigma < max_axes_sigma_rad))
    return failed(Status::degenerate,
                  "the camera turns about one axis only, so the direction of "
                  "the unit's axes has an error of " +
                      figure(axes_sigma / degree, " deg"));
  const ScaleEquations equations(motion, axes);
  ScaleEquations::Solution found;
  found.values[scale] = 1;
  found = equations.solve(0.1, found);
  for (int iteration = 0; iteration < 4; ++iteration) found = likeliest(equations, found);

  Result<InertialAlignment> result;
  InertialAlignment& alignment = result.value;
  alignment.scale = found.values[scale];
  alignment.scale_sigma = found.scale_sigma / std::abs(alignment.scale);
  alignment.down = found.values.segment<3>(gravity).normalized();
  alignment.cam_from_imu = axes.cam_from_imu * so3_exp(found.values.segment<3>(axes_error));
  alignment.time_offset_s = axes.offset_s + found.values[offset_error];
  alignment.turn_rate_bias_rad_s = axes.bias_rad_s;
  for (const std::size_t i : axes.contradictions)
    alignment.contradictions.push_back(poses[i].picture);
  if (!(alignment.scale > 0) || !(alignment.scale_sigma < max_scale_sigma))
    return failed(Status::degenerate,
                  "the camera moves too evenly: the scale would have a relative error of " +
                      figure(100 * alignment.scale_sigma, " %"));
  return result;
}

}  // namespace occ::internal::survey
