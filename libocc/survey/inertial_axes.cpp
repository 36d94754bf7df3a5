// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/inertial_axes.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::survey {

ImuSample sample_between(const ImuSample& a, const ImuSample& b, double time_s) {
  const double part = (time_s - a.time_s) / (b.time_s - a.time_s);
  ImuSample sample;
  sample.time_s = time_s;
  sample.turn_rate_rad_s = (1 - part) * a.turn_rate_rad_s + part * b.turn_rate_rad_s;
  sample.acceleration_m_s2 = (1 - part) * a.acceleration_m_s2 + part * b.acceleration_m_s2;
  return sample;
}

std::size_t sample_before(const std::vector<ImuSample>& imu, double time_s) {
  const auto after = std::upper_bound(imu.begin(), imu.end(), time_s,
                                      [](double t, const ImuSample& s) { return t < s.time_s; });
  const auto index = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - imu.begin(), 1) - 1);
  return std::min(index, imu.size() - 2);
}

InertialMotion::InertialMotion(const std::vector<TimedPose>& poses,
                               const std::vector<ImuSample>& imu)
    : poses_(poses), imu_(imu) {
  constexpr double max_gap_s = 0.1;  // between two samples
  for (std::size_t i = 0; i + 1 < poses.size(); ++i)
    turns_.push_back(
        so3_log(poses[i].cam_from_map.rotation * poses[i + 1].cam_from_map.rotation.transpose()));
  for (std::size_t k = 0; k + 1 < imu.size(); ++k)
    if (imu[k + 1].time_s - imu[k].time_s > max_gap_s)
      gaps_.emplace_back(imu[k].time_s, imu[k + 1].time_s);
}

bool InertialMotion::is_covered(std::size_t i, double offset_s) const {
  const double from = poses_[i].time_s + offset_s, to = poses_[i + 1].time_s + offset_s;
  if (from < imu_.front().time_s || to > imu_.back().time_s) return false;
  return std::none_of(gaps_.begin(), gaps_.end(),
                      [&](const auto& gap) { return gap.first < to && from < gap.second; });
}

int InertialMotion::covered(double offset_s) const {
  int count = 0;
  for (std::size_t i = 0; i < pairs(); ++i) count += is_covered(i, offset_s);
  return count;
}

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

// Standard deviations before the measurement.
constexpr double gyro_bias_sigma_rad_s = 0.1, offset_sigma_s = 0.1;

/// Orientation of the unit over time, from its frame at the first sample.
class UnitTurns {
 public:
  UnitTurns(const std::vector<ImuSample>& imu, const Vector3d& bias_rad_s)
      : imu_(imu), bias_rad_s_(bias_rad_s), first_from_(imu.size(), Matrix3d::Identity()) {
    for (std::size_t k = 0; k + 1 < imu.size(); ++k)
      first_from_[k + 1] = first_from_[k] * turn(imu[k], imu[k + 1]);
  }

  /// Frame at a time from the frame a duration later.
  Matrix3d over(double from_s, double duration_s) const {
    return at(from_s).transpose() * at(from_s + duration_s);
  }

 private:
  Matrix3d at(double time_s) const {
    const std::size_t k = sample_before(imu_, time_s);
    return first_from_[k] * turn(imu_[k], sample_between(imu_[k], imu_[k + 1], time_s));
  }

  Matrix3d turn(const ImuSample& a, const ImuSample& b) const {
    return so3_exp((b.time_s - a.time_s) *
                   (0.5 * (a.turn_rate_rad_s + b.turn_rate_rad_s) - bias_rad_s_));
  }

  const std::vector<ImuSample>& imu_;
  Vector3d bias_rad_s_;
  std::vector<Matrix3d> first_from_;
};

struct Wahba {
  double squares = infinity;  // of residuals over those of the camera's turns
  Matrix3d cam_from_imu = Matrix3d::Identity();
};

Wahba axes_at(const InertialMotion& motion, const UnitTurns& turns, double offset_s) {
  Matrix3d product = Matrix3d::Zero();
  double camera = 0, unit = 0;
  for (std::size_t i = 0; i < motion.pairs(); ++i) {
    if (!motion.is_covered(i, offset_s)) continue;
    const Vector3d by_unit =
        so3_log(turns.over(motion.poses()[i].time_s + offset_s, motion.duration_s(i)));
    product += motion.turn(i) * by_unit.transpose();
    camera += motion.turn(i).squaredNorm();
    unit += by_unit.squaredNorm();
  }
  Wahba found;
  found.cam_from_imu = nearest_rotation(product);
  if (camera > 0)
    found.squares =
        (camera + unit - 2 * (found.cam_from_imu.transpose() * product).trace()) / camera;
  return found;
}

/// The offset whose turns agree best: those near zero, and all that place every picture within the
/// times of the samples, as if the clocks were not the same.
std::optional<InertialAxes> start_of(const InertialMotion& motion) {
  constexpr double step_s = 0.02, near_zero_s = 0.5;
  const UnitTurns turns(motion.imu(), Vector3d::Zero());
  const double low = motion.imu().front().time_s - motion.poses().front().time_s,
               high = motion.imu().back().time_s - motion.poses().back().time_s;
  std::vector<double> offsets;
  for (int k = 0; step_s * k <= near_zero_s; ++k) {
    offsets.push_back(step_s * k);
    offsets.push_back(-step_s * k);
  }
  for (double offset = low; offset <= high; offset += step_s) offsets.push_back(offset);
  std::optional<InertialAxes> best;
  double least = infinity;
  for (const double offset_s : offsets) {
    if (motion.covered(offset_s) + 1 < static_cast<int>(min_inertial_poses)) continue;
    const Wahba found = axes_at(motion, turns, offset_s);
    if (!(found.squares < least)) continue;
    least = found.squares;
    best.emplace();
    best->cam_from_imu = found.cam_from_imu;
    best->offset_s = offset_s;
  }
  return best;
}

