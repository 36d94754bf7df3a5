// SPDX-License-Identifier: Apache-2.0
// Identification of lamps, one thread, with blobs made from the truth: small rooms and random maps.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/identify.hpp"
#include "tests/identify/random_maps.hpp"

namespace {

using namespace occ;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct View {
  Scene scene;
  std::vector<Blob> blobs;
};

Lamp disc(int id, double x_m, double y_m, double z_m) {
  Lamp lamp;
  lamp.id = id;
  lamp.centre_m = {x_m, y_m, z_m};
  lamp.radius_m = 0.085;
  return lamp;
}

Blob spot(const Vector2d& px, double flux_dn) {
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = 0.0025 * Eigen::Matrix2d::Identity();
  blob.flux_dn = flux_dn;
  return blob;
}

/// Map of `lamps` lamps, of which the first `seen` are in the image, with `false_lights` more
/// blobs.
View make_view(int lamps, int seen, int false_lights) {
  const std::array<Vector3d, 8> places{{{1.3, 1.4, 3},
                                        {2.6, 1.3, 3},
                                        {1.4, 2.6, 3},
                                        {2.6, 2.5, 3},
                                        {2.05, 1.85, 3},
                                        {1.6, 2.1, 2.6},
                                        {0.4, 3.7, 3},
                                        {3.8, 0.3, 3}}};
  View view;
  view.scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  const Rigid3 pose = look_at({2.0, 1.9, 0.3}, {2.1, 1.95, 3}, Vector3d::UnitY());
  Random random(1);
  for (int i = 0; i < lamps; ++i) {
    const Vector3d& at = places[i];
    view.scene.lamps.push_back(disc(i, at.x(), at.y(), at.z()));
    const Vector2d noise(random.normal(), random.normal());
    if (i < seen)
      view.blobs.push_back(spot(*view.scene.camera.project(pose * at) + 0.05 * noise, 1e4));
  }
  for (int i = 0; i < false_lights; ++i)
    view.blobs.push_back(spot({random.uniform(20, 620), random.uniform(20, 460)}, 4e3));
  return view;
}

void run(benchmark::State& state, const View& view, const IdentifyOptions& options,
         std::size_t matches) {
  int tried = 0;
  for (auto _ : state) {
    const Result<Identification> found = identify(view.blobs, view.scene, options);
    if (!found.ok() || found->hypotheses[0].matches.size() != matches)
      state.SkipWithError(found.message.c_str());
    tried = found->tried;
    benchmark::DoNotOptimize(found);
  }
  state.counters["tried"] = tried;
}

/// Arguments: lamps of the map, lamps seen, false lights.
void BM_IdentifyWithoutCodes(benchmark::State& state) {
  const int seen = static_cast<int>(state.range(1));
  const View view =
      make_view(static_cast<int>(state.range(0)), seen, static_cast<int>(state.range(2)));
  run(state, view, {}, static_cast<std::size_t>(seen));
}
BENCHMARK(BM_IdentifyWithoutCodes)
    ->Args({4, 4, 0})
    ->Args({6, 6, 0})
    ->Args({6, 5, 0})
    ->Args({6, 6, 1})
    ->Args({6, 6, 2})
    ->Args({8, 6, 0})
    ->Args({8, 6, 2})
    ->Unit(benchmark::kMicrosecond);

void BM_IdentifyByCodes(benchmark::State& state) {
  View view = make_view(6, 6, 2);
  for (std::size_t i = 0; i < 6; ++i) {
    view.scene.lamps[i].frequency_hz = 1000 + 500 * static_cast<double>(i);
    view.blobs[i].frequency_hz = view.scene.lamps[i].frequency_hz;
    view.blobs[i].frequency_sigma_hz = 10;
  }
  run(state, view, {}, 6);
}
BENCHMARK(BM_IdentifyByCodes)->Unit(benchmark::kMicrosecond);

void BM_IdentifyWithPositionPrior(benchmark::State& state) {
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->position_m = Vector3d(2.1, 1.8, 0.3);
  options.prior->position_sigma_m = 0.3;
  run(state, make_view(8, 6, 2), options, 6);
}
BENCHMARK(BM_IdentifyWithPositionPrior)->Unit(benchmark::kMicrosecond);

/// Times the views one after the other. The median is that of a typical image; a few long searches
/// dominate the mean.
void run_in_turn(benchmark::State& state, const std::vector<maps::View>& seen,
                 const std::vector<IdentifyOptions>& options) {
  std::vector<double> times_s;
  int right = 0;
  for (auto _ : state) {
    const std::size_t i = times_s.size() % seen.size();
    const auto begin = std::chrono::steady_clock::now();
    const Result<Identification> found = identify(seen[i].blobs, seen[i].scene, options[i]);
    times_s.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    right += found.ok() && maps::is_right(found->hypotheses.front(), seen[i]);
  }
  std::sort(times_s.begin(), times_s.end());
  state.counters["median_ms"] = 1e3 * times_s[times_s.size() / 2];
  state.counters["p95_ms"] = 1e3 * times_s[times_s.size() * 95 / 100];
  state.counters["right"] = static_cast<double>(right) / static_cast<double>(times_s.size());
}

/// Camera on wheels with known gravity, with or without its height to 2 cm, in a map of many lamps.
void BM_IdentifyByGravityAndHeight(benchmark::State& state) {
  maps::Options map;
  map.lamps = static_cast<int>(state.range(0));
  Random random(9);
  std::vector<maps::View> seen;
  std::vector<IdentifyOptions> options(100);
  for (IdentifyOptions& o : options) {
    seen.push_back(maps::random_view(random, map));
    o.prior = maps::gravity(seen.back(), 0.00873, random);
    if (state.range(1) == 0) continue;
    o.prior->height_m = seen.back().cam_from_world.origin_in_source().z() + 0.02 * random.normal();
    o.prior->height_sigma_m = 0.02;
  }
  run_in_turn(state, seen, options);
}
BENCHMARK(BM_IdentifyByGravityAndHeight)
    ->ArgsProduct({{20, 100}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

/// Lamps of one height, gravity known to half a degree, no height: voting, hashing.
void BM_IdentifyInOnePlane(benchmark::State& state) {
  maps::Options map;
  map.lamps = static_cast<int>(state.range(0));
  map.thickness_m = 0;
  Random random(9);
  std::vector<maps::View> seen;
  std::vector<IdentifyOptions> options(map.lamps > 1000 ? 4 : 40);
  for (IdentifyOptions& o : options) {
    seen.push_back(maps::random_view(random, map));
    o.prior = maps::gravity(seen.back(), 0.00873, random);
    o.method = static_cast<IdentifyMethod>(state.range(1));
    o.model_sigma_px = 0.1;
    if (o.method == IdentifyMethod::hashing) o.index = LampIndex(seen.back().scene.lamps);
  }
  run_in_turn(state, seen, options);
}
BENCHMARK(BM_IdentifyInOnePlane)
    ->ArgsProduct({{100, 1000, 10000},
                   {static_cast<int>(IdentifyMethod::voting),
                    static_cast<int>(IdentifyMethod::hashing)}})
    ->Unit(benchmark::kMillisecond);

/// Success against time of every method. Arguments: lamps of the map; alignment, voting, ransac,
/// clustering.
void BM_IdentifyByMethod(benchmark::State& state) {
  maps::Options map;
  map.lamps = static_cast<int>(state.range(0));
  Random random(10);
  std::vector<maps::View> seen;
  for (int i = 0; i < 50; ++i) seen.push_back(maps::random_view(random, map));
  IdentifyOptions options;
  options.method = static_cast<IdentifyMethod>(state.range(1));
  std::size_t i = 0;
  int right = 0;
  for (auto _ : state) {
    const maps::View& view = seen[i++ % seen.size()];
    const Result<Identification> found = identify(view.blobs, view.scene, options);
    right += found.ok() && maps::is_right(found->hypotheses.front(), view);
  }
  state.counters["right"] = static_cast<double>(right) / static_cast<double>(i);
}
BENCHMARK(BM_IdentifyByMethod)
    ->ArgsProduct(
        {{8, 20},
         {static_cast<int>(IdentifyMethod::alignment), static_cast<int>(IdentifyMethod::voting),
          static_cast<int>(IdentifyMethod::ransac), static_cast<int>(IdentifyMethod::clustering)}})
    ->Unit(benchmark::kMillisecond);

/// Arguments: lamps of the map, gravity known or not. Six lamps seen, two hidden, two false lights;
/// each iteration another map.
void BM_IdentifyInRandomMaps(benchmark::State& state) {
  constexpr int views = 100;
  maps::Options map;
  map.lamps = static_cast<int>(state.range(0));
  Random random(9);
  std::vector<maps::View> seen;
  std::vector<IdentifyOptions> options(views);
  for (int i = 0; i < views; ++i) {
    seen.push_back(maps::random_view(random, map));
    if (state.range(1) != 0) options[i].prior = maps::gravity(seen.back(), 0.00873, random);
  }
  run_in_turn(state, seen, options);
}
BENCHMARK(BM_IdentifyInRandomMaps)
    ->ArgsProduct({{8, 20, 50, 100}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
