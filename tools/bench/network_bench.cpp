// SPDX-License-Identifier: Apache-2.0
// One adjustment of a panorama test field (4 iterations: stations x targets, nine additional
// parameters) and the covariance of all its points, against Ceres with the same derivatives; both
// with two threads. Counters: iterations taken, sigma0.
#include <benchmark/benchmark.h>

#include "libocc/core/abi.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/network_statistics.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/network/test_field.hpp"
#include "tests/network/ceres_adjust.hpp"

namespace {

using namespace occ;

TestField field(const benchmark::State& state) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.sigma_px = {0.5, 0.19};
  design.stations = static_cast<int>(state.range(0));
  design.targets = static_cast<int>(state.range(1));
  return simulate_test_field(design);
}

AdjustOptions plain(int threads) {
  AdjustOptions options;
  options.robust = options.snooping = false;
  options.threads = threads;
  return options;
}

void own(benchmark::State& state, int threads) {
  const Network network = field(state).network;
  Result<Adjustment> found;
  for (auto _ : state) found = adjust(network, plain(threads));
  state.counters["iterations"] = found->iterations;
  state.counters["sigma0"] = found->sigma0;
}

void own_with_snooping(benchmark::State& state) {
  const Network network = field(state).network;
  for (auto _ : state) benchmark::DoNotOptimize(adjust(network));
}

void ceres_analytic(benchmark::State& state) {
  const Network network = field(state).network;
  test::CeresResult found;
  for (auto _ : state) found = test::ceres_adjust(network, 2, 4, 1e-12);
  state.counters["iterations"] = found.iterations;
}

/// Normal equations, reduced inverse and the datum, then the points' blocks.
void covariance_of_all_points(benchmark::State& state) {
  const Network network = adjust(field(state).network, plain(2))->network;
  for (auto _ : state) benchmark::DoNotOptimize(precision(network)->points());
}

void statistics(benchmark::State& state) {
  const Network network = adjust(field(state).network, plain(2))->network;
  for (auto _ : state) benchmark::DoNotOptimize(network_statistics(network));
}

void sizes(benchmark::internal::Benchmark* bench) {
  for (const int targets : {500, 5000})
    for (const int stations : {5, 20}) bench->Args({stations, targets});
  bench->ArgNames({"stations", "targets"})->Unit(benchmark::kMillisecond)->UseRealTime();
}

BENCHMARK_CAPTURE(own, two_threads, 2)->Apply(sizes);
BENCHMARK_CAPTURE(own, one_thread, 1)->Apply(sizes);
BENCHMARK(own_with_snooping)->Apply(sizes);
BENCHMARK(ceres_analytic)->Apply(sizes);
BENCHMARK(covariance_of_all_points)->Apply(sizes);
BENCHMARK(statistics)->Apply(sizes);

}  // namespace

BENCHMARK_MAIN();
