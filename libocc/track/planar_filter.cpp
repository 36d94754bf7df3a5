// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/planar_filter.hpp"

#include <cmath>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/track/internal/covariance_root.hpp"
#include "libocc/track/internal/replay.hpp"
#include "libocc/track/internal/root_update.hpp"
#include "libocc/track/internal/systematic_root.hpp"

namespace occ {

using namespace internal::track;
namespace {

// Order of the state: pose along the axes of the world, velocity along those of the body, bias.
constexpr int states = 7, velocity = 3, bias = 6;
using Root = Eigen::Matrix<double, states, states>;
// Rows of noise in one step: gyroscope, velocity and pose of odometry (or acceleration), bias.
using Stack = RootStack<states, 1 + 6 + 1>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;

struct PlanarState {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double gyro_bias = 0;
  Root root = Root::Identity();  // of the covariance, see covariance_root.hpp
  SystematicRoot<states> systematic = {};
};

/// Covariance of three successive states.
Eigen::Matrix3d covariance_in(const PlanarState& state, int first) {
  Eigen::Matrix3d covariance = covariance_of<3>(state.root, first);
  if (state.systematic.empty()) return covariance;
  const auto errors = state.systematic.rows.middleCols<3>(first);
  return covariance + errors.transpose() * errors;
}

Eigen::Matrix3d world_from_body(const PlanarPose& pose) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() << pose.forward(), pose.left();
  return turn;
}

PlanarEstimate estimate_of(const PlanarState& state) {
  return {state.time_s,
          state.pose,
          covariance_in(state, 0),
          state.velocity,
          covariance_in(state, velocity),
          state.gyro_bias};
}

class PlanarModel {
 public:
  using State = PlanarState;
  using Step = PlanarOdometry;

  explicit PlanarModel(const PlanarFilterOptions& options) : options_(options) {}

  const PlanarFilterOptions& options() const { return options_; }

  void propagate(State& state, const Timeline<Step>::Stretch& stretch) const {
    if (!state.systematic.empty()) {
      // Systematic errors have the same transition and no noise.
      SystematicRoot<states> errors = std::exchange(state.systematic, {});
      State moved = state;
      Stack transition(Root::Identity());
      propagate(moved, stretch, transition);
      errors.rows *= transition.top();
      state.systematic = std::move(errors);
    }
    Stack stack(state.root);
    propagate(state, stretch, stack);
    state.root = stack.root();
  }

  FilterUpdate update(State& state, const PoseObservation& seen) const {
    if (!state.systematic.empty() || !seen.systematic.empty())
      return update_with_systematic(state, seen);
    const RootUpdate<states, 3> corrected(state.root, on_floor(state.pose, seen));
    const FilterUpdate update = gated(corrected, options_.gate_sigma);
    if (!update.accepted()) return update;
    correct(state, corrected.step());
    state.root.topRows<3>() = corrected.rows();
    return update;
  }

  /// Standard deviations of roll, pitch and height.
  Eigen::Vector3d floor_sigmas() const {
    return {options_.tilt_sigma_rad, options_.tilt_sigma_rad, options_.height_sigma_m};
  }

 private:
  void propagate(State& state, const Timeline<Step>::Stretch& stretch, Stack& stack) const {
    const double dt = stretch.duration_s;
    if (stretch.odometry) follow_wheels(*stretch.odometry, state, stack);
    if (stretch.imu) follow_gyro(*stretch.imu, dt, state, stack);
    move(stretch, state, stack);
    stack.append<1>()[bias] = options_.gyro_bias_walk * std::sqrt(dt);
  }

  FilterUpdate update_with_systematic(State& state, const PoseObservation& seen) const {
    SystematicRoot<states> errors = state.systematic;
    Root root = state.root;
    errors.use(seen.systematic, root);
    const SystematicUpdate corrected(root, errors.rows, on_floor(state.pose, seen),
                                     seen.uncertain_systematic);
    const FilterUpdate update = gated(corrected, options_.gate_sigma);
    if (!update.accepted()) return update;
    correct(state, corrected.step());
    state.root = corrected.root();
    errors.rows = corrected.errors();
    state.systematic = std::move(errors);
    return update;
  }

  static void correct(State& state, const Eigen::Matrix<double, states, 1>& step) {
    state.pose = {state.pose.x_m + step[0], state.pose.y_m + step[1],
                  wrapped_rad(state.pose.heading_rad + step[2])};
    state.velocity += step.segment<3>(velocity);
    state.gyro_bias += step[bias];
  }

  /// Eliminates roll, pitch and height, which scatter with the standard deviations of the floor.
  DataEquation<3> on_floor(const PlanarPose& pose, const PoseObservation& seen) const {
    const Rigid3 observed = seen.cam_from_body.inverse() * seen.cam_from_world;
    const Rigid3 predicted = body_from_world(pose, options_.height_m);
    DataEquation<6> equation =
        data_equation(seen.information, seen.gradient, seen.gradient_by_systematic);
    equation.rows *= adjoint(seen.cam_from_body);
    equation.residuals += equation.rows * difference(predicted, observed);
    const Matrix6 directions = planar_perturbation(pose);
    const Matrix63 across = directions.rightCols<3>() * floor_sigmas().asDiagonal();
    const Matrix63 along = directions.leftCols<3>();
    return eliminated(equation.rows * across, equation.rows * along, equation);
  }

  /// Replaces the velocity and its covariance by those of the wheels.
  static void follow_wheels(const Step& step, State& state, Stack& stack) {
    const double dt = step.to_s - step.from_s;
    state.velocity = planar_log(step.increment) / dt;
    stack.columns<3>(velocity).setZero();
    stack.append<3>().middleCols<3>(velocity) =
        internal::core::semidefinite_root(step.covariance) / dt;
  }

