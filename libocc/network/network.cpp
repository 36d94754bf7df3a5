// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/network.hpp"

#include <algorithm>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"
#include "libocc/network/internal/free_parameter.hpp"

namespace occ {

namespace {

std::string item(const char* list, std::size_t index, const char* field = "") {
  return std::string(list) + "[" + std::to_string(index) + "]" + field;
}

void require_index(int index, std::size_t size, const std::string& name, const char* of) {
  if (index >= 0 && static_cast<std::size_t>(index) < size) return;
  require(false, name, index, "one of the " + std::to_string(size) + " " + of);
}

void require_pose(const Rigid3& pose, const std::string& name) {
  Rigid3::from_matrix(pose.matrix(), name.c_str());
}

void require_target(const Network& network, const Target& target, const std::string& name) {
  if (target.body < 0) return require_index(target.point, network.points.size(), name, "points");
  require(target.point < 0, name, target.point, "a point or a body's corner, not both");
  require_index(target.body, network.bodies.size(), name, "bodies");
  const Eigen::Index corners = network.bodies[target.body].corners_m.cols();
  require_index(target.corner, static_cast<std::size_t>(corners), name, "corners of its body");
}

void check_cameras(const Network& network) {
  for (std::size_t i = 0; i < network.cameras.size(); ++i) {
    const std::vector<CameraParameter> known = network.cameras[i].camera.parameters();
    const std::vector<std::string>& free = network.cameras[i].free_parameters;
    for (std::size_t k = 0; k < free.size(); ++k) {
      require(internal::network::parameter_columns(known, free[k]).has_value(),
              item("cameras", i, ".free_parameters"), free[k], "a parameter of its camera");
      const bool is_focal_length = free[k] == "fx_px" || free[k] == "fy_px";
      require(!is_focal_length || std::count(free.begin(), free.end(), common_focal_length) == 0,
              item("cameras", i, ".free_parameters"), free[k],
              "omitted if f_px, which moves both focal lengths, is listed");
      require(std::count(free.begin(), free.end(), free[k]) == 1,
              item("cameras", i, ".free_parameters"), free[k], "listed once");
    }
  }
}

void check_geometry(const Network& network) {
  for (std::size_t i = 0; i < network.stations.size(); ++i)
    require_pose(network.stations[i].station_from_world, item("stations", i));
  for (std::size_t i = 0; i < network.mounts.size(); ++i)
    require_pose(network.mounts[i].cam_from_station, item("mounts", i));
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    const NetworkPoint& point = network.points[i];
    require_finite(point.position_m, item("points", i));
    if (!point.outline) continue;
    const Eigen::Vector2d& size = point.outline->size_m;
    require_pose({point.outline->world_from_outline, point.position_m},
                 item("points", i, ".outline"));
    require(size.minCoeff() > 0 && size.allFinite(), item("points", i, ".outline.size_m"),
            size.transpose(), "positive");
    require(!point.outline->is_round || size[0] == size[1], item("points", i, ".outline.size_m"),
            size.transpose(), "two equal sizes of a round outline");
  }
  for (std::size_t i = 0; i < network.bodies.size(); ++i) {
    const NetworkBody& body = network.bodies[i];
    require(body.corners_m.cols() > 0, item("bodies", i, ".corners_m"), body.corners_m.cols(),
            "one corner or more");
    require_finite(body.corners_m, item("bodies", i, ".corners_m"));
    require_pose(body.world_from_body, item("bodies", i));
    require(body.scale > 0 && std::isfinite(body.scale), item("bodies", i, ".scale"), body.scale,
            "positive");
  }
}

void check_images(const Network& network) {
  for (std::size_t i = 0; i < network.images.size(); ++i) {
    const NetworkImage& image = network.images[i];
    require_index(image.camera, network.cameras.size(), item("images", i, ".camera"), "cameras");
    require_index(image.station, network.stations.size(), item("images", i, ".station"),
                  "stations");
    if (image.mount != -1)
      require_index(image.mount, network.mounts.size(), item("images", i, ".mount"), "mounts");
  }
}

/// True for a valid observation. It builds no texts, because there are many observations.
bool is_valid(const Network& network, const ImageObservation& observation) {
  const auto below = [](int index, std::size_t size) {
    return index >= 0 && static_cast<std::size_t>(index) < size;
  };
  const Target& target = observation.target;
  const bool exists = target.body < 0
                          ? below(target.point, network.points.size())
                          : target.point < 0 && below(target.body, network.bodies.size()) &&
                                target.corner >= 0 &&
                                target.corner < network.bodies[target.body].corners_m.cols();
  return exists && below(observation.image, network.images.size()) &&
         observation.pixel.allFinite() && observation.sigma_px.minCoeff() > 0 &&
         observation.sigma_px.allFinite();
}

void check_observations(const Network& network) {
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const ImageObservation& observation = network.observations[i];
    if (is_valid(network, observation)) continue;
    require_index(observation.image, network.images.size(), item("observations", i, ".image"),
                  "images");
    require_target(network, observation.target, item("observations", i, ".target"));
    require_finite(observation.pixel, item("observations", i, ".pixel"));
    require(observation.sigma_px.minCoeff() > 0 && observation.sigma_px.allFinite(),
            item("observations", i, ".sigma_px"), observation.sigma_px.transpose(), "positive");
  }
  for (std::size_t i = 0; i < network.distances.size(); ++i) {
    const DistanceObservation& known = network.distances[i];
    require_target(network, known.from, item("distances", i, ".from"));
    require_target(network, known.to, item("distances", i, ".to"));
    require(!(known.from == known.to), item("distances", i), network.name_of(known.to),
            "between two points");
    require(known.length_m > 0 && std::isfinite(known.length_m), item("distances", i, ".length_m"),
            known.length_m, "positive");
    require(known.sigma_m > 0 && std::isfinite(known.sigma_m), item("distances", i, ".sigma_m"),
            known.sigma_m, "positive");
  }
}

