// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/pose_filter.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/track/internal/covariance_root.hpp"
#include "libocc/track/internal/replay.hpp"
#include "libocc/track/internal/root_update.hpp"
#include "libocc/track/internal/systematic_root.hpp"

namespace occ {

using namespace internal::track;
namespace {

// Order of the errors: pose and velocity, each [rotation, translation], biases.
constexpr int states = 18, velocity = 6, gyro = 12, accelerometer = 15;
using Root = Eigen::Matrix<double, states, states>;
// Rows of noise in one step: gyroscope, velocity and pose of odometry (or acceleration), biases.
using Stack = RootStack<states, 3 + 12 + 6>;

struct PoseState {
  double time_s = 0;
  Rigid3 pose;  // body_from_world
  Vector6 velocity = Vector6::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
  Root root = Root::Identity();  // of the covariance, see covariance_root.hpp
  SystematicRoot<states> systematic = {};
};

/// Covariance of six successive states.
Matrix6 covariance_in(const PoseState& state, int first) {
  Matrix6 covariance = covariance_of<6>(state.root, first);
  if (state.systematic.empty()) return covariance;
  const auto errors = state.systematic.rows.middleCols<6>(first);
  return covariance + errors.transpose() * errors;
}

class PoseModel {
 public:
  using State = PoseState;
  using Step = Odometry;
  using Stretch = Timeline<Step>::Stretch;

  explicit PoseModel(const PoseFilterOptions& options) : options_(options) {}

  const PoseFilterOptions& options() const { return options_; }

  void propagate(State& state, const Stretch& stretch) const {
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
    // Linearises about the observed pose instead of the prediction: where the two are far apart and
    // the image is precise, the posterior is close to the image.
    const Rigid3 observed = seen.cam_from_body.inverse() * seen.cam_from_world;
    const Vector6 off = difference(state.pose, observed);
    DataEquation<6> equation =
        data_equation(seen.information, seen.gradient, seen.gradient_by_systematic);
    equation.rows *= adjoint(seen.cam_from_body);
    equation.residuals += equation.rows * off;
    Root about_seen = state.root;
    about_seen.leftCols<6>() *= d_difference(off).transpose();
    if (!state.systematic.empty() || !seen.systematic.empty())
      return update_with_systematic(state, seen, observed, off, about_seen, equation);
    const RootUpdate<states, 6> corrected(about_seen, equation);
    const FilterUpdate update = gated(corrected, options_.gate_sigma);
    if (!update.accepted()) return update;
    const Vector6 left = off + corrected.step().head<6>();
    correct(state, perturb(observed, left), corrected.step());
    state.root.topRows<6>() = corrected.rows();
    state.root.topLeftCorner<6, 6>() *= internal::core::inverse(d_difference(left)).transpose();
    return update;
  }

 private:
  void propagate(State& state, const Stretch& stretch, Stack& stack) const {
    if (stretch.odometry) follow_odometry(*stretch.odometry, state, stack);
    if (stretch.imu) follow_gyro(*stretch.imu, stretch.duration_s, state, stack);
    move(stretch, state, stack);
    add_walks(stretch.duration_s, stack);
  }

  FilterUpdate update_with_systematic(State& state, const PoseObservation& seen,
                                      const Rigid3& observed, const Vector6& off, Root& about_seen,
                                      const DataEquation<6>& equation) const {
    SystematicRoot<states> errors = state.systematic;
    errors.rows.leftCols<6>() *= d_difference(off).transpose();
    errors.use(seen.systematic, about_seen);
    const SystematicUpdate corrected(about_seen, errors.rows, equation, seen.uncertain_systematic);
    const FilterUpdate update = gated(corrected, options_.gate_sigma);
    if (!update.accepted()) return update;
    const Vector6 left = off + corrected.step().head<6>();
    correct(state, perturb(observed, left), corrected.step());
    const Matrix6 back = internal::core::inverse(d_difference(left)).transpose();
    state.root = corrected.root();
    state.root.leftCols<6>() *= back;
    errors.rows = corrected.errors();
    errors.rows.leftCols<6>() *= back;
    state.systematic = std::move(errors);
    return update;
  }

  static void correct(State& state, const Rigid3& pose,
                      const Eigen::Matrix<double, states, 1>& step) {
    state.pose = pose;
    state.velocity += step.segment<6>(velocity);
    state.gyro_bias += step.segment<3>(gyro);
    state.accelerometer_bias += step.segment<3>(accelerometer);
  }

  bool reads_acceleration(const Stretch& stretch) const {
    return stretch.imu && !stretch.odometry && options_.use_accelerometer;
  }

  static void follow_odometry(const Step& step, State& state, Stack& stack) {
    const double dt = step.to_s - step.from_s;
    state.velocity = velocity_between(Rigid3{}, step.to_from_from, dt);
    stack.columns<6>(velocity).setZero();
    stack.append<6>().middleCols<6>(velocity) =
        internal::core::semidefinite_root(step.covariance) / dt;
  }

  /// Replaces the rotational velocity: body_from_world rotates at the negative rate of the body.
  void follow_gyro(const ImuSample& sample, double dt, State& state, Stack& stack) const {
    state.velocity.head<3>() = state.gyro_bias - sample.turn_rate_rad_s;
    stack.columns<3>(velocity) = stack.columns<3>(gyro);
    stack.append<3>().middleCols<3>(velocity).diagonal().setConstant(options_.gyro_noise /
                                                                     std::sqrt(dt));
  }

  /// d (velocity of translation) / dt = -a - R g + w x v, with w, v the parts of the velocity.
  Eigen::Vector3d acceleration(const State& state, const ImuSample& sample) const {
    return state.accelerometer_bias - sample.acceleration_m_s2 -
           state.pose.rotation * options_.gravity_m_s2 +
           state.velocity.head<3>().cross(state.velocity.tail<3>());
  }

