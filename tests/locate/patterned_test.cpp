// SPDX-License-Identifier: Apache-2.0
// Luminaires of several bright parts, in a map of their outlines: louvred panels, pairs of tubes,
// and frames of light. The image shows each part as a lamp of its own.
#include <gtest/gtest.h>

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

struct Part {
  Eigen::Vector2d centre_m, size_m;  ///< along the luminaire's axes
};

using Parts = std::vector<Part>;

Parts louvre(int cells, double size_m, double bar_m) {
  Parts parts;
  const double pitch_m = size_m / cells;
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      const Eigen::Vector2d cell(i, j);
      parts.push_back(
          {pitch_m * (cell.array() + 0.5).matrix() - Eigen::Vector2d::Constant(0.5 * size_m),
           Eigen::Vector2d::Constant(pitch_m - bar_m)});
    }
  return parts;
}

Parts two_tubes(double length_m, double width_m, double apart_m) {
  return {{{0, -0.5 * apart_m}, {length_m, width_m}}, {{0, 0.5 * apart_m}, {length_m, width_m}}};
}

Parts frame(double size_m, double width_m) {
  const double off_m = 0.5 * (size_m - width_m);
  return {{{0, off_m}, {size_m, width_m}},
          {{0, -off_m}, {size_m, width_m}},
          {{off_m, 0}, {width_m, size_m - 2 * width_m}},
          {{-off_m, 0}, {width_m, size_m - 2 * width_m}}};
}

struct Rooms {
  Scene parts, outlines;
};

Rooms room_of(const Parts& parts) {
  Rooms rooms;
  rooms.outlines.camera = rooms.parts.camera = Camera::pinhole(800, 600, 420, 420, 399.5, 299.5);
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
  for (const Part& part : parts)
    half_m = half_m.cwiseMax(part.centre_m.cwiseAbs() + 0.5 * part.size_m);
  const Eigen::Vector3d places[] = {
      {1, 1.1, 0}, {2.9, 1.2, 0.5}, {1.2, 2.8, 1}, {2.6, 2.7, 1.7}, {1.9, 1.7, 2.2}};
  for (const Eigen::Vector3d& place : places) {  // x, y, direction
    Lamp lamp;
    lamp.shape = LampShape::rectangle;
    lamp.power_w = 20;
    lamp.id = static_cast<int>(rooms.outlines.lamps.size());
    lamp.centre_m << place.head<2>(), 3;
    lamp.x_axis << std::cos(place.z()), std::sin(place.z()), 0;
    lamp.size_m = 2 * half_m;
    rooms.outlines.lamps.push_back(lamp);
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(lamp.x_axis);
    for (const Part& part : parts) {
      Lamp bright = lamp;
      bright.id = static_cast<int>(rooms.parts.lamps.size());
      bright.centre_m += part.centre_m.x() * lamp.x_axis + part.centre_m.y() * across;
      bright.size_m = part.size_m;
      bright.power_w = 60 * part.size_m.prod();
      rooms.parts.lamps.push_back(bright);
    }
  }
  rooms.outlines.validate();
  rooms.parts.validate();
  return rooms;
}

struct Found {
  int ok = 0, wrong = 0;
  double worst_m = 0;
  double sigma_m = 0;  ///< mean standard deviation of the fixes that are ok
  std::string messages;
};

Found found_in(const Rooms& rooms, int images) {
  Found found;
  for (int i = 0; i < images; ++i) {
    Random random(static_cast<std::uint64_t>(i), 9);
    const Eigen::Vector3d at(random.uniform(1.5, 2.5), random.uniform(1.5, 2.5),
                             random.uniform(0, 0.4));
    const double turn = random.uniform(0, 2 * pi);
    const Rigid3 pose =
        look_at(at, {2 + random.uniform(-0.2, 0.2), 2, 3}, {std::sin(turn), std::cos(turn), 0.1});
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(i);
    const Result<Fix> fix =
        locate(simulate(rooms.parts, pose, options).image.view(), rooms.outlines);
    found.messages += "\n" + std::to_string(i) + ": " + to_string(fix.status) + ", " + fix.message;
    if (!fix.ok()) continue;
    ++found.ok;
    const Eigen::Vector3d off_m = fix->position_m - at;
    found.worst_m = std::max(found.worst_m, off_m.norm());
    found.sigma_m += std::sqrt(fix->position_covariance_m2.trace());
    found.messages += "; " + std::to_string(1e3 * off_m.norm()) + " mm off, sigma " +
                      std::to_string(1e3 * std::sqrt(fix->position_covariance_m2.trace())) +
                      ", rms " + std::to_string(fix->rms_px) + " px";
    found.wrong += test::nees(off_m, fix->position_covariance_m2) > 16.3;
  }
  found.sigma_m /= std::max(1, found.ok);
  return found;
}

void expect_located(const Parts& parts) {
  const Found found = found_in(room_of(parts), 12);
  EXPECT_GE(found.ok, 9) << found.messages;
  EXPECT_EQ(found.wrong, 0) << found.messages;
  EXPECT_LT(found.worst_m, 0.03) << found.messages;
  EXPECT_LT(found.sigma_m, 0.03) << found.messages;
  EXPECT_NE(found.messages.find("have bright parts with gaps"), std::string::npos);
}

TEST(Patterned, LouvresAreLocatedByTheirOutlines) {
  expect_located(louvre(4, 0.6, 0.025));
  expect_located(louvre(3, 0.6, 0.04));
}

TEST(Patterned, TwoTubesAreOneLuminaire) {
  expect_located(two_tubes(1.2, 0.04, 0.2));
  expect_located(two_tubes(0.6, 0.05, 0.15));
}

TEST(Patterned, FramesOfLightHaveACentre) {
  expect_located(frame(0.6, 0.05));
  expect_located(frame(0.6, 0.1));
}

// Tubes that the map has as lamps of their own are not joined.
TEST(Patterned, PartsInTheMapRemainLamps) {
  const Rooms rooms = room_of(two_tubes(0.6, 0.05, 0.15));
  const Found found = found_in({rooms.parts, rooms.parts}, 4);
  EXPECT_EQ(found.ok, 4) << found.messages;
  EXPECT_EQ(found.wrong, 0) << found.messages;
  EXPECT_EQ(found.messages.find("have bright parts with gaps"), std::string::npos);
}

}  // namespace
}  // namespace occ
