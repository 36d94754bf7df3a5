// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/test_field.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/internal/noisy_network.hpp"
#include "libocc/network/precision.hpp"

namespace occ {

using internal::network::noisy_network;

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double min_range_m = 0.5;  // nearer targets are not observed

Vector3d gaussian(Random& random) {
  const double x = random.normal(), y = random.normal();
  return {x, y, random.normal()};
}

/// A position on a wall or the ceiling, and the surface's normal into the room.
struct Place {
  Vector3d position, normal;
};

Place place_on_surface(const TestFieldDesign& design, bool ceiling, Random& random) {
  const Vector3d& room = design.room_m;
  const double height = room.z() - design.lowest_target_m;
  const double walls_m2 = 2 * (room.x() + room.y()) * height;
  const double ceiling_m2 = ceiling ? room.x() * room.y() : 0;
  const double area_m2 = random.uniform(0, walls_m2 + ceiling_m2);
  const double u = random.uniform(), v = random.uniform();
  if (area_m2 >= walls_m2) return {{u * room.x(), v * room.y(), room.z()}, {0, 0, -1}};
  const double z = design.lowest_target_m + v * height;
  const double along = area_m2 / height;
  if (along < room.x()) return {{u * room.x(), 0, z}, {0, 1, 0}};
  if (along < 2 * room.x()) return {{u * room.x(), room.y(), z}, {0, -1, 0}};
  if (along < 2 * room.x() + room.y()) return {{0, u * room.y(), z}, {1, 0, 0}};
  return {{room.x(), u * room.y(), z}, {-1, 0, 0}};
}

Rigid3 station_pose(const TestFieldDesign& design, int index, Random& random) {
  Vector3d position = 0.5 * design.room_m;
  position.z() =
      design.station_height_m + (index % 2 == 0 ? -0.5 : 0.5) * design.station_height_step_m;
  const double around = index == 0 ? 0 : 2 * pi * (index - 0.5) / std::max(1, design.stations - 1);
  if (index > 0)
    position.head<2>() += 0.5 * Eigen::Vector2d(std::cos(around), std::sin(around))
                                    .cwiseProduct(design.station_ring)
                                    .cwiseProduct(design.room_m.head<2>());
  const Vector3d tilt(random.uniform(-1, 1), random.uniform(-1, 1), 0);
  const double heading = random.uniform(0, 2 * pi);
  Matrix3d upright = so3_exp(Vector3d(0, 0, -heading));
  if (design.camera.kind() == CameraKind::rotating_line ||
      design.camera.kind() == CameraKind::rotating_line_first_order)
    upright = Vector3d(1, -1, -1).asDiagonal() * upright;  // rows downwards, columns to the right
  else                                                     // a frame camera: Z horizontal, Y down
    upright = (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished() * upright;
  const Matrix3d rotation = so3_exp(design.station_tilt_rad * tilt) * upright;
  return {rotation, -(rotation * position)};
}

NetworkBody tag_on(const Place& place, double side, const std::string& name, Random& random) {
  NetworkBody tag;
  tag.name = name;
  const double half = 0.5 * side;
  tag.corners_m.resize(3, 4);
  tag.corners_m << -half, half, half, -half, -half, -half, half, half, 0, 0, 0, 0;
  const Vector3d z = place.normal;
  const Vector3d x = (std::abs(z.z()) > 0.5 ? Vector3d::UnitX() : Vector3d::UnitZ()).cross(z);
  Matrix3d rotation;
  rotation << x.normalized(), z.cross(x).normalized(), z;
  tag.world_from_body = {rotation * so3_exp(Vector3d(0, 0, random.uniform(-0.1, 0.1))),
                         place.position};
  return tag;
}

void add_observations(const TestFieldDesign& design, Network& network) {
  std::vector<Target> targets;
  for (std::size_t i = 0; i < network.points.size(); ++i)
    targets.push_back(Target::of_point(static_cast<int>(i)));
  for (std::size_t i = 0; i < network.bodies.size(); ++i)
    for (int k = 0; k < 4; ++k) targets.push_back(Target::of_corner(static_cast<int>(i), k));
  for (int image = 0; image < static_cast<int>(network.images.size()); ++image)
    for (const Target& target : targets) {
      const Vector3d x = network.cam_from_world(image) * network.position_m(target);
      if (x.norm() < min_range_m) continue;
      const auto pixel = design.camera.project(x);
      if (pixel && design.camera.contains(*pixel))
        network.observations.push_back({image, target, *pixel, design.sigma_px, true});
    }
}

Network true_network(const TestFieldDesign& design) {
  Network truth;
  truth.cameras.push_back({"camera", design.camera, design.free_parameters});
  Random random(design.seed, 1);
  for (int i = 0; i < design.targets; ++i)
    truth.points.push_back({"target " + std::to_string(i),
                            place_on_surface(design, design.ceiling, random).position, false});
  Random tags(design.seed, 2);
  for (int i = 0; i < design.tags; ++i)
    truth.bodies.push_back(tag_on(place_on_surface(design, false, tags), design.tag_side_m,
                                  "tag " + std::to_string(i), tags));
  Random stations(design.seed, 3);
  for (int i = 0; i < design.stations; ++i)
    truth.add_image("S" + std::to_string(i), 0, station_pose(design, i, stations));
  add_observations(design, truth);
  return truth;
}

/// Adds a scale bar near the middle of the room: two targets, their distance and observations.
void add_bar(const TestFieldDesign& design, const ScaleSource& source, int index,
             Network& network) {
  const double heading = pi * (index + 0.3) / std::max(1, source.bars);
  Vector3d middle = 0.5 * design.room_m;
  middle.head<2>() += Eigen::Vector2d(0.11, 0.13).cwiseProduct(design.room_m.head<2>());
  middle.z() = design.station_height_m;
  const Vector3d half = 0.5 * source.bar_m * Vector3d(std::cos(heading), std::sin(heading), 0);
  const int first = static_cast<int>(network.points.size());
  network.points.push_back({"bar " + std::to_string(index) + " a", middle - half, false});
  network.points.push_back({"bar " + std::to_string(index) + " b", middle + half, false});
  for (int image = 0; image < static_cast<int>(network.images.size()); ++image)
    for (int k = 0; k < 2; ++k) {
      const Target target = Target::of_point(first + k);
      const auto pixel =
          design.camera.project(network.cam_from_world(image) * network.position_m(target));
      if (pixel && design.camera.contains(*pixel))
        network.observations.push_back({image, target, *pixel, design.sigma_px, true});
    }
  network.distances.push_back(
      {Target::of_point(first), Target::of_point(first + 1), source.bar_m, source.bar_sigma_m});
}

/// The pair of unused points whose distance is nearest to a length.
std::pair<int, int> pair_at_distance(const Network& network, double length, int points,
                                     const std::vector<char>& used) {
  std::pair<int, int> best{0, 1};
  double smallest_error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < points; ++i)
    for (int j = i + 1; j < points; ++j) {
      if (used[i] || used[j]) continue;
      const double error =
          std::abs((network.points[i].position_m - network.points[j].position_m).norm() - length);
      if (error < smallest_error) {
        smallest_error = error;
        best = {i, j};
      }
    }
  return best;
}

}  // namespace

