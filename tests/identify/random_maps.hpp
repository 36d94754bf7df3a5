// SPDX-License-Identifier: Apache-2.0
// Random maps of many lamps with views in which some lamps are hidden and some lights are false.
// Shared by tests and benchmarks.
#pragma once

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/identify.hpp"

namespace occ::maps {

struct Options {
  int lamps = 8;
  int visible = 6, hidden = 2, false_lights = 2;
  double noise_px = 0.5;
  double max_tilt_rad = 0.5235987755982988;
  double thickness_m = 0.5;  ///< maximum distance of a lamp below the ceiling
};

struct View {
  Scene scene;
  Rigid3 cam_from_world;
  std::vector<Blob> blobs;
  std::vector<int> lamp;  ///< lamp index of each blob; -1 for a false light
};

template <class T>
void shuffle(std::vector<T>& values, Random& random) {
  for (std::size_t i = values.size(); i > 1; --i)
    std::swap(values[i - 1],
              values[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
}

/// Lamps below a ceiling at 3 m, one for each 1.6 m^2.
inline Scene random_scene(Random& random, const Options& options) {
  const double side_m = std::sqrt(1.6 * options.lamps);
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  for (int i = 0; i < options.lamps; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.shape = LampShape::point;
    lamp.centre_m = {random.uniform(0, side_m), random.uniform(0, side_m),
                     3 - options.thickness_m * random.uniform()};
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// Pose 0.3 to 1.2 m above the floor, looking up with a random tilt and heading.
inline Rigid3 random_pose(Random& random, const Options& options) {
  const double side_m = std::sqrt(1.6 * options.lamps);
  const Eigen::Vector3d eye(random.uniform(0, side_m), random.uniform(0, side_m),
                            random.uniform(0.3, 1.2));
  const double tilt = options.max_tilt_rad * std::sqrt(random.uniform());
  const double way = 2 * pi * random.uniform(), turn = 2 * pi * random.uniform();
  const Eigen::Vector3d ahead(std::sin(tilt) * std::cos(way), std::sin(tilt) * std::sin(way),
                              std::cos(tilt));
  return look_at(eye, eye + ahead, Eigen::Vector3d(std::cos(turn), std::sin(turn), 0));
}

inline Blob spot(const Eigen::Vector2d& px, double sigma_px) {
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = 1e4;
  return blob;
}

/// Returns nothing if the number of lamps in view differs, or two lights are too close together.
inline std::optional<View> see(const Scene& scene, const Rigid3& pose, Random& random,
                               const Options& options) {
  constexpr double min_gap_px = 12;
  std::vector<std::pair<int, Eigen::Vector2d>> lights;
  for (int i = 0; i < options.lamps; ++i) {
    const auto px = scene.camera.project(pose * scene.lamps[i].centre_m);
    if (px && scene.camera.contains(*px)) lights.push_back({i, *px});
  }
  if (static_cast<int>(lights.size()) != options.visible + options.hidden) return std::nullopt;
  shuffle(lights, random);
  lights.resize(options.visible);
  for (int i = 0; i < options.false_lights; ++i)
    lights.push_back({-1, {random.uniform(0, 639), random.uniform(0, 479)}});
  for (std::size_t i = 0; i < lights.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((lights[i].second - lights[j].second).norm() < min_gap_px) return std::nullopt;
  shuffle(lights, random);
  View view{scene, pose, {}, {}};
  for (const auto& [lamp, px] : lights) {
    const Eigen::Vector2d noise(random.normal(), random.normal());
    view.blobs.push_back(spot(px + options.noise_px * noise, options.noise_px));
    view.lamp.push_back(lamp);
  }
  return view;
}

inline View random_view(Random& random, const Options& options) {
  constexpr int attempts = 200;  // poses tried on one map
  for (;;) {
    const Scene scene = random_scene(random, options);
    for (int i = 0; i < attempts; ++i)
      if (auto view = see(scene, random_pose(random, options), random, options)) return *view;
  }
}

/// A square grid of side x side lamps, 0.8 m apart, at a height of 3 m.
inline Scene grid(int side) {
  Scene scene;
  scene.camera = Camera::pinhole(480, 480, 400, 400, 239.5, 239.5);
  for (int i = 0; i < side * side; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.shape = LampShape::point;
    lamp.centre_m = {0.8 * (i % side), 0.8 * (i / side), 3};
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// Prior with the gravity measured by an accelerometer.
inline Prior gravity(const View& view, double sigma_rad, Random& random) {
  Prior prior;
  const Eigen::Vector3d error(random.normal(), random.normal(), random.normal());
  prior.gravity_in_cam =
      so3_exp(sigma_rad * error) * (view.cam_from_world.rotation * -Eigen::Vector3d::UnitZ());
  prior.gravity_sigma_rad = sigma_rad;
  return prior;
}

/// True if at least four blobs and all but one are assigned correctly, and the position error is
/// below 0.3 m.
inline bool is_right(const Hypothesis& hypothesis, const View& view) {
  int right = 0;
  for (const Match& match : hypothesis.matches) right += view.lamp[match.blob] == match.lamp;
  const Eigen::Vector3d off =
      hypothesis.cam_from_world.origin_in_source() - view.cam_from_world.origin_in_source();
  return right + 1 >= static_cast<int>(hypothesis.matches.size()) && right >= 4 && off.norm() < 0.3;
}

}  // namespace occ::maps
