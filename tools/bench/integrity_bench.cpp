// SPDX-License-Identifier: Apache-2.0
// Protection level of a fix, and locate() from blobs, which prepares it.
#include <benchmark/benchmark.h>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"

namespace {

using namespace occ;

Lamp disc(int id, double x_m, double y_m, double z_m) {
  Lamp lamp;
  lamp.id = id;
  lamp.centre_m = {x_m, y_m, z_m};
  lamp.radius_m = 0.085;
  lamp.power_w = 1.5;
  return lamp;
}

Scene room() {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  scene.lamps = {disc(0, 1.3, 1.4, 3), disc(1, 2.6, 1.3, 3),   disc(2, 1.4, 2.6, 3),
                 disc(3, 2.6, 2.5, 3), disc(4, 2.05, 1.85, 3), disc(5, 1.6, 2.1, 2.6)};
  return scene;
}

std::vector<Blob> blobs() {
  const Rigid3 pose = look_at({2.0, 1.9, 0.3}, {2.1, 1.95, 3}, Eigen::Vector3d::UnitY());
  return detect(simulate(room(), pose).image.view(), {});
}

void BM_LocateBlobs(benchmark::State& state) {
  const Scene scene = room();
  const std::vector<Blob> seen = blobs();
  for (auto _ : state) benchmark::DoNotOptimize(locate(seen, scene));
}
BENCHMARK(BM_LocateBlobs)->Unit(benchmark::kMicrosecond);

void BM_ProtectionLevel(benchmark::State& state) {
  const Result<Fix> fix = locate(blobs(), room());
  if (!fix->protection_level_m().ok()) state.SkipWithError("no level");
  for (auto _ : state) benchmark::DoNotOptimize(fix->protection_level_m());
}
BENCHMARK(BM_ProtectionLevel)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
