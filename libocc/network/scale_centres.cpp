// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/scale_centres.hpp"

#include <algorithm>
#include <optional>

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

std::size_t at(int index) { return static_cast<std::size_t>(index); }

bool is_free(const NetworkCamera& camera, const std::string& name) {
  const auto& free = camera.free_parameters;
  return std::find(free.begin(), free.end(), name) != free.end();
}

bool has_prior(const Network& network, std::size_t camera, const std::string& name) {
  return std::any_of(network.parameter_priors.begin(), network.parameter_priors.end(),
                     [&](const ParameterPrior& prior) {
                       return at(prior.camera) == camera && prior.parameter == name;
                     });
}

/// The height that a shift along the turntable's axis makes good; nothing when the axis tumbles.
std::optional<double> held_height(const Network& network, const NetworkState& state,
                                  std::size_t index) {
  const NetworkCamera& camera = network.cameras[index];
  std::optional<double> height;
  for (const CameraParameter& parameter : state.cameras[index].parameters()) {
    if (parameter.name == height_name) height = parameter.value;
    if (parameter.name.find("tumbling") == 0 &&
        (parameter.value != 0 || is_free(camera, parameter.name)))
      return std::nullopt;
  }
  if (height && is_free(camera, height_name) && !has_prior(network, index, height_name))
    return std::nullopt;
  return height;
}

/// Takes what is asked for first; what differs later is a conflict.
void ask(std::optional<Vector3d>& held, const Vector3d& wanted, double& conflict_m) {
  if (!held) held = wanted;
  conflict_m = std::max(conflict_m, (wanted - *held).norm());
}

}  // namespace

ScaleCentres scale_centres(const Network& network, const NetworkState& state) {
  ScaleCentres centres;
  centres.height_held.assign(network.cameras.size(), 0);
  std::vector<Vector3d> of_camera(network.cameras.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < network.cameras.size(); ++i)
    if (const auto height = held_height(network, state, i)) {
      centres.height_held[i] = 1;
      of_camera[i].z() = *height;
    }
  std::vector<std::optional<Vector3d>> stations(network.stations.size()),
      mounts(network.mounts.size());
  const auto free_mount = [&](const NetworkImage& image) {
    return image.mount >= 0 && !network.mounts[image.mount].fixed;
  };
  for (const NetworkImage& image : network.images) {
    if (free_mount(image)) continue;
    Vector3d wanted = of_camera[image.camera];
    if (image.mount >= 0) wanted = state.mounts[image.mount].inverse() * wanted;
    ask(stations[image.station], wanted, centres.conflict_m);
  }
  for (const NetworkImage& image : network.images) {
    if (!free_mount(image)) continue;
    const Vector3d station = stations[image.station].value_or(Vector3d::Zero());
    ask(mounts[image.mount], of_camera[image.camera] - state.mounts[image.mount].rotation * station,
        centres.conflict_m);
  }
  for (const auto& one : stations) centres.station.push_back(one.value_or(Vector3d::Zero()));
  for (const auto& one : mounts) centres.mount.push_back(one.value_or(Vector3d::Zero()));
  return centres;
}

}  // namespace occ::internal::network
