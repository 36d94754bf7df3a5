// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/smoother.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"
#include "libocc/smooth/internal/chain_result.hpp"
#include "libocc/smooth/internal/chain_search.hpp"
#include "libocc/smooth/internal/odometry_pieces.hpp"

namespace occ {

using namespace internal::smooth;

void SmootherFrame::validate() const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  require(cam_from_body.rotation.allFinite() && cam_from_body.translation.allFinite(),
          "cam_from_body", cam_from_body.matrix(), "finite");
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const PointSighting& seen = sightings[i];
    const std::string name = "sightings[" + std::to_string(i) + "]";
    require(seen.point_in_world.allFinite(), name + ".point_in_world",
            seen.point_in_world.transpose(), "finite");
    require(seen.px.allFinite(), name + ".px", seen.px.transpose(), "finite");
    internal::core::require_positive_definite(seen.covariance_px2, name + ".covariance_px2");
    internal::core::require_semidefinite(seen.point_covariance_m2, name + ".point_covariance_m2");
  }
}

void SmootherOptions::validate() const {
  require(huber_sigmas >= 0 && std::isfinite(huber_sigmas), "huber_sigmas", huber_sigmas,
          "at least 0");
  require(link_gate >= 0 && link_gate < 1, "link_gate", link_gate, "in [0, 1)");
  require(min_odometry_sigma_m >= 0 && std::isfinite(min_odometry_sigma_m), "min_odometry_sigma_m",
          min_odometry_sigma_m, "at least 0");
  require(min_odometry_sigma_rad >= 0 && std::isfinite(min_odometry_sigma_rad),
          "min_odometry_sigma_rad", min_odometry_sigma_rad, "at least 0");
  for (const auto& [name, value] :
       {std::pair{"mount_sigma_rad", mount_sigma_rad}, std::pair{"mount_sigma_m", mount_sigma_m},
        std::pair{"clock_sigma_s", clock_sigma_s}})
    require(value >= 0 && std::isfinite(value), name, value, "at least 0");
  require(walk_m > 0, "walk_m", walk_m, "positive");
  require(walk_rad > 0, "walk_rad", walk_rad, "positive");
  require(max_iterations > 0, "max_iterations", max_iterations, "positive");
}

void PlanarPrior::validate() const {
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  require(pose.finite(), "pose", Eigen::RowVector3d(pose.x_m, pose.y_m, pose.heading_rad),
          "finite");
  internal::core::require_positive_definite(covariance, "covariance");
}

namespace {

/// Validates all items; messages contain the name of the list. Times must not decrease.
template <class T>
void check_list(const std::vector<T>& list, const std::string& name) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string place = name + "[" + std::to_string(i) + "]";
    try {
      list[i].validate();
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(place + "." + error.what());
    }
    if (i > 0)
      require(list[i].time_s >= list[i - 1].time_s, place + ".time_s", list[i].time_s,
              "no earlier than the one before");
  }
}

template <class Body, class Piece>
OdometryPieces<Body> checked_odometry(const std::vector<Piece>& odometry) {
  OdometryPieces<Body> pieces;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    const std::string place = "odometry[" + std::to_string(i) + "]";
    OdometryPieces<Body>::validate(odometry[i], place);
    require(odometry[i].from_s >= pieces.end_s() - same_time_s, place + ".from_s",
            odometry[i].from_s, "no earlier than the end of the one before");
    pieces.add(odometry[i]);
  }
  return pieces;
}

/// Node of a time; `nodes` are sorted and contain it.
template <class Body>
Node<Body>& node_at(Chain<Body>& chain, double time_s) {
  return *std::lower_bound(chain.nodes.begin(), chain.nodes.end(), time_s - same_time_s,
                           [](const Node<Body>& node, double time) { return node.time_s < time; });
}

template <class Body>
void add_nodes(Chain<Body>& chain, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  for (const double time_s : times) {
    if (!chain.nodes.empty() && time_s - chain.nodes.back().time_s <= same_time_s) continue;
    chain.nodes.emplace_back();
    chain.nodes.back().time_s = time_s;
  }
}

template <class Body, class Input>
Chain<Body> chain_of(const Body& body, const Input& input, std::vector<double> times,
                     const SmootherOptions& options) {
  options.validate();
  check_list(input.frames, "frames");
  check_list(input.observations, "observations");
  const OdometryPieces<Body> pieces = checked_odometry<Body>(input.odometry);
  for (const auto& frame : input.frames) times.push_back(frame.time_s);
  for (const auto& seen : input.observations) times.push_back(seen.time_s);
  require(!times.empty(), "frames", "none", "at least one");
  Chain<Body> chain;
  chain.body = body;
  add_nodes(chain, std::move(times));
  ErrorNumbers numbers;
  for (const auto& frame : input.frames)
    node_at(chain, frame.time_s).views.emplace_back(frame, options, numbers);
  for (const auto& seen : input.observations)
    node_at(chain, seen.time_s).readings.push_back(reading_of(seen, numbers));
  for (std::size_t k = 0; k + 1 < chain.nodes.size(); ++k) {
    const double from_s = chain.nodes[k].time_s, to_s = chain.nodes[k + 1].time_s;
    const auto step = pieces.between(from_s, to_s);
    chain.links.push_back(step ? made_link<Body>(*step, from_s, to_s, true, options)
                               : walk_link<Body>(from_s, to_s, options));
  }
  if (options.clock_sigma_s > 0) chain.set_velocities();
  return chain;
}

template <class Body>
Result<Smoothing<typename Body::Smoothed>> smoothed(Chain<Body> chain,
                                                    const std::vector<typename Body::Pose>& start,
                                                    const SmootherOptions& options) {
  if (!start.empty())
    require(start.size() == chain.nodes.size(), "start", start.size(),
            "as long as there are poses, " + std::to_string(chain.nodes.size()));
  for (std::size_t k = 0; k < start.size(); ++k)
    require(Body::finite(start[k]), "start[" + std::to_string(k) + "]", "a number that is not",
            "finite");
  return to_result(minima_of(std::move(chain), start, options));
}

}  // namespace

Result<Smoothing<SmoothedPose>> smooth(const SmootherInput& input, const SmootherOptions& options) {
  auto chain = chain_of(SpatialBody{}, input, {}, options);
  return smoothed(std::move(chain), input.start, options);
}

Result<Smoothing<SmoothedPlanarPose>> smooth_planar(const PlanarSmootherInput& input,
                                                    const SmootherOptions& options) {
  require(std::isfinite(input.height_m), "height_m", input.height_m, "finite");
  check_list(input.priors, "priors");
  std::vector<double> times;
  for (const PlanarPrior& prior : input.priors) times.push_back(prior.time_s);
  PlanarBody body;
  body.height_m = input.height_m;
  auto chain = chain_of(body, input, times, options);
  for (const PlanarPrior& prior : input.priors)
    node_at(chain, prior.time_s)
        .priors.push_back(quadratic<PlanarPose, 3>(prior.pose, prior.covariance.inverse(),
                                                   Eigen::Vector3d::Zero()));
  return smoothed(std::move(chain), input.start, options);
}

}  // namespace occ
