// SPDX-License-Identifier: Apache-2.0
// Rendering, one thread: 1280 x 960, lamps of 20 px across, PSF 1.5 px. The camera moves between
// images. `absent` measures in pairs the cost of effects that a scene describes and
// switches off.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/simulate/renderer.hpp"

namespace {

using namespace occ;

/// `across` x `down` lamps on a ceiling 2.5 m above the camera, all of them in view.
Scene ceiling(int across, int down) {
  Scene scene;
  scene.camera = Camera::pinhole(1280, 960, 900, 900, 639.5, 479.5);
  scene.sensor.psf_sigma_px = 1.5;
  for (int i = 0; i < across * down; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.centre_m = {3 * ((i % across + 0.5) / across - 0.5) + 2,
                     2.2 * ((i / across + 0.5) / down - 0.5) + 2, 3};
    lamp.radius_m = 10 * 2.5 / 900;
    lamp.power_w = 0.15;
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// Motion of the camera during which every lamp stays in view.
std::vector<Rigid3> poses() {
  std::vector<Rigid3> all;
  for (int i = 0; i < 16; ++i) {
    const Eigen::Vector3d position(2 + 0.03 * std::cos(i), 2 + 0.03 * std::sin(i), 0.5);
    all.push_back(look_at(position, position + Eigen::Vector3d(0.02 * std::sin(2 * i), 0.01, 2.5),
                          Eigen::Vector3d::UnitY()));
  }
  return all;
}

enum class Noise { none, around_lamps, everywhere };

SimulateOptions options_for(Noise noise) {
  SimulateOptions options;
  options.noise = noise != Noise::none;
  options.noise_area =
      noise == Noise::around_lamps ? NoiseArea::around_lamps : NoiseArea::everywhere;
  return options;
}

void render(benchmark::State& state, const Scene& scene, Noise noise, Simd simd) {
  if (simd > widest_simd()) return state.SkipWithError("this processor has no such instructions");
  Renderer renderer(scene, {simd});
  const std::vector<Rigid3> walk = poses();
  SimulateOptions options = options_for(noise);
  Rendered out;
  for (auto _ : state) {
    renderer.render(walk[options.frame % walk.size()], options, out);
    ++options.frame;
  }
  if (!std::all_of(out.lamps.begin(), out.lamps.end(), [](const LampTruth& t) { return t.whole; }))
    state.SkipWithError("a lamp is not whole in view");
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

/// Scene that describes every effect, or none; all effects are off in both.
Scene without_effects(bool says_all) {
  Scene scene = ceiling(2, 2);
  if (!says_all) return scene;
  scene.camera = Camera::pinhole(1280, 960, 900, 900, 639.5, 479.5, {-0.1, 0.02, 1e-3, 1e-3});
  scene.room = Room{{4, 4, 3.1}, 0.5};
  scene.boxes.push_back({{2.4, 2.2, 2}, {2.6, 2.6, 2.2}});
  scene.ambient_w_m2 = 0.1;
  scene.lens.vignetting = {-0.3};
  scene.lens.veiling_glare = 0.05;
  scene.lens.ghosts = {{1e-3, -0.8, 2}};
  scene.sensor.row_time_s = 1e-5;
  scene.sensor.mosaic = Mosaic::rggb;
  scene.sensor.gain_sigma = 0.01;
  scene.sensor.blooming = 0.5;
  scene.sensor.response = Response::srgb;
  for (Lamp& lamp : scene.lamps) {
    lamp.frequency_hz = 1000;
    lamp.power_w *= 2;  // lit half of the time
  }
  for (std::size_t i = 0; i < effect_count; ++i) scene.effects.use[i] = Use::off;
  for (const Effect effect :
       {Effect::extent, Effect::light_gradient, Effect::psf, Effect::noise, Effect::saturation})
    scene.effects.set(effect, Use::on);
  return scene;
}

SimulateOptions moving(bool moves) {
  SimulateOptions options = options_for(Noise::none);
  // The motion is too slow to be visible: without blur, the image is that of mid-exposure.
  if (moves) options.velocity << 1e-6, 0, 0, 0, 1e-6, 0;
  return options;
}

struct Rendering {
  explicit Rendering(bool says_all)
      : renderer(without_effects(says_all)), options(moving(says_all)) {}
  Renderer renderer;
  SimulateOptions options;
  Rendered out;
  std::vector<double> seconds;
};

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void absent(benchmark::State& state) {
  const std::vector<Rigid3> walk = poses();
  Rendering both[] = {Rendering(false), Rendering(true)};
  for (auto _ : state) {
    for (Rendering& one : both) {
      const auto start = std::chrono::steady_clock::now();
      for (const Rigid3& pose : walk) one.renderer.render(pose, one.options, one.out);
      one.seconds.push_back(
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    std::swap(both[0], both[1]);
  }
  if (both[0].out.image.u8 != both[1].out.image.u8) state.SkipWithError("they change the image");
  const auto plain = static_cast<std::size_t>(state.iterations() % 2);
  state.counters["extra_percent"] =
      100 * (median(both[1 - plain].seconds) / median(both[plain].seconds) - 1);
}

const char* name_of(Simd simd) {
  return simd == Simd::baseline ? "baseline" : simd == Simd::avx2 ? "avx2" : "avx512";
}

void add(const std::string& name, const Scene& scene, Noise noise, Simd simd) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    render(state, scene, noise, simd);
  })->Unit(benchmark::kMicrosecond);
}

}  // namespace

int main(int argc, char** argv) {
  const Scene four = ceiling(2, 2), hundred = ceiling(10, 10);
  Scene even = four;
  even.effects.set(Effect::light_gradient, Use::off);
  for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) {
    const std::string level = name_of(simd);
    add("four_lamps/no_noise/" + level, four, Noise::none, simd);
    add("four_even_lamps/no_noise/" + level, even, Noise::none, simd);
    add("four_lamps/noise_around_lamps/" + level, four, Noise::around_lamps, simd);
    add("four_lamps/noise_everywhere/" + level, four, Noise::everywhere, simd);
    add("hundred_lamps/noise_everywhere/" + level, hundred, Noise::everywhere, simd);
  }
  benchmark::RegisterBenchmark("absent_effects", absent)->Unit(benchmark::kMicrosecond);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