void check_outlines(const Network& network) {
  for (std::size_t i = 0; i < network.cameras.size(); ++i) {
    const NetworkCamera& camera = network.cameras[i];
    require(std::isfinite(camera.outline_growth_px), item("cameras", i, ".outline_growth_px"),
            camera.outline_growth_px, "finite");
    require(camera.outline_growth_sigma_px >= 0 && std::isfinite(camera.outline_growth_sigma_px),
            item("cameras", i, ".outline_growth_sigma_px"), camera.outline_growth_sigma_px,
            "zero or positive");
  }
  std::vector<char> has_outline(network.observations.size());
  for (std::size_t i = 0; i < network.outlines.size(); ++i) {
    const OutlineObservation& outline = network.outlines[i];
    const std::string name = item("outlines", i);
    require_index(outline.observation, network.observations.size(), name + ".observation",
                  "observations");
    require(!has_outline[outline.observation], name + ".observation", outline.observation,
            "that of one outline");
    has_outline[outline.observation] = 1;
    const ImageObservation& centre = network.observations[outline.observation];
    require(centre.target.body < 0 && network.points[centre.target.point].outline,
            name + ".observation", network.name_of(centre.target), "of a point with an outline");
    require_pose(outline.cam_from_outline, name + ".cam_from_outline");
    require(outline.size_m.minCoeff() > 0 && outline.size_m.allFinite(), name + ".size_m",
            outline.size_m.transpose(), "positive");
    const Eigen::Index count = outline.rows.rows();
    require(outline.rows.allFinite(), name + ".rows", count, "finite");
    require(outline.centre_rows.allFinite(), name + ".centre_rows", count, "finite");
    require(outline.constant.size() == count && outline.constant.allFinite(), name + ".constant",
            outline.constant.size(), "finite, one number for each row");
    const NetworkCamera& camera = network.cameras[network.images[centre.image].camera];
    const bool is_free = !camera.free_parameters.empty();
    const Eigen::Index parameters =
        is_free ? static_cast<Eigen::Index>(camera.camera.parameters().size()) : 0;
    const std::string rule =
        is_free ? "finite, one for each parameter of its camera" : "none: its camera is known";
    require(outline.by_camera.cols() == parameters &&
                (!is_free || outline.by_camera.rows() == count) && outline.by_camera.allFinite(),
            name + ".by_camera", outline.by_camera.cols(), rule);
    require(outline.camera_parameters.size() == parameters && outline.camera_parameters.allFinite(),
            name + ".camera_parameters", outline.camera_parameters.size(), rule);
  }
}