  void move(const Stretch& stretch, State& state, Stack& stack) const {
    const double dt = stretch.duration_s;
    Vector6 mean = state.velocity;
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    if (reads_acceleration(stretch)) rate = acceleration(state, *stretch.imu);
    mean.tail<3>() += rate * dt / 2;
    const Rigid3 increment = moved_pose(Rigid3{}, mean, dt);
    const Matrix6 by_velocity = dt * adjoint(moved_pose(Rigid3{}, mean, dt / 2));
    auto pose = stack.columns<6>(0);
    Eigen::Matrix<double, Eigen::Dynamic, 6, 0, Stack::max_rows, 6> moved =
        pose.lazyProduct(adjoint(increment).transpose());
    // The error of an odometry step is the sum of independent errors of its parts. The error of a
    // velocity would be common to them, so the noise of the step is added to the pose directly.
    if (!stretch.odometry)
      moved += stack.columns<6>(velocity).lazyProduct(by_velocity.transpose());
    else if (stretch.imu)
      moved += stack.columns<3>(velocity).lazyProduct(by_velocity.leftCols<3>().transpose());
    if (reads_acceleration(stretch)) accelerate(state, dt, stack);
    pose = moved;
    state.velocity.tail<3>() += rate * dt;
    state.pose = increment * state.pose;
    if (stretch.odometry)
      add_odometry_noise(stretch, stack);
    else
      add_acceleration_noise(stretch, stack);
  }

  /// Propagates the error of the velocity of translation, which the accelerometer changes.
  void accelerate(const State& state, double dt, Stack& stack) const {
    const Eigen::Matrix3d by_rotation = dt * skew(state.pose.rotation * options_.gravity_m_s2);
    const Eigen::Matrix3d by_turn = -dt * skew(state.velocity.tail<3>());
    const Eigen::Matrix3d by_speed = dt * skew(state.velocity.head<3>());
    auto speed = stack.columns<3>(velocity + 3);
    const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, Stack::max_rows, 3> change =
        stack.columns<3>(0).lazyProduct(by_rotation.transpose()) +
        stack.columns<3>(velocity).lazyProduct(by_turn.transpose()) +
        speed.lazyProduct(by_speed.transpose()) + dt * stack.columns<3>(accelerometer);
    speed += change;
  }

  static void add_odometry_noise(const Stretch& stretch, Stack& stack) {
    Matrix6 noise = internal::core::semidefinite_root(stretch.odometry->covariance);
    if (stretch.imu) noise.leftCols<3>().setZero();
    stack.append<6>().leftCols<6>() = std::sqrt(stretch.share) * noise;
  }

  /// Adds white acceleration, integrated once and twice: variances q dt and q dt^3 / 3, covariance
  /// q dt^2 / 2.
  void add_acceleration_noise(const Stretch& stretch, Stack& stack) const {
    const double dt = stretch.duration_s;
    const double turn = stretch.imu ? 0 : options_.turn_acceleration_noise;
    const double shift =
        reads_acceleration(stretch) ? options_.accelerometer_noise : options_.acceleration_noise;
    Vector6 sigma;  // of the change of the velocity
    sigma << Eigen::Vector3d::Constant(turn), Eigen::Vector3d::Constant(shift);
    sigma *= std::sqrt(dt);
    auto common = stack.append<6>(), own = stack.append<6>();
    common.middleCols<6>(velocity).diagonal() = sigma;
    common.leftCols<6>().diagonal() = sigma * (dt / 2);
    own.leftCols<6>().diagonal() = sigma * (dt / std::sqrt(12.0));
  }

  void add_walks(double dt, Stack& stack) const {
    auto walk = stack.append<6>();
    walk.middleCols<3>(gyro).topRows<3>().diagonal().setConstant(options_.gyro_bias_walk *
                                                                 std::sqrt(dt));
    walk.middleCols<3>(accelerometer)
        .bottomRows<3>()
        .diagonal()
        .setConstant(options_.accelerometer_bias_walk * std::sqrt(dt));
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
  internal::core::require_positive_definite(covariance, "covariance");
  const PoseFilterOptions& o = options();
  PoseState state{time_s, body_from_world};
  state.root.setZero();
  state.root.topLeftCorner<6, 6>() = internal::core::semidefinite_root(covariance);
  auto sigmas = state.root.diagonal();
  sigmas.segment<3>(velocity).setConstant(o.start_turn_sigma_rad_s);
  sigmas.segment<3>(velocity + 3).setConstant(o.start_speed_sigma_m_s);
  sigmas.segment<3>(gyro).setConstant(o.gyro_bias_sigma);
  sigmas.segment<3>(accelerometer).setConstant(o.accelerometer_bias_sigma);
  impl_->start(state);
}

FilterUpdate PoseFilter::add(const Odometry& step) {
  require(std::isfinite(step.from_s), "from_s", step.from_s, "finite");
  require(step.to_s > step.from_s && std::isfinite(step.to_s), "to_s", step.to_s,
          "finite and after from_s");
  require_pose(step.to_from_from, "to_from_from");
  internal::core::require_semidefinite(step.covariance, "covariance");
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
  out.covariance = covariance_in(*state, 0);
  out.velocity = state->velocity;
  out.velocity_covariance = covariance_in(*state, velocity);
  out.gyro_bias_rad_s = state->gyro_bias;
  out.accelerometer_bias_m_s2 = state->accelerometer_bias;
  if (state->systematic.empty()) return out;
  out.systematic = state->systematic.numbers;
  out.by_systematic = state->systematic.rows.leftCols<6>().transpose();
  return out;
}

}  // namespace occ