void TestFieldDesign::validate() const {
  require(room_m.minCoeff() > 0 && room_m.allFinite(), "room_m", room_m.transpose(), "positive");
  require(stations >= 1, "stations", stations, "at least 1");
  require(targets >= 0 && tags >= 0 && targets + tags > 0, "targets", targets,
          "at least one target or tag");
  require(tag_side_m > 0, "tag_side_m", tag_side_m, "positive");
  require(lowest_target_m >= 0 && lowest_target_m < room_m.z(), "lowest_target_m", lowest_target_m,
          "below the ceiling");
  require(station_height_m > 0 && station_height_m < room_m.z(), "station_height_m",
          station_height_m, "in the room");
  require(station_ring.minCoeff() >= 0 && station_ring.maxCoeff() < 1, "station_ring",
          station_ring.transpose(), "in [0, 1)");
  require(sigma_px.minCoeff() > 0 && sigma_px.allFinite(), "sigma_px", sigma_px.transpose(),
          "positive");
  require(start_error_m >= 0 && std::isfinite(start_error_m), "start_error_m", start_error_m,
          "zero or positive");
}

Camera paper_panorama_camera() {
  RotatingLine line;
  line.width = 31416;
  line.height = 10200;
  line.c_px = 35e-3 / 8e-6;
  line.cy_px = 0.5 * (line.height - 1);
  return Camera::rotating_line(line);
}