  void follow_gyro(const ImuSample& sample, double dt, State& state, Stack& stack) const {
    constexpr int turn = velocity + 2;
    state.velocity[2] = sample.turn_rate_rad_s.z() - state.gyro_bias;
    stack.columns<1>(turn) = -stack.columns<1>(bias);
    stack.append<1>()[turn] = options_.gyro_noise / std::sqrt(dt);
  }

  /// Moves the pose at the velocity of the state for the stretch and propagates the covariance.
  void move(const Timeline<Step>::Stretch& stretch, State& state, Stack& stack) const {
    const double dt = stretch.duration_s;
    const PlanarPose increment = planar_exp(state.velocity * dt);
    const PlanarPose half = state.pose * planar_exp(state.velocity * dt / 2);
    const PlanarPose next = state.pose * increment;
    auto pose = stack.columns<3>(0);
    pose.col(0) -= (next.y_m - state.pose.y_m) * pose.col(2);
    pose.col(1) += (next.x_m - state.pose.x_m) * pose.col(2);
    // The error of an odometry step is the sum of independent errors of its parts. The error of a
    // velocity would be common to them, so the noise of the step is added to the pose directly.
    // An error of the rotation rate also moves the end of the path, by half of its final angle.
    Eigen::Matrix3d by_velocity = world_from_body(half);
    by_velocity(0, 2) -= (next.y_m - state.pose.y_m) / 2;
    by_velocity(1, 2) += (next.x_m - state.pose.x_m) / 2;
    by_velocity *= dt;
    if (!stretch.odometry)
      pose += stack.columns<3>(velocity).lazyProduct(by_velocity.transpose());
    else if (stretch.imu)
      pose += stack.columns<1>(velocity + 2).lazyProduct(by_velocity.col(2).transpose());
    if (stretch.odometry)
      add_odometry_noise(stretch, state.pose, stack);
    else
      add_acceleration_noise(stretch, half, stack);
    state.pose = next;
  }

  static void add_odometry_noise(const Timeline<Step>::Stretch& stretch, const PlanarPose& pose,
                                 Stack& stack) {
    Eigen::Matrix3d noise = internal::core::semidefinite_root(stretch.odometry->covariance);
    if (stretch.imu) noise.col(2).setZero();
    stack.append<3>().leftCols<3>() =
        std::sqrt(stretch.share) * noise * world_from_body(pose).transpose();
  }

  /// Adds white acceleration, integrated once and twice: variances q dt and q dt^3 / 3, covariance
  /// q dt^2 / 2.
  void add_acceleration_noise(const Timeline<Step>::Stretch& stretch, const PlanarPose& half,
                              Stack& stack) const {
    const double dt = stretch.duration_s;
    const double turn = stretch.imu ? 0 : options_.turn_acceleration_noise;
    Eigen::Vector3d sigma(options_.acceleration_noise, options_.lateral_noise, turn);
    sigma *= std::sqrt(dt);  // of the change of the velocity
    const Eigen::Matrix3d in_world = sigma.asDiagonal() * world_from_body(half).transpose();
    auto common = stack.append<3>(), own = stack.append<3>();
    common.middleCols<3>(velocity).diagonal() = sigma;
    common.leftCols<3>() = in_world * (dt / 2);
    own.leftCols<3>() = in_world * (dt / std::sqrt(12.0));
  }

  PlanarFilterOptions options_;
};

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
  internal::core::require_positive_definite(covariance, "covariance");
  const double speed = options().start_speed_sigma_m_s;
  PlanarState state{time_s, pose};
  state.root.setZero();
  state.root.topLeftCorner<3, 3>() = internal::core::semidefinite_root(covariance);
  state.root.diagonal().segment<3>(velocity) << speed, speed, options().start_turn_sigma_rad_s;
  state.root(bias, bias) = options().gyro_bias_sigma;
  impl_->start(state);
}

FilterUpdate PlanarFilter::add(const PlanarOdometry& step) {
  require(std::isfinite(step.from_s), "from_s", step.from_s, "finite");
  require(step.to_s > step.from_s && std::isfinite(step.to_s), "to_s", step.to_s,
          "finite and after from_s");
  require(step.increment.finite(), "increment",
          Eigen::RowVector3d(step.increment.x_m, step.increment.y_m, step.increment.heading_rad),
          "finite");
  internal::core::require_semidefinite(step.covariance, "covariance");
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
  return estimate_of(*state);
}

std::optional<PosePrediction> PlanarFilter::predict(double time_s) const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  const std::optional<PlanarState> state = impl_->at(time_s);
  if (!state) return std::nullopt;
  const PlanarEstimate estimate = estimate_of(*state);
  PosePrediction out;
  out.time_s = time_s;
  out.body_from_world = body_from_world(estimate.pose, options().height_m);
  const Matrix6 directions = planar_perturbation(estimate.pose);
  const Matrix63 along = directions.leftCols<3>(), across = directions.rightCols<3>();
  const Matrix6 covariance =
      along * estimate.covariance * along.transpose() +
      across * impl_->model().floor_sigmas().cwiseAbs2().asDiagonal() * across.transpose();
  out.covariance = 0.5 * (covariance + covariance.transpose());
  const Eigen::Vector3d& v = estimate.velocity;
  out.velocity << 0, 0, -v[2], -v[0], -v[1], 0;
  Matrix63 rates = Matrix63::Zero();
  rates(2, 2) = rates(3, 0) = rates(4, 1) = -1;
  out.velocity_covariance = rates * estimate.velocity_covariance * rates.transpose();
  if (state->systematic.empty()) return out;
  out.systematic = state->systematic.numbers;
  out.by_systematic = along * state->systematic.rows.leftCols<3>().transpose();
  return out;
}

}  // namespace occ
