// SPDX-License-Identifier: Apache-2.0
// The memory of a tracker does not grow over an hour of video, odometry and inertial samples.
#include <fstream>

#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// Resident memory of the process [KiB].
long resident_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmRSS:") continue;
    long kib = 0;
    status >> kib;
    return kib;
  }
  return 0;
}

Rigid3 pose_at(double time_s) {
  const Rigid3 camera = look_at({0, 0, 0.4}, {0, 0, 1}, {0, 1, 0});
  return camera *
         body_from_world({1.8 + 0.5 * std::sin(0.4 * time_s), 2 + 0.3 * std::sin(0.7 * time_s), 0});
}

/// Growth of memory from the first part to the end of a stream with some dark images.
long growth_kib(int frames, int first) {
  const Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
  Renderer renderer(scene);
  Rendered rendered;
  Tracker tracker(scene);
  Image black;
  black.width = 640;
  black.height = 480;
  black.u8.resize(640 * 480);
  long before = 0;
  for (int i = 0; i < frames; ++i) {
    const double time_s = i / 30.0;
    SimulateOptions options;
    options.frame = static_cast<std::uint32_t>(i);
    options.noise_area = NoiseArea::around_lamps;
    for (int k = 0; k < 3; ++k) {
      ImuSample sample;
      sample.time_s = time_s + 0.01 * k;
      sample.acceleration_m_s2 =
          pose_at(time_s).rotation *
          Eigen::Vector3d(-0.08 * std::sin(0.4 * time_s), -0.15 * std::sin(0.7 * time_s), 9.80665);
      tracker.add(sample);
    }
    const bool dark = i % 900 >= 400 && i % 900 < 430;
    if (!dark) renderer.render(pose_at(time_s), options, rendered);
    const TrackedFrame frame =
        tracker.add_image(dark ? black.view() : rendered.image.view(), time_s);
    EXPECT_NE(frame.state, TrackerState::searching) << i << ' ' << frame.reason;
    if (i == first) before = resident_kib();
  }
  EXPECT_EQ(tracker.state(), TrackerState::tracking);
  return resident_kib() - before;
}

#ifdef __SANITIZE_ADDRESS__
constexpr long max_kib = 1 << 20;  // AddressSanitizer keeps what is freed
#else
constexpr long max_kib = 1024;
#endif

TEST(TrackerMemory, DoesNotGrow) { EXPECT_LT(growth_kib(1800, 300), max_kib); }

TEST(SlowTrackerMemory, DoesNotGrowInAnHour) { EXPECT_LT(growth_kib(108000, 9000), max_kib); }

}  // namespace
}  // namespace occ
