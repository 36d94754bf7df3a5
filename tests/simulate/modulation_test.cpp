// SPDX-License-Identifier: Apache-2.0
// Blinking lamps: ripple of pulse-width modulation, codes, arbitrary waveforms.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// A lamp that fills an image of many lines.
Scene lines_scene(double frequency_hz, double exposure_s) {
  Scene scene;
  scene.camera = Camera::pinhole(4, 4000, 50000, 50000, 1.5, 1999.5);
  scene.lamps = {disc_lamp(0, {0, 0, 2}, 1)};
  scene.lamps[0].frequency_hz = frequency_hz;
  scene.sensor.exposure_s = exposure_s;
  // A line time that covers all phases.
  scene.sensor.row_time_s = 0.6180339887 * 0.01 / frequency_hz;
  return scene;
}

// Light of each line, relative to the lamp while lit.
Eigen::VectorXd light_by_line(const Scene& scene, double start_s = 0) {
  Scene lit = scene;
  lit.lamps[0].frequency_hz.reset();
  lit.lamps[0].waveform.clear();
  const double peak_e = peak_electrons(scene, Rigid3{});
  const Eigen::MatrixXd steady = mean_electrons(lit, Rigid3{}, peak_e);
  const Eigen::MatrixXd seen = mean_electrons(scene, Rigid3{}, peak_e, noiseless(start_s));
  return (seen.row(1).array() / steady.row(1).array()).transpose();
}

TEST(Modulation, RippleOfPulseWidthModulationFollowsItsFormula) {
  for (const double periods : {0.3, 0.75, 1.0, 1.25, 2.5, 7.9})
    for (const double duty : {0.1, 0.5, 0.8}) {
      Scene scene = lines_scene(1000, periods / 1000);
      scene.lamps[0].duty = duty;
      const Eigen::VectorXd light = light_by_line(scene);
      const double part = periods - std::floor(periods);
      const double expected = std::min({part, 1 - part, duty, 1 - duty}) / periods;
      EXPECT_NEAR(light.maxCoeff() - light.minCoeff(), expected, 1e-4) << periods << ' ' << duty;
    }
}

TEST(Modulation, AnyWaveformIsItsMeanOverEachExposure) {
  const std::vector<double> waveform = {1, 0.2, 0, 0.7, 0.7, 0.1, 1};
  for (const double periods : {0.05, 0.6, 1.0, 3.3}) {
    Scene scene = lines_scene(500, periods / 500);
    scene.lamps[0].waveform = waveform;
    scene.lamps[0].phase = 0.37;
    const double start_s = 0.0123;
    const Eigen::VectorXd light = light_by_line(scene, start_s);
    for (int line = 0; line < 4000; line += 97) {
      const int instants = 20000;
      double sum = 0;
      for (int i = 0; i < instants; ++i) {
        const double time_s =
            start_s + line * scene.sensor.row_time_s + periods / 500 * (i + 0.5) / instants;
        const double at = time_s * 500 + 0.37;
        sum += waveform[static_cast<std::size_t>((at - std::floor(at)) * 7)];
      }
      EXPECT_NEAR(light[line], sum / instants, 2e-4) << periods << ' ' << line;
    }
  }
}

TEST(Modulation, ChipsOfACodeAreResolved) {
  // On-off keying with two lines per chip and a short exposure.
  const std::vector<double> code = {1, 0, 1, 1, 0, 0, 1, 0};
  Scene scene = lines_scene(1000 / 8.0, 1e-6);
  scene.sensor.row_time_s = 0.5e-3;
  scene.lamps[0].waveform = code;
  const Eigen::VectorXd light = light_by_line(scene, 0.25e-3);
  for (int line = 0; line < 4000; ++line)
    EXPECT_NEAR(light[line], code[line / 2 % 8], 1e-4) << line;
}

TEST(Modulation, BoundIsTheLargestRipple) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    Scene scene = lines_scene(1000, random.uniform(0.05, 4) / 1000);
    scene.lamps[0].duty = random.uniform(0.05, 1);
    if (i % 2)
      scene.lamps[0].waveform = {random.uniform(), random.uniform(), random.uniform(),
                                 random.uniform()};
    const Eigen::VectorXd light = light_by_line(scene);
    Scene steady = scene;
    steady.effects.set(Effect::modulation, Use::off);
    const Eigen::VectorXd mean = light_by_line(steady);
    const double ripple = (light - mean).cwiseAbs().maxCoeff();
    const RenderPlan plan = plan_render(scene, Rigid3{});
    Scene lit = scene;
    lit.lamps[0].frequency_hz.reset();
    lit.lamps[0].waveform.clear();
    const double full_dn = scene.sensor.gain_dn_per_e * peak_electrons(lit, Rigid3{}) / 1.1;
    const double bound = plan.effects[static_cast<std::size_t>(Effect::modulation)].bound_dn;
    EXPECT_LE(ripple * full_dn, bound * 1.001 + 1e-4 * full_dn);
    EXPECT_GE(ripple * full_dn, 0.9 * bound - 1e-3 * full_dn) << "more than the ripple";
  }
}

}  // namespace
