// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/window_smoother.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/smooth/internal/chain_window.hpp"

namespace occ {

using namespace internal::smooth;
namespace {

template <class Body>
auto with_frame(ChainWindow<Body>& window, const SmootherFrame& frame) {
  frame.validate();
  const View view(frame, window.options(), window.numbers());
  return window.add(frame.time_s, [&](Node<Body>& node) { node.views.push_back(view); });
}

template <class Body>
auto with_observation(ChainWindow<Body>& window, const PoseObservation& seen) {
  seen.validate();
  const auto reading = reading_of(seen, window.numbers());
  return window.add(seen.time_s, [&](Node<Body>& node) { node.readings.push_back(reading); });
}

PlanarBody at_height(double height_m) {
  require(std::isfinite(height_m), "height_m", height_m, "finite");
  PlanarBody body;
  body.height_m = height_m;
  return body;
}

}  // namespace

void WindowOptions::validate() const {
  require(poses >= 2, "poses", poses, "at least 2");
  smoothing.validate();
}

struct WindowSmoother::State {
  ChainWindow<SpatialBody> window;
};

WindowSmoother::WindowSmoother(const WindowOptions& options)
    : state_(new State{{SpatialBody{}, options}}) {}
WindowSmoother::~WindowSmoother() = default;
WindowSmoother::WindowSmoother(WindowSmoother&&) noexcept = default;
WindowSmoother& WindowSmoother::operator=(WindowSmoother&&) noexcept = default;

bool WindowSmoother::add_odometry(const Odometry& odometry) {
  return state_->window.add_odometry(odometry);
}

WindowSmoother::Estimate WindowSmoother::add_frame(const SmootherFrame& frame) {
  return with_frame(state_->window, frame);
}

WindowSmoother::Estimate WindowSmoother::add_observation(const PoseObservation& observation) {
  return with_observation(state_->window, observation);
}

void WindowSmoother::restart() { state_->window.restart(); }

struct PlanarWindowSmoother::State {
  ChainWindow<PlanarBody> window;
};

PlanarWindowSmoother::PlanarWindowSmoother(const WindowOptions& options, double height_m)
    : state_(new State{{at_height(height_m), options}}) {}
PlanarWindowSmoother::~PlanarWindowSmoother() = default;
PlanarWindowSmoother::PlanarWindowSmoother(PlanarWindowSmoother&&) noexcept = default;
PlanarWindowSmoother& PlanarWindowSmoother::operator=(PlanarWindowSmoother&&) noexcept = default;

bool PlanarWindowSmoother::add_odometry(const PlanarOdometry& odometry) {
  return state_->window.add_odometry(odometry);
}

PlanarWindowSmoother::Estimate PlanarWindowSmoother::add_frame(const SmootherFrame& frame) {
  return with_frame(state_->window, frame);
}

PlanarWindowSmoother::Estimate PlanarWindowSmoother::add_observation(
    const PoseObservation& observation) {
  return with_observation(state_->window, observation);
}

PlanarWindowSmoother::Estimate PlanarWindowSmoother::add_prior(const PlanarPrior& prior) {
  prior.validate();
  return state_->window.add(prior.time_s, [&](Node<PlanarBody>& node) {
    node.priors.push_back(
        quadratic<PlanarPose, 3>(prior.pose, prior.covariance.inverse(), Eigen::Vector3d::Zero()));
  });
}

void PlanarWindowSmoother::restart() { state_->window.restart(); }

}  // namespace occ
