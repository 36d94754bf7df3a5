// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/pose_filter.hpp"

#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/track/internal/information_update.hpp"
#include "libocc/track/internal/replay.hpp"

namespace occ {

using namespace internal::track;
namespace {

// Order of the errors: pose and velocity, each [rotation, translation], biases.
constexpr int states = 18, velocity = 6, gyro = 12, accelerometer = 15;
using Covariance = Eigen::Matrix<double, states, states>;

struct PoseState {
  double time_s = 0;
  Rigid3 pose;  // body_from_world
  Vector6 velocity = Vector6::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  Covariance covariance = Covariance::Identity();
};

class PoseModel {
 public:
  using State = PoseState;
  using Step = Odometry;
  using Stretch = Timeline<Step>::Stretch;

  explicit PoseModel(const PoseFilterOptions& options) : options_(options) {}

  const PoseFilterOptions& options() const { return options_; }

  void propagate(State& state, const Stretch& stretch) const {
    if (stretch.odometry) follow_odometry(*stretch.odometry, state);
    if (stretch.imu) follow_gyro(*stretch.imu, stretch.duration_s, state);
    move(stretch, state);
    const double dt = stretch.duration_s;
    state.covariance.diagonal().segment<3>(gyro).array() += square(options_.gyro_bias_walk) * dt;
    state.covariance.diagonal().segment<3>(accelerometer).array() +=
        square(options_.accelerometer_bias_walk) * dt;
  }

  FilterUpdate update(State& state, const PoseObservation& seen) const {
    const PoseObservation body = seen.of_body();
    // Linearises about the observed pose instead of the prediction: where the two are far apart and
    // the image is precise, the posterior is close to the image.
    const Vector6 off = difference(state.pose, body.cam_from_world);
    const Covariance about_seen = carried(state.covariance, d_difference(off));
    const Vector6 gradient = body.gradient + body.information * off;
    const InformationUpdate<states, 6> corrected(about_seen, body.information, gradient);
    FilterUpdate update{FilterOutcome::accepted, corrected.nis(), corrected.dof()};
    if (update.nis_dof > 0 && update.nis > gate_chi2(options_.gate_sigma, update.nis_dof)) {
      update.outcome = FilterOutcome::gated;
      return update;
    }
    const Eigen::Matrix<double, states, 1> step = corrected.step();
    const Vector6 left = off + step.head<6>();
    state.pose = perturb(body.cam_from_world, left);
    state.velocity += step.segment<6>(velocity);
    state.gyro_bias += step.segment<3>(gyro);
    state.accelerometer_bias += step.segment<3>(accelerometer);
    state.covariance = carried(corrected.covariance(), d_difference(left).inverse());
    return update;
  }

 private:
  /// Covariance after a linear change of the first six states.
  static Covariance carried(const Covariance& covariance, const Matrix6& by) {
    Covariance out = covariance;
    out.topRows<6>() = by * covariance.topRows<6>();
    out.leftCols<6>() = (out.leftCols<6>() * by.transpose()).eval();
    return out;
  }

  bool reads_acceleration(const Stretch& stretch) const {
    return stretch.imu && !stretch.odometry && options_.use_accelerometer;
  }

  /// Clears the covariance of velocities that a sensor replaces.
  static void replace_velocity(int first, int count, State& state) {
    state.covariance.middleRows(velocity + first, count).setZero();
    state.covariance.middleCols(velocity + first, count).setZero();
  }

  static void follow_odometry(const Step& step, State& state) {
    const double dt = step.to_s - step.from_s;
    state.velocity = velocity_between(Rigid3{}, step.to_from_from, dt);
    replace_velocity(0, 6, state);
    state.covariance.block<6, 6>(velocity, velocity) = step.covariance / square(dt);
  }

  /// Replaces the rotational velocity: body_from_world rotates at the negative rate of the body.
  void follow_gyro(const ImuSample& sample, double dt, State& state) const {
    state.velocity.head<3>() = state.gyro_bias - sample.turn_rate_rad_s;
    replace_velocity(0, 3, state);
    Covariance& p = state.covariance;
    p.middleRows<3>(velocity) = p.middleRows<3>(gyro);
    p.middleCols<3>(velocity) = p.middleCols<3>(gyro);
    p.block<3, 3>(velocity, velocity) = p.block<3, 3>(gyro, gyro);
    p.block<3, 3>(velocity, velocity).diagonal().array() += square(options_.gyro_noise) / dt;
  }

