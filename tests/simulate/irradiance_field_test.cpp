// SPDX-License-Identifier: Apache-2.0
// Irradiance of the pixels of a lamp's image, interpolated between nodes.
#include "libocc/simulate/internal/irradiance_field.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libocc/formation/light.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using internal::simulate::IrradianceField;

/// Field of 50 by 37 pixels.
PatchOf<float> field_of(const Lamp& lamp, const Camera& camera, const Sensor& sensor) {
  PatchOf<float> field;
  field.x0 = 295;
  field.y0 = 222;
  field.width = 50;
  field.height = 37;
  IrradianceField(widest_simd()).fill(lamp, {}, camera, sensor, field);
  return field;
}

TEST(IrradianceField, IsThatOfEveryPixel) {
  const Camera camera = test::vga_camera();
  const Sensor sensor;
  Lamp lamp = test::disc_lamp(0, {0, 0, 2}, 0.08);
  lamp.normal = Eigen::Vector3d(0.5, -0.3, -0.8).normalized();
  const PatchOf<float> field = field_of(lamp, camera, sensor);
  EXPECT_GE(field.width, 50);
  ASSERT_EQ(field.height, 37);
  double low = 1e9, high = 0;
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const double expected =
          irradiance_at(lamp, {}, camera, sensor, Eigen::Vector2d(295 + x, 222 + y));
      EXPECT_NEAR(field.values[static_cast<std::size_t>(y * field.width + x)], expected,
                  1e-5 * expected);
      low = std::min(low, expected);
      high = std::max(high, expected);
    }
  EXPECT_GT(high, 1.005 * low);
}

TEST(IrradianceField, IsThatOfTheCentreWhereTheLitSideIsNotSeen) {
  const Camera camera = test::vga_camera();
  const Sensor sensor;
  Lamp lamp = test::disc_lamp(0, {0, 0, 2}, 0.08);
  // Rays with x / z above 0.02, ten pixels right of the centre, do not meet the lit side.
  lamp.normal = Eigen::Vector3d(1, 0, -0.02).normalized();
  const double at_centre = irradiance_at(lamp, {}, camera, sensor, {319.5, 239.5});
  EXPECT_GT(at_centre, 0);
  const PatchOf<float> field = field_of(lamp, camera, sensor);
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) {
      const int column = 295 + x;
      const double expected =
          column > 329 ? at_centre
                       : irradiance_at(lamp, {}, camera, sensor, Eigen::Vector2d(column, 222 + y));
      EXPECT_NEAR(field.values[static_cast<std::size_t>(y * field.width + x)], expected,
                  1e-5 * expected)
          << x;
    }
}

}  // namespace
}  // namespace occ
