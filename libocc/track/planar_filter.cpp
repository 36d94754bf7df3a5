// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/planar_filter.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/track/internal/information_update.hpp"
#include "libocc/track/internal/replay.hpp"

namespace occ {

using namespace internal::track;
namespace {

// Order of the state: pose along the axes of the world, velocity along those of the body, bias.
constexpr int states = 7, velocity = 3, bias = 6;
using Covariance = Eigen::Matrix<double, states, states>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;

struct PlanarState {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double gyro_bias = 0;
  Covariance covariance = Covariance::Identity();
};

Eigen::Matrix3d world_from_body(const PlanarPose& pose) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << pose.forward(), pose.left();
  return turn;
}

class PlanarModel {
 public:
  using State = PlanarState;
  using Step = PlanarOdometry;

  explicit PlanarModel(const PlanarFilterOptions& options) : options_(options) {}

  const PlanarFilterOptions& options() const { return options_; }

  void propagate(State& state, const Timeline<Step>::Stretch& stretch) const {
    const double dt = stretch.duration_s;
    Covariance f = Covariance::Identity(), noise = Covariance::Zero();
    if (stretch.odometry) follow_wheels(*stretch.odometry, state, f, noise);
    if (stretch.imu) follow_gyro(*stretch.imu, dt, state, f, noise);
    state.covariance = f * state.covariance * f.transpose() + noise;
    move(stretch, state);
    state.covariance(bias, bias) += square(options_.gyro_bias_walk) * dt;
  }

  FilterUpdate update(State& state, const PoseObservation& seen) const {
    const PoseObservation body = seen.of_body();
    const Rigid3 predicted = body_from_world(state.pose, options_.height_m);
    const Vector6 gradient =
        body.gradient + body.information * difference(predicted, body.cam_from_world);
    const Matrix6 directions = planar_perturbation(state.pose);
    const Matrix63 along = directions.leftCols<3>(), across = directions.rightCols<3>();
    Eigen::Matrix3d own = across.transpose() * body.information * across;
    own.diagonal() += floor_variances().cwiseInverse();
    const Eigen::Matrix3d mixed = along.transpose() * body.information * across;
    const Eigen::LLT<Eigen::Matrix3d> eliminated(own);
    const Eigen::Matrix3d information =
        along.transpose() * body.information * along - mixed * eliminated.solve(mixed.transpose());
    const Eigen::Vector3d left =
        along.transpose() * gradient - mixed * eliminated.solve(across.transpose() * gradient);
    const InformationUpdate<states, 3> corrected(state.covariance, information, left);
    FilterUpdate update{FilterOutcome::accepted, corrected.nis(), corrected.dof()};
    if (update.nis_dof > 0 && update.nis > gate_chi2(options_.gate_sigma, update.nis_dof)) {
      update.outcome = FilterOutcome::gated;
      return update;
    }
    const Eigen::Matrix<double, states, 1> step = corrected.step();
    state.pose = {state.pose.x_m + step[0], state.pose.y_m + step[1],
                  wrapped_rad(state.pose.heading_rad + step[2])};
    state.velocity += step.segment<3>(velocity);
    state.gyro_bias += step[bias];
    state.covariance = corrected.covariance();
    return update;
  }

  /// Variances of roll, pitch and height.
  Eigen::Vector3d floor_variances() const {
    const double tilt = square(options_.tilt_sigma_rad);
    return {tilt, tilt, square(options_.height_sigma_m)};
  }

 private:
  /// Replaces the velocity and its covariance by those of the wheels.
  static void follow_wheels(const Step& step, State& state, Covariance& f, Covariance& noise) {
    const double dt = step.to_s - step.from_s;
    state.velocity = planar_log(step.increment) / dt;
    f.middleRows<3>(velocity).setZero();
    noise.block<3, 3>(velocity, velocity) = step.covariance / square(dt);
  }

