// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "libocc/network/internal/datum_directions.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

bool is_free(const NetworkCamera& camera, const std::string& name) {
  const auto& free = camera.free_parameters;
  return std::find(free.begin(), free.end(), name) != free.end();
}

bool has_prior(const Network& network, int camera, const std::string& name) {
  return std::any_of(network.parameter_priors.begin(), network.parameter_priors.end(),
                     [&](const ParameterPrior& prior) {
                       return prior.camera == camera && prior.parameter == name;
                     });
}

/// Known height e_z that a shift along the turntable's axis compensates; nothing when the axis
/// tumbles.
std::optional<double> compensated_height(const Network& network, const NetworkState& state,
                                         int index) {
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

/// Sets the centre at the first call; later calls record the distance of a different one.
void require_centre(std::optional<Vector3d>& centre, const Vector3d& required, double& conflict_m) {
  if (!centre) centre = required;
  conflict_m = std::max(conflict_m, (required - *centre).norm());
}

}  // namespace

ScaleCentres scale_centres(const Network& network, const NetworkState& state) {
  ScaleCentres centres;
  centres.height_compensated.assign(network.cameras.size(), 0);
  std::vector<Vector3d> of_camera(network.cameras.size(), Vector3d::Zero());
  for (int i = 0; i < static_cast<int>(network.cameras.size()); ++i)
    if (const auto height = compensated_height(network, state, i)) {
      centres.height_compensated[i] = 1;
      of_camera[i].z() = *height;
    }
  std::vector<std::optional<Vector3d>> stations(network.stations.size()),
      mounts(network.mounts.size());
  const auto free_mount = [&](const NetworkImage& image) {
    return image.mount >= 0 && !network.mounts[image.mount].fixed;
  };
  for (const NetworkImage& image : network.images) {
    if (free_mount(image)) continue;
    Vector3d required = of_camera[image.camera];
    if (image.mount >= 0) required = state.mounts[image.mount].inverse() * required;
    require_centre(stations[image.station], required, centres.conflict_m);
  }
  for (const NetworkImage& image : network.images) {
    if (!free_mount(image)) continue;
    const Vector3d station = stations[image.station].value_or(Vector3d::Zero());
    require_centre(mounts[image.mount],
                   of_camera[image.camera] - state.mounts[image.mount].rotation * station,
                   centres.conflict_m);
  }
  for (const auto& one : stations) centres.station.push_back(one.value_or(Vector3d::Zero()));
  for (const auto& one : mounts) centres.mount.push_back(one.value_or(Vector3d::Zero()));
  return centres;
}

}  // namespace occ::internal::network