  /// d (velocity of translation) / dt = -a - R g + w x v, with w, v the parts of the velocity.
  Eigen::Vector3d acceleration(const State& state, const ImuSample& sample) const {
    return state.accelerometer_bias - sample.acceleration_m_s2 -
           state.pose.rotation * options_.gravity_m_s2 +
           state.velocity.head<3>().cross(state.velocity.tail<3>());
  }

  void move(const Stretch& stretch, State& state) const {
    const double dt = stretch.duration_s;
    Covariance f = Covariance::Identity();
    Vector6 mean = state.velocity;
    if (reads_acceleration(stretch)) {
      const Eigen::Vector3d rate = acceleration(state, *stretch.imu);
      mean.tail<3>() += rate * dt / 2;
      differentiate_acceleration(state, dt, f);
      state.velocity.tail<3>() += rate * dt;
    }
    const Rigid3 increment = moved_pose(Rigid3{}, mean, dt);
    const Matrix6 by_velocity = dt * adjoint(moved_pose(Rigid3{}, mean, dt / 2));
    f.topLeftCorner<6, 6>() = adjoint(increment);
    f.block<6, 6>(0, velocity) = by_velocity;
    Matrix6 noise = Matrix6::Zero();
    if (const Step* step = stretch.odometry) {
      // The error of an odometry step is the sum of independent errors of its parts. The error of a
      // velocity would be common to them, so the noise of the step is added to the pose directly.
      noise = step->covariance * stretch.share;
      f.block<6, 6>(0, velocity).setZero();
      if (stretch.imu) {
        noise.topRows<3>().setZero();
        noise.leftCols<3>().setZero();
        f.block<6, 3>(0, velocity) = by_velocity.leftCols<3>();
      }
    }
    state.covariance = f * state.covariance * f.transpose();
    state.covariance.topLeftCorner<6, 6>() += noise;
    state.pose = increment * state.pose;
    if (!stretch.odometry) accelerate(stretch, state);
  }

  void differentiate_acceleration(const State& state, double dt, Covariance& f) const {
    const int v = velocity + 3;
    f.block<3, 3>(v, 0) = dt * skew(state.pose.rotation * options_.gravity_m_s2);
    f.block<3, 3>(v, velocity) = -dt * skew(state.velocity.tail<3>());
    f.block<3, 3>(v, v) += dt * skew(state.velocity.head<3>());
    f.block<3, 3>(v, accelerometer) = dt * Eigen::Matrix3d::Identity();
  }

  /// Adds the covariance of white acceleration, integrated once and twice.
  void accelerate(const Stretch& stretch, State& state) const {
    const double dt = stretch.duration_s;
    const double turn = stretch.imu ? 0 : options_.turn_acceleration_noise;
    const double shift =
        reads_acceleration(stretch) ? options_.accelerometer_noise : options_.acceleration_noise;
    Vector6 q;
    q << Eigen::Vector3d::Constant(square(turn)), Eigen::Vector3d::Constant(square(shift));
    Covariance& p = state.covariance;
    p.diagonal().head<6>() += q * (dt * dt * dt / 3);
    p.diagonal().segment<6>(velocity) += q * dt;
    for (int i = 0; i < 6; ++i) {
      p(i, velocity + i) += q[i] * (dt * dt / 2);
      p(velocity + i, i) += q[i] * (dt * dt / 2);
    }
  }