  void follow_gyro(const ImuSample& sample, double dt, State& state, Covariance& f,
                   Covariance& noise) const {
    constexpr int turn = velocity + 2;
    state.velocity[2] = sample.turn_rate_rad_s.z() - state.gyro_bias;
    f.row(turn).setZero();
    f(turn, bias) = -1;
    noise.row(turn).setZero();
    noise.col(turn).setZero();
    noise(turn, turn) = square(options_.gyro_noise) / dt;
  }

  /// Moves the pose at the velocity of the state for the stretch and propagates the covariance.
  void move(const Timeline<Step>::Stretch& stretch, State& state) const {
    const double dt = stretch.duration_s;
    const PlanarPose increment = planar_exp(state.velocity * dt);
    const PlanarPose half = state.pose * planar_exp(state.velocity * dt / 2);
    const PlanarPose next = state.pose * increment;
    Covariance f = Covariance::Identity();
    f(0, 2) = -(next.y_m - state.pose.y_m);
    f(1, 2) = next.x_m - state.pose.x_m;
    // The error of an odometry step is the sum of independent errors of its parts. The error of a
    // velocity would be common to them, so the noise of the step is added to the pose directly.
    Eigen::Matrix3d by_velocity = world_from_body(half) * dt, noise = Eigen::Matrix3d::Zero();
    if (const Step* step = stretch.odometry) {
      by_velocity.leftCols<2>().setZero();
      noise = step->covariance * stretch.share;
      if (stretch.imu) {
        noise.row(2).setZero();
        noise.col(2).setZero();
      } else {
        by_velocity.setZero();
      }
    }
    f.block<3, 3>(0, velocity) = by_velocity;
    const Eigen::Matrix3d turn = world_from_body(state.pose);
    state.covariance = f * state.covariance * f.transpose();
    state.covariance.topLeftCorner<3, 3>() += turn * noise * turn.transpose();
    state.pose = next;
    if (!stretch.odometry) accelerate(stretch, half, state);
  }

  void accelerate(const Timeline<Step>::Stretch& stretch, const PlanarPose& half,
                  State& state) const {
    const double dt = stretch.duration_s;
    Eigen::Vector3d q(square(options_.acceleration_noise), square(options_.lateral_noise),
                      square(options_.turn_acceleration_noise));
    if (stretch.imu) q[2] = 0;
    const Eigen::Matrix3d turn = world_from_body(half);
    const Eigen::Matrix3d in_world = turn * q.asDiagonal() * turn.transpose();
    const Eigen::Matrix3d mixed = turn * q.asDiagonal() * (dt * dt / 2);
    state.covariance.topLeftCorner<3, 3>() += in_world * (dt * dt * dt / 3);
    state.covariance.block<3, 3>(0, velocity) += mixed;
    state.covariance.block<3, 3>(velocity, 0) += mixed.transpose();
    state.covariance.block<3, 3>(velocity, velocity).diagonal() += q * dt;
  }

  PlanarFilterOptions options_;
};

void require_variances(const Eigen::Matrix3d& covariance, const char* name) {
  require(covariance.allFinite() && covariance.diagonal().minCoeff() >= 0, name, covariance,
          "finite, with variances that are not negative");
}

}  // namespace

class PlanarFilter::Impl : public Replay<PlanarModel> {
  using Replay::Replay;
};

void PlanarFilterOptions::validate() const {
  require(std::isfinite(height_m), "height_m", height_m, "finite");
  const auto positive = [](double value, const char* name) {
    require(value > 0 && std::isfinite(value), name, value, "positive");
  };
  const auto not_negative = [](double value, const char* name) {
    require(value >= 0 && std::isfinite(value), name, value, "zero or positive");
  };
  positive(height_sigma_m, "height_sigma_m");
  positive(tilt_sigma_rad, "tilt_sigma_rad");
  not_negative(acceleration_noise, "acceleration_noise");
  not_negative(lateral_noise, "lateral_noise");
  not_negative(turn_acceleration_noise, "turn_acceleration_noise");
  not_negative(gyro_noise, "gyro_noise");
  positive(gyro_bias_sigma, "gyro_bias_sigma");
  not_negative(gyro_bias_walk, "gyro_bias_walk");
  positive(imu_hold_s, "imu_hold_s");
  positive(start_speed_sigma_m_s, "start_speed_sigma_m_s");
  positive(start_turn_sigma_rad_s, "start_turn_sigma_rad_s");
  require(gate_sigma > 0, "gate_sigma", gate_sigma, "positive");
  positive(history_s, "history_s");
}

