// SPDX-License-Identifier: Apache-2.0
// Rooms that an independent path tracer rendered, with their truth (JSON, which is YAML). They are
// not part of the project: where they are absent, the tests that read them are skipped.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::test {

struct RenderedRoom {
  std::string name;
  Scene scene;
  Image image;
  Rigid3 cam_from_world;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::vector<int> whole_lamps;  ///< ids of the lamps entirely in view
};

/// Returns the truth files in a folder of the extra data whose names start with `prefix`, sorted;
/// empty if they are absent.
inline std::vector<std::filesystem::path> truth_files(const std::string& folder,
                                                      const std::string& prefix) {
  std::vector<std::filesystem::path> found;
  const std::filesystem::path root = std::filesystem::path(LIBOCC_EXTRA_DATA) / folder;
  if (!std::filesystem::exists(root)) return found;
  for (const auto& entry : std::filesystem::directory_iterator(root))
    if (entry.path().extension() == ".json" &&
        entry.path().filename().string().rfind(prefix, 0) == 0)
      found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

inline std::vector<std::filesystem::path> rendered_rooms(const std::string& prefix) {
  return truth_files("rendered", prefix);
}

inline Eigen::Vector3d vector3(const YAML::Node& node) {
  return {node[0].as<double>(), node[1].as<double>(), node[2].as<double>()};
}

/// Returns camera, sensor and lamps of the truth. Exposure and lamp power are chosen so that a lamp
/// on the optical axis gives the grey level that the truth states.
inline RenderedRoom read_rendered_room(const std::filesystem::path& json) {
  const YAML::Node truth = YAML::LoadFile(json.string());
  RenderedRoom room;
  room.name = json.stem().string();
  room.image = read_image((json.parent_path() / truth["image"].as<std::string>()).string());
  const auto number = [&](const char* key) { return truth[key].as<double>(); };
  room.scene.camera =
      Camera::pinhole(truth["width"].as<int>(), truth["height"].as<int>(), number("fx_px"),
                      number("fy_px"), number("cx_px"), number("cy_px"));
  Sensor& sensor = room.scene.sensor;
  sensor.pixel_pitch_m = number("pixel_pitch_m");
  sensor.psf_sigma_px = number("psf_sigma_px");
  sensor.gain_dn_per_e = 1 / number("electrons_per_dn");
  sensor.read_noise_e = number("read_noise_e");
  sensor.black_level_dn = number("black_level_dn");
  sensor.full_well_e = 1e6;  // these images clip at full scale
  const double radiance = number("radiance_w_m2_sr");
  const double on_axis_w_m2 = pi / 4 * radiance / (sensor.f_number * sensor.f_number);
  const double on_axis_e =
      (number("dn_of_on_axis_lamp") - sensor.black_level_dn) / sensor.gain_dn_per_e;
  sensor.exposure_s *= on_axis_e / sensor.electrons(on_axis_w_m2);

  for (const YAML::Node& node : truth["lamps"]) {
    Lamp lamp;
    lamp.id = node["id"].as<int>();
    lamp.centre_m = vector3(node["centre_m"]);
    lamp.centre_m.z() -= 0.001;  // the emitting face hangs 1 mm below the listed height
    lamp.radius_m = node["radius_m"].as<double>();
    lamp.normal = vector3(node["normal"]);
    lamp.half_power_rad = node["half_power_deg"].as<double>() * pi / 180;
    lamp.power_w = pi * lamp.area_m2() * radiance;  // of a lamp of uniform radiance
    room.scene.lamps.push_back(lamp);
  }
  for (const YAML::Node& id : truth["visible_lamps"]) room.whole_lamps.push_back(id.as<int>());
  for (int row = 0; row < 3; ++row)
    room.cam_from_world.rotation.row(row) =
        vector3(truth["cam_from_world_rotation"][row]).transpose();
  room.cam_from_world.translation = vector3(truth["cam_from_world_translation_m"]);
  room.position_m = vector3(truth["camera_position_m"]);
  return room;
}

}  // namespace occ::test
