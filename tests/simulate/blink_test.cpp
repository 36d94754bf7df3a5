// SPDX-License-Identifier: Apache-2.0
// Blinking lamps under rolling and global shutters.
#include <cmath>

#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// A lamp that fills the image and blinks.
Scene blinking_scene(double frequency_hz, double duty) {
  Scene scene;
  scene.camera = Camera::pinhole(60, 80, 5000, 5000, 29.5, 39.5);
  scene.lamps = {disc_lamp(0, {0, 0, 2}, 1)};
  scene.lamps[0].frequency_hz = frequency_hz;
  scene.lamps[0].duty = duty;
  scene.sensor.exposure_s = 130e-6;
  scene.sensor.row_time_s = 20e-6;
  return scene;
}

// Signal of each pixel, relative to the signal of the same lamp always lit.
Eigen::MatrixXd modulation(const Scene& scene, double start_s = 0) {
  Scene lit = scene;
  for (Lamp& lamp : lit.lamps) lamp.frequency_hz.reset();
  const double peak = 1.1 * mean_electrons(lit, Rigid3{}, 3e4).maxCoeff();
  const Eigen::MatrixXd steady = mean_electrons(lit, Rigid3{}, peak);
  return (mean_electrons(scene, Rigid3{}, peak, noiseless(start_s)).array() / steady.array());
}

// Lit fraction of an exposure, counted over many instants.
double lit_share(const Lamp& lamp, double begin_s, double length_s) {
  const int instants = 20000;
  int lit = 0;
  for (int i = 0; i < instants; ++i) {
    const double periods = (begin_s + length_s * (i + 0.5) / instants) * *lamp.frequency_hz;
    lit += periods - std::floor(periods) < lamp.duty;
  }
  return static_cast<double>(lit) / instants;
}

TEST(RollingShutter, EveryLineIsTheMeanOverItsExposure) {
  for (const Readout readout : {Readout::rows, Readout::columns})
    for (const double frequency_hz : {300.0, 2100.0, 9000.0})
      for (const double start_s : {0.0, 1.2345, -0.7}) {
        Scene scene = blinking_scene(frequency_hz, 0.3);
        scene.sensor.readout = readout;
        const Eigen::MatrixXd seen = modulation(scene, start_s);
        for (int line = 0; line < 60; line += 3) {
          const double truth =
              lit_share(scene.lamps[0], start_s + line * 20e-6, scene.sensor.exposure_s);
          for (const int along : {0, 30, 59}) {
            const double value = readout == Readout::rows ? seen(along, line) : seen(line, along);
            EXPECT_NEAR(value, truth, 2e-4) << frequency_hz << ' ' << start_s << ' ' << line;
          }
        }
      }
}

TEST(RollingShutter, StripesHaveTheLampsPeriodAndPhase) {
  // 1 kHz and rows of 20 us give 50 rows per period. With a short exposure, rows 0 ... 24 are lit.
  Scene scene = blinking_scene(1000, 0.5);
  scene.sensor.exposure_s = 1e-6;
  const Eigen::MatrixXd seen = modulation(scene);
  for (int row = 0; row < 80; ++row) EXPECT_NEAR(seen(10, row), row % 50 < 25 ? 1 : 0, 1e-3) << row;
  const Eigen::MatrixXd later = modulation(scene, 5 * 20e-6);
  for (int row = 0; row + 5 < 80; ++row) EXPECT_NEAR(later(10, row), seen(10, row + 5), 1e-3);
}

TEST(RollingShutter, UnknownReadoutIsRenderedAsRows) {
  Scene scene = blinking_scene(1000, 0.5);
  const Image rows = simulate(scene, Rigid3{}).image;
  scene.sensor.readout = Readout::unknown;
  EXPECT_EQ(simulate(scene, Rigid3{}).image.u8, rows.u8);
}

TEST(RollingShutter, AnExposureOfWholePeriodsHasNoStripes) {
  Scene scene = blinking_scene(2000, 0.4);
  scene.sensor.exposure_s = 3 / 2000.0;
  const Eigen::MatrixXd seen = modulation(scene, 0.01234);
  EXPECT_NEAR(seen.minCoeff(), 0.4, 2e-4);
  EXPECT_NEAR(seen.maxCoeff(), 0.4, 2e-4);
}

TEST(RollingShutter, ALampThatIsAlwaysOnHasNoStripes) {
  const Eigen::MatrixXd seen = modulation(blinking_scene(1000, 1));
  EXPECT_NEAR(seen.minCoeff(), 1, 1e-6);
}

TEST(GlobalShutter, AllRowsShareOneExposure) {
  Scene scene = blinking_scene(1000, 0.5);
  scene.sensor.row_time_s = 0;
  for (const double start_s : {0.0, 0.45e-3, 0.7e-3}) {
    const Eigen::MatrixXd seen = modulation(scene, start_s);
    const double truth = lit_share(scene.lamps[0], start_s, scene.sensor.exposure_s);
    if (truth == 0) {
      EXPECT_EQ(seen.maxCoeff(), 0);
      continue;
    }
    EXPECT_NEAR(seen.minCoeff(), truth, 2e-4);
    EXPECT_NEAR(seen.maxCoeff(), truth, 2e-4);
  }
}

TEST(RollingShutter, TruthCountsTheElectronsInTheImage) {
  Scene scene = blinking_scene(1000, 0.5);
  const Eigen::MatrixXd electrons = mean_electrons(scene, Rigid3{}, 300);
  EXPECT_NEAR(simulate(scene, Rigid3{}).lamps[0].electrons / electrons.sum(), 1, 1e-4);
}

}  // namespace