PlanarFilter::PlanarFilter(const PlanarFilterOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(PlanarModel(options), options.history_s, options.imu_hold_s);
}

PlanarFilter::PlanarFilter(PlanarFilter&&) noexcept = default;
PlanarFilter& PlanarFilter::operator=(PlanarFilter&&) noexcept = default;
PlanarFilter::~PlanarFilter() = default;

const PlanarFilterOptions& PlanarFilter::options() const { return impl_->model().options(); }

bool PlanarFilter::started() const { return impl_->started(); }

void PlanarFilter::start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  require(pose.finite(), "pose", Eigen::RowVector3d(pose.x_m, pose.y_m, pose.heading_rad),
          "finite");
  require(covariance.allFinite() && internal::core::is_positive_definite(covariance), "covariance",
          covariance, "positive definite");
  const double speed = square(options().start_speed_sigma_m_s);
  PlanarState state{time_s, pose};
  state.covariance.setZero();
  state.covariance.topLeftCorner<3, 3>() = covariance;
  state.covariance.diagonal().segment<3>(velocity) << speed, speed,
      square(options().start_turn_sigma_rad_s);
  state.covariance(bias, bias) = square(options().gyro_bias_sigma);
  impl_->start(state);
}

FilterUpdate PlanarFilter::add(const PlanarOdometry& step) {
  require(std::isfinite(step.from_s), "from_s", step.from_s, "finite");
  require(step.to_s > step.from_s && std::isfinite(step.to_s), "to_s", step.to_s,
          "finite and after from_s");
  require(step.increment.finite(), "increment",
          Eigen::RowVector3d(step.increment.x_m, step.increment.y_m, step.increment.heading_rad),
          "finite");
  require_variances(step.covariance, "covariance");
  return impl_->add(step);
}

FilterUpdate PlanarFilter::add(const ImuSample& sample) {
  require(std::isfinite(sample.time_s), "time_s", sample.time_s, "finite");
  require(std::isfinite(sample.turn_rate_rad_s.z()), "turn_rate_rad_s",
          sample.turn_rate_rad_s.transpose(), "finite");
  return impl_->add(sample);
}

FilterUpdate PlanarFilter::add(const PoseObservation& seen) {
  seen.validate();
  return impl_->add(seen);
}

std::optional<PlanarEstimate> PlanarFilter::at(double time_s) const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  const std::optional<PlanarState> state = impl_->at(time_s);
  if (!state) return std::nullopt;
  return PlanarEstimate{time_s,
                        state->pose,
                        state->covariance.topLeftCorner<3, 3>(),
                        state->velocity,
                        state->covariance.block<3, 3>(velocity, velocity),
                        state->gyro_bias};
}

std::optional<PosePrediction> PlanarFilter::predict(double time_s) const {
  const std::optional<PlanarEstimate> estimate = at(time_s);
  if (!estimate) return std::nullopt;
  PosePrediction out;
  out.time_s = time_s;
  out.body_from_world = body_from_world(estimate->pose, options().height_m);
  const Matrix6 directions = planar_perturbation(estimate->pose);
  const Matrix63 along = directions.leftCols<3>(), across = directions.rightCols<3>();
  out.covariance = along * estimate->covariance * along.transpose() +
                   across * impl_->model().floor_variances().asDiagonal() * across.transpose();
  const Eigen::Vector3d& v = estimate->velocity;
  out.velocity << 0, 0, -v[2], -v[0], -v[1], 0;
  Matrix63 rates = Matrix63::Zero();
  rates(2, 2) = rates(3, 0) = rates(4, 1) = -1;
  out.velocity_covariance = rates * estimate->velocity_covariance * rates.transpose();
  return out;
}

}  // namespace occ
