// SPDX-License-Identifier: Apache-2.0
// Small photogrammetric networks for the tests of adjustment, datum, precision and statistics.
#pragma once

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/internal/noisy_network.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/network/test_field.hpp"
#include "tests/support/support.hpp"

namespace occ {
using internal::network::noisy_network;
}

namespace occ::test {

inline Camera small_pinhole() {
  return Camera::pinhole(1280, 960, 1000, 1010, 645, 470, {-0.1, 0.05, 1e-3, -5e-4, 0.01});
}

inline std::vector<std::string> pinhole_parameters() {
  return {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2"};
}

inline Camera small_fisheye() {
  return Camera::fisheye(1200, 1200, 380, 381, 602, 597, {0.02, -0.004});
}

inline RotatingLine small_line() {
  RotatingLine line;
  line.width = 6000;
  line.height = 1500;
  line.c_px = 950;
  line.cy_px = 751.3;
  line.tilt_x_rad = 0.004;
  line.tilt_y_rad = -0.006;
  line.eccentricity_m = {0.02, -0.015, 0};
  line.k1 = 0.01;
  line.k2 = -0.004;
  return line;
}

/// Network of points within 3 x 3 x 2 m about (1, 2, 3) and stations around them that face the
/// cloud, with a random roll; each image observes all points that are in view.
inline Network cloud_network(const Camera& camera, const std::vector<std::string>& free,
                             int stations = 6, int points = 30, double sigma_px = 0.3) {
  Random random(11, 0);
  const Eigen::Vector3d middle(1, 2, 3);
  Network network;
  network.cameras.push_back({"camera", camera, free});
  for (int i = 0; i < points; ++i)
    network.points.push_back(
        {"p" + std::to_string(i),
         middle + Eigen::Vector3d(random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5),
                                  random.uniform(-1, 1)),
         false});
  const bool panorama = camera.kind() == CameraKind::rotating_line;
  for (int i = 0; i < stations; ++i) {
    const double around = 2 * pi * i / stations + 0.2;
    const double distance = panorama ? 3 + 0.4 * (i % 2) : 4.5 + 0.6 * (i % 3);
    const Eigen::Vector3d from =
        middle + Eigen::Vector3d(distance * std::cos(around), distance * std::sin(around),
                                 0.8 * (i % 2) - 0.2);
    Rigid3 pose = look_at(from, middle, Eigen::Vector3d::UnitZ());
    Eigen::Vector3d turn(0.05, -0.04, 1.5 * i);
    Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
    if (panorama) frame << 0, 0, 1, 1, 0, 0, 0, 1, 0;  // optical axis X, Z down
    const Rigid3 own{
        so3_exp(panorama ? Eigen::Vector3d(0.1, 0.15 * (i % 3 - 1), 1.5 * i) : turn) * frame,
        Eigen::Vector3d::Zero()};
    pose = own * pose;
    const int image = network.add_image("s" + std::to_string(i), 0, pose);
    for (int k = 0; k < points; ++k) {
      const auto pixel = camera.project(pose * network.points[k].position_m);
      if (pixel && camera.contains(*pixel))
        network.observations.push_back(
            {image, Target::of_point(k), *pixel, Eigen::Vector2d::Constant(sigma_px), true});
    }
  }
  return network;
}

inline Network pinhole_network(int stations = 6, int points = 30) {
  return cloud_network(small_pinhole(), pinhole_parameters(), stations, points);
}

inline Network line_network(int stations = 6, int points = 40) {
  return cloud_network(Camera::rotating_line(small_line()), paper_additional_parameters(), stations,
                       points);
}

/// Adds a square of known side with noise-free corners to all images that have it in view.
inline int add_tag(Network& network, const Rigid3& world_from_tag, double side,
                   bool scale_free = false) {
  const double h = side / 2;
  NetworkBody tag;
  tag.name = "tag " + std::to_string(network.bodies.size());
  tag.corners_m.resize(3, 4);
  tag.corners_m << -h, h, h, -h, -h, -h, h, h, 0, 0, 0, 0;
  tag.world_from_body = world_from_tag;
  tag.scale_free = scale_free;
  network.bodies.push_back(tag);
  const int body = static_cast<int>(network.bodies.size()) - 1;
  for (int image = 0; image < static_cast<int>(network.images.size()); ++image) {
    const Camera& camera = network.cameras[network.images[image].camera].camera;
    for (int k = 0; k < 4; ++k) {
      const Target target = Target::of_corner(body, k);
      const auto pixel = camera.project(network.cam_from_world(image) * network.position_m(target));
      if (pixel && camera.contains(*pixel))
        network.observations.push_back({image, target, *pixel, {0.3, 0.3}, true});
    }
  }
  return body;
}

inline void add_distance(Network& network, int from, int to, double sigma_m = 1e-4) {
  const Target a = Target::of_point(from), b = Target::of_point(to);
  network.distances.push_back(
      {a, b, (network.position_m(b) - network.position_m(a)).norm(), sigma_m, true});
}

/// Largest distance between the same points.
inline double worst_distance(const Network& a, const Network& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i)
    worst = std::max(worst, (a.points[i].position_m - b.points[i].position_m).norm());
  return worst;
}

inline AdjustOptions plain() {
  AdjustOptions options;
  options.robust = options.snooping = false;
  return options;
}

inline double parameter(const Network& network, const std::string& name, std::size_t camera = 0) {
  for (const CameraParameter& p : network.cameras[camera].camera.parameters())
    if (p.name == name) return p.value;
  ADD_FAILURE() << "no parameter " << name;
  return 0;
}

}  // namespace occ::test