/// Differences of the turns, three per pair; zero for pairs that are not used.
VectorXd turn_residuals(const InertialMotion& motion, const InertialAxes& axes) {
  const UnitTurns turns(motion.imu(), axes.bias_rad_s);
  VectorXd residuals = VectorXd::Zero(3 * static_cast<Eigen::Index>(motion.pairs()));
  for (std::size_t i = 0; i < motion.pairs(); ++i) {
    if (!axes.used[i]) continue;
    const Matrix3d by_unit =
        axes.cam_from_imu *
        turns.over(motion.poses()[i].time_s + axes.offset_s, motion.duration_s(i)) *
        axes.cam_from_imu.transpose();
    residuals.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        so3_log(so3_exp(motion.turn(i)).transpose() * by_unit);
  }
  return residuals;
}

InertialAxes moved(const InertialAxes& axes, const Vector7& step) {
  InertialAxes next = axes;
  next.cam_from_imu = axes.cam_from_imu * so3_exp(step.head<3>());
  next.bias_rad_s += step.segment<3>(3);
  next.offset_s += step[6];
  return next;
}

/// Gauss-Newton iteration with the pairs in use; derivatives are central differences.
void iterate(const InertialMotion& motion, double start_s, InertialAxes& axes) {
  const auto count = static_cast<double>(std::count(axes.used.begin(), axes.used.end(), true));
  Vector7 prior_sigmas;
  prior_sigmas << Vector3d::Constant(pi), Vector3d::Constant(gyro_bias_sigma_rad_s), offset_sigma_s;
  for (int iteration = 0; iteration < 10; ++iteration) {
    const VectorXd residuals = turn_residuals(motion, axes);
    MatrixXd derivative(residuals.size(), 7);
    for (Eigen::Index k = 0; k < 7; ++k) {
      const double step = k < 6 ? 1e-4 : 2e-3;
      derivative.col(k) = (turn_residuals(motion, moved(axes, step * Vector7::Unit(k))) -
                           turn_residuals(motion, moved(axes, -step * Vector7::Unit(k)))) /
                          (2 * step);
    }
    axes.residual_sigma_rad =
        std::max(1e-5, residuals.norm() / std::sqrt(std::max(3.0, 3 * count - 7)));
    const double weight = 1 / square(axes.residual_sigma_rad);
    Matrix7 normal = weight * Matrix7(derivative.transpose().lazyProduct(derivative));
    Vector7 right = -weight * Vector7(derivative.transpose().lazyProduct(residuals));
    Vector7 from_prior = Vector7::Zero();
    from_prior << Vector3d::Zero(), axes.bias_rad_s, axes.offset_s - start_s;
    normal.diagonal() += prior_sigmas.cwiseAbs2().cwiseInverse();
    right -= from_prior.cwiseQuotient(prior_sigmas.cwiseAbs2());
    const Eigen::LDLT<Matrix7> solver(normal);
    const Vector7 step = solver.solve(right);
    axes.covariance = solver.solve(Matrix7::Identity());
    if (!step.allFinite()) break;
    axes = moved(axes, step);
    if (step.head<3>().norm() < 1e-7 && std::abs(step[6]) < 1e-6) break;
  }
}

/// Removes the pairs whose turns contradict the others, such as by a wrong time; false: none.
bool remove_outliers(const InertialMotion& motion, InertialAxes& axes) {
  constexpr double limit_sigma = 5, median_of_chi3 = 1.538, floor_rad = 1e-4;
  const VectorXd residuals = turn_residuals(motion, axes);
  std::vector<double> lengths, used;
  for (std::size_t i = 0; i < axes.used.size(); ++i) {
    lengths.push_back(residuals.segment<3>(3 * static_cast<Eigen::Index>(i)).norm());
    if (axes.used[i]) used.push_back(lengths[i]);
  }
  const double limit = limit_sigma * std::max(floor_rad, median(used) / median_of_chi3);
  bool removed = false;
  for (std::size_t i = 0; i < axes.used.size(); ++i)
    if (axes.used[i] && lengths[i] > limit) {
      axes.used[i] = false;
      axes.contradictions.push_back(i);
      removed = true;
    }
  return removed;
}

InertialAxes refined(const InertialMotion& motion, const InertialAxes& start) {
  InertialAxes axes = start;
  for (std::size_t i = 0; i < motion.pairs(); ++i)
    axes.used.push_back(motion.is_covered(i, start.offset_s));
  iterate(motion, start.offset_s, axes);
  while (remove_outliers(motion, axes)) iterate(motion, start.offset_s, axes);
  double time_s = 0, squares = 0, count = 0;
  for (std::size_t i = 0; i < motion.pairs(); ++i) {
    axes.used[i] = axes.used[i] && motion.is_covered(i, axes.offset_s);
    if (!axes.used[i]) continue;
    ++count;
    time_s += motion.duration_s(i);
    squares += motion.turn(i).squaredNorm();
  }
  axes.turn_rms_rad = std::sqrt(squares / std::max(1.0, count));
  axes.turn_noise_rad_sqrt_s = axes.residual_sigma_rad * std::sqrt(count / std::max(1e-9, time_s));
  return axes;
}

}  // namespace

std::optional<InertialAxes> inertial_axes(const InertialMotion& motion) {
  const auto start = start_of(motion);
  if (!start) return std::nullopt;
  return refined(motion, *start);
}

}  // namespace occ::internal::survey