std::vector<std::string> paper_additional_parameters() {
  return {
      "angle_per_px_rad", "c_px", "cy_px", "tilt_x_rad", "tilt_y_rad", "ex_m", "ey_m", "k1", "k2"};
}

TestField simulate_test_field(const TestFieldDesign& design) {
  design.validate();
  TestField field;
  field.truth = true_network(design);
  check_network(field.truth);
  field.network = noisy_network(field.truth, design.seed, design.start_error_m);
  return field;
}

Network internal::network::noisy_network(const Network& truth, std::uint64_t seed,
                                         double start_error_m) {
  require(start_error_m >= 0 && std::isfinite(start_error_m), "start_error_m", start_error_m,
          "zero or positive");
  Network network = truth;
  Random noise(seed, 4);
  for (ImageObservation& observation : network.observations) {
    const double x = noise.normal();
    observation.pixel +=
        Eigen::Vector2d(observation.sigma_px.x() * x, observation.sigma_px.y() * noise.normal());
  }
  for (DistanceObservation& distance : network.distances)
    distance.length_m = (truth.position_m(distance.to) - truth.position_m(distance.from)).norm() +
                        distance.sigma_m * noise.normal();
  if (start_error_m == 0) return network;
  Random start(seed, 5);
  constexpr double rotation_per_m = 0.2;
  for (NetworkPoint& point : network.points)
    if (!point.fixed) point.position_m += start_error_m * gaussian(start);
  const auto move = [&](Rigid3& pose) {
    Vector6 error;
    error.head<3>() = rotation_per_m * start_error_m * gaussian(start);
    error.tail<3>() = start_error_m * gaussian(start);
    pose = perturb(pose, error);
  };
  for (NetworkStation& station : network.stations)
    if (!station.fixed) move(station.station_from_world);
  for (NetworkBody& body : network.bodies)
    if (!body.fixed) {
      body.world_from_body.rotation =
          so3_exp(rotation_per_m * start_error_m * gaussian(start)) * body.world_from_body.rotation;
      body.world_from_body.translation += start_error_m * gaussian(start);
    }
  return network;
}

Result<std::vector<ScalePrediction>> compare_scale(const TestFieldDesign& design,
                                                   const std::vector<ScaleSource>& sources) {
  design.validate();
  Result<std::vector<ScalePrediction>> result;
  for (const ScaleSource& source : sources) {
    TestFieldDesign one = design;
    one.tags = source.tags;
    one.tag_side_m = source.tag_side_m;
    Network network = true_network(one);
    std::vector<char> used(network.points.size());
    for (int k = 0; k < source.distances; ++k) {
      const auto [a, b] = pair_at_distance(network, source.distance_m, design.targets, used);
      used[a] = used[b] = 1;
      const Target from = Target::of_point(a), to = Target::of_point(b);
      network.distances.push_back({from, to,
                                   (network.position_m(to) - network.position_m(from)).norm(),
                                   source.distance_sigma_m});
    }
    for (int k = 0; k < source.bars; ++k) add_bar(design, source, k, network);
    const Result<Precision> predicted = precision(network);
    if (!predicted.ok()) {
      result.status = predicted.status;
      result.message = source.name + ": " + predicted.message;
      return result;
    }
    ScalePrediction prediction;
    prediction.name = source.name;
    prediction.scale_sigma = predicted->scale_sigma();
    double sum = 0;
    const std::vector<Matrix3d> points = predicted->points();
    for (int i = 0; i < design.targets; ++i) sum += points[i].trace();
    prediction.point_sigma_m = std::sqrt(sum / std::max(1, design.targets));
    const auto [a, b] = pair_at_distance(network, 10, design.targets, used);
    prediction.at_10_m_sigma_m =
        predicted->distance_sigma_m(Target::of_point(a), Target::of_point(b));
    result.value.push_back(prediction);
  }
  return result;
}

}  // namespace occ