  PoseFilterOptions options_;
};

void require_pose(const Rigid3& pose, const char* name) {
  require(pose.rotation.allFinite() && pose.translation.allFinite(), name, pose.matrix(), "finite");
}

}  // namespace

class PoseFilter::Impl : public Replay<PoseModel> {
  using Replay::Replay;
};

void PoseFilterOptions::validate() const {
  const auto positive = [](double value, const char* name) {
    require(value > 0 && std::isfinite(value), name, value, "positive");
  };
  const auto not_negative = [](double value, const char* name) {
    require(value >= 0 && std::isfinite(value), name, value, "zero or positive");
  };
  not_negative(acceleration_noise, "acceleration_noise");
  not_negative(turn_acceleration_noise, "turn_acceleration_noise");
  not_negative(gyro_noise, "gyro_noise");
  positive(gyro_bias_sigma, "gyro_bias_sigma");
  not_negative(gyro_bias_walk, "gyro_bias_walk");
  not_negative(accelerometer_noise, "accelerometer_noise");
  positive(accelerometer_bias_sigma, "accelerometer_bias_sigma");
  not_negative(accelerometer_bias_walk, "accelerometer_bias_walk");
  require(gravity_m_s2.allFinite(), "gravity_m_s2", gravity_m_s2.transpose(), "finite");
  positive(imu_hold_s, "imu_hold_s");
  positive(start_speed_sigma_m_s, "start_speed_sigma_m_s");
  positive(start_turn_sigma_rad_s, "start_turn_sigma_rad_s");
  require(gate_sigma > 0, "gate_sigma", gate_sigma, "positive");
  positive(history_s, "history_s");
}

PoseFilter::PoseFilter(const PoseFilterOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(PoseModel(options), options.history_s, options.imu_hold_s);
}

PoseFilter::PoseFilter(PoseFilter&&) noexcept = default;
PoseFilter& PoseFilter::operator=(PoseFilter&&) noexcept = default;
PoseFilter::~PoseFilter() = default;

const PoseFilterOptions& PoseFilter::options() const { return impl_->model().options(); }

bool PoseFilter::started() const { return impl_->started(); }

void PoseFilter::start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance) {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  require_pose(body_from_world, "body_from_world");
  require(covariance.allFinite() && internal::core::is_positive_definite(covariance), "covariance",
          covariance, "positive definite");
  const PoseFilterOptions& o = options();
  PoseState state{time_s, body_from_world};
  state.covariance.setZero();
  state.covariance.topLeftCorner<6, 6>() = covariance;
  auto variances = state.covariance.diagonal();
  variances.segment<3>(velocity).setConstant(square(o.start_turn_sigma_rad_s));
  variances.segment<3>(velocity + 3).setConstant(square(o.start_speed_sigma_m_s));
  variances.segment<3>(gyro).setConstant(square(o.gyro_bias_sigma));
  variances.segment<3>(accelerometer).setConstant(square(o.accelerometer_bias_sigma));
  impl_->start(state);
}

FilterUpdate PoseFilter::add(const Odometry& step) {
  require(std::isfinite(step.from_s), "from_s", step.from_s, "finite");
  require(step.to_s > step.from_s && std::isfinite(step.to_s), "to_s", step.to_s,
          "finite and after from_s");
  require_pose(step.to_from_from, "to_from_from");
  require(step.covariance.allFinite() && step.covariance.diagonal().minCoeff() >= 0, "covariance",
          step.covariance, "finite, with variances that are not negative");
  return impl_->add(step);
}

FilterUpdate PoseFilter::add(const ImuSample& sample) {
  require(std::isfinite(sample.time_s), "time_s", sample.time_s, "finite");
  require(sample.turn_rate_rad_s.allFinite(), "turn_rate_rad_s", sample.turn_rate_rad_s.transpose(),
          "finite");
  require(sample.acceleration_m_s2.allFinite(), "acceleration_m_s2",
          sample.acceleration_m_s2.transpose(), "finite");
  return impl_->add(sample);
}

FilterUpdate PoseFilter::add(const PoseObservation& seen) {
  seen.validate();
  return impl_->add(seen);
}

std::optional<PoseEstimate> PoseFilter::at(double time_s) const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  const std::optional<PoseState> state = impl_->at(time_s);
  if (!state) return std::nullopt;
  PoseEstimate out;
  out.time_s = time_s;
  out.body_from_world = state->pose;
  out.covariance = state->covariance.topLeftCorner<6, 6>();
  out.velocity = state->velocity;
  out.velocity_covariance = state->covariance.block<6, 6>(velocity, velocity);
  out.gyro_bias_rad_s = state->gyro_bias;
  out.accelerometer_bias_m_s2 = state->accelerometer_bias;
  return out;
}

}  // namespace occ