void check_control_and_priors(const Network& network) {
  for (std::size_t i = 0; i < network.control.size(); ++i) {
    require_target(network, network.control[i].target, item("control", i, ".target"));
    require_finite(network.control[i].position_m, item("control", i, ".position_m"));
    internal::core::require_positive_definite(network.control[i].covariance_m2,
                                              item("control", i, ".covariance_m2"));
  }
  for (std::size_t i = 0; i < network.parameter_priors.size(); ++i) {
    const ParameterPrior& prior = network.parameter_priors[i];
    require_index(prior.camera, network.cameras.size(), item("parameter_priors", i, ".camera"),
                  "cameras");
    const std::vector<std::string>& free = network.cameras[prior.camera].free_parameters;
    require(std::find(free.begin(), free.end(), prior.parameter) != free.end(),
            item("parameter_priors", i, ".parameter"), prior.parameter,
            "a free parameter of its camera");
    require(std::isfinite(prior.value), item("parameter_priors", i, ".value"), prior.value,
            "finite");
    require(prior.sigma > 0 && std::isfinite(prior.sigma), item("parameter_priors", i, ".sigma"),
            prior.sigma, "positive");
  }
  for (std::size_t i = 0; i < network.pose_priors.size(); ++i) {
    const PosePrior& prior = network.pose_priors[i];
    require_index(prior.station, network.stations.size(), item("pose_priors", i, ".station"),
                  "stations");
    require_pose(prior.station_from_world, item("pose_priors", i));
    internal::core::require_positive_definite(prior.covariance,
                                              item("pose_priors", i, ".covariance"));
  }
}

}  // namespace

Eigen::Vector3d Network::position_m(const Target& target) const {
  require_target(*this, target, "target");
  if (target.body < 0) return points[target.point].position_m;
  const NetworkBody& body = bodies[target.body];
  return body.world_from_body * Eigen::Vector3d(body.scale * body.corners_m.col(target.corner));
}

Rigid3 Network::cam_from_world(int image) const {
  require_index(image, images.size(), "image", "images");
  const auto& [name, camera, station, mount] = images[image];
  const Rigid3& station_from_world = stations[station].station_from_world;
  if (mount < 0) return station_from_world;
  return mounts[mount].cam_from_station * station_from_world;
}

std::string Network::name_of(const Target& target) const {
  require_target(*this, target, "target");
  if (target.body < 0) {
    const std::string& name = points[target.point].name;
    return name.empty() ? "point " + std::to_string(target.point) : name;
  }
  const std::string& name = bodies[target.body].name;
  return (name.empty() ? "body " + std::to_string(target.body) : name) + "." +
         std::to_string(target.corner);
}

int Network::add_image(const std::string& name, int camera, const Rigid3& cam_from_world) {
  stations.push_back({name, cam_from_world, false});
  images.push_back({name, camera, static_cast<int>(stations.size()) - 1, -1});
  return static_cast<int>(images.size()) - 1;
}

void check_network(const Network& network) {
  check_cameras(network);
  check_geometry(network);
  check_images(network);
  check_observations(network);
  check_outlines(network);
  check_control_and_priors(network);
}

}  // namespace occ
