// SPDX-License-Identifier: Apache-2.0
// Random scenes with many effects, and images as lists of numbers, for the reference tests.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/references.hpp"
#include "tests/support/simulate_support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {

/// Returns true with the probability.
inline bool happens(Random& random, double probability) { return random.uniform() < probability; }

/// Random number whose logarithm is even between those of the limits.
inline double log_uniform(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

inline Camera random_small_camera(Random& random) {
  const int width = 60 + random.below(50), height = 50 + random.below(30);
  const double f = log_uniform(random, 60, 700), cx = 0.5 * width + random.uniform(-4, 4);
  const double cy = 0.5 * height + random.uniform(-4, 4);
  switch (random.below(6)) {
    case 0:
      return Camera::pinhole(width, height, f, 1.03 * f, cx, cy, {-0.2, 0.06, 2e-3, -1e-3});
    case 1:
      return Camera::fisheye(width, height, f, f, cx, cy, {0.03, -0.005});
    case 2:
      return Camera::double_sphere(width, height, 0.8 * f, 0.8 * f, cx, cy, -0.2, 0.57);
    case 3:  // its domain ends inside the image
      return Camera::fisheye(width, height, 0.02 * f + 20, 0.02 * f + 20, cx, cy, {-0.1, 0.01});
    default:
      return Camera::pinhole(width, height, f, f, cx, cy);
  }
}

/// A lamp at a random place of the image, which is seen from the middle of the room's floor.
inline Lamp random_lamp(int id, const Camera& camera, const Rigid3& pose, Random& random) {
  Lamp lamp;
  lamp.id = id;
  const double margin_px = happens(random, 0.2) ? 50 : 4;  // it may come into view by motion
  const Eigen::Vector2d px(random.uniform(-margin_px, camera.width() + margin_px),
                           random.uniform(-margin_px, camera.height() + margin_px));
  const double distance_m = random.uniform(0.8, 2.3);
  const auto ray = camera.unproject(px);
  const Eigen::Vector3d along = ray ? ray->normalized() : Eigen::Vector3d::UnitZ().eval();
  lamp.centre_m = pose.inverse() * Eigen::Vector3d(distance_m * along);
  lamp.centre_m = lamp.centre_m.cwiseMax(0.05).cwiseMin(Eigen::Vector3d(3.95, 3.95, 2.95));
  lamp.normal = (pose.origin_in_source() - lamp.centre_m).normalized() +
                random.uniform(0, 0.7) * random_vector(random).normalized();
  lamp.x_axis = random_vector(random);
  lamp.radius_m = log_uniform(random, 0.01, 0.2);
  lamp.size_m = {log_uniform(random, 0.02, 0.4), log_uniform(random, 0.02, 0.4)};
  const int shape = random.below(6);
  if (shape == 3) lamp.shape = LampShape::rectangle;
  if (shape == 4) lamp.shape = LampShape::lame;
  if (shape == 5) lamp.shape = LampShape::point;
  lamp.exponent = random.uniform(1.2, 6);
  lamp.power_w = random.uniform(0.5, 3);
  lamp.half_power_rad = random.uniform(0.5, 1.3);
  if (happens(random, 0.15)) lamp.photometry = profile_of(batwing, 5, 15);
  lamp.colour = {random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.2, 1)};
  return lamp;
}

inline void let_blink(Lamp& lamp, Random& random) {
  lamp.frequency_hz = log_uniform(random, 30, 3000);
  lamp.duty = random.uniform(0.1, 0.9);
  lamp.phase = random.uniform(0, 1);
  if (!happens(random, 0.4)) return;
  lamp.waveform.assign(static_cast<std::size_t>(2 + random.below(6)), 0.0);
  for (double& level : lamp.waveform) level = happens(random, 0.5) ? random.uniform() : 0;
  lamp.waveform[1] = 1;
}

inline void randomise_sensor(Scene& scene, Random& random) {
  Sensor& sensor = scene.sensor;
  sensor.exposure_s = log_uniform(random, 5e-4, 2e-2);
  sensor.f_number = random.uniform(1.4, 5);
  sensor.psf_sigma_px = random.uniform(0.45, 1.5);
  sensor.bit_depth = happens(random, 0.3) ? 8 : 16;
  sensor.black_level_dn = random.uniform(0, 5);
  sensor.read_noise_e = happens(random, 0.2) ? 0.5 : random.uniform(1, 20);
  sensor.dark_current_e_per_s = happens(random, 0.3) ? random.uniform(0, 1e4) : 0;
  if (happens(random, 0.3)) sensor.response = Response::gamma;
  if (happens(random, 0.15)) sensor.response = Response::srgb;
  if (happens(random, 0.15)) {
    sensor.response = Response::table;
    sensor.response_table = {0, 0.4, 0.6, 0.9, 1};
  }
  if (happens(random, 0.4)) sensor.row_time_s = log_uniform(random, 1e-5, 4e-4);
  if (happens(random, 0.3)) sensor.readout = Readout::columns;
  if (happens(random, 0.3)) sensor.gain_sigma = random.uniform(0.005, 0.05);
  sensor.gain_seed = random.below(9);
  if (happens(random, 0.4)) sensor.blooming = random.uniform(0.1, 1);
  if (happens(random, 0.35)) {
    sensor.mosaic = static_cast<Mosaic>(1 + random.below(4));
    if (happens(random, 0.7)) {
      sensor.channels.resize(3);
      for (Channel& channel : sensor.channels) channel.efficiency = random.uniform(0.3, 1);
      sensor.channels[1].response = Response::gamma;
      sensor.channels[2].response = happens(random, 0.5) ? Response::srgb : Response::linear;
    }
  }
}

inline void randomise_surroundings(Scene& scene, const Rigid3& pose, double room_probability,
                                   Random& random) {
  const bool is_grey = scene.sensor.mosaic == Mosaic::none;
  if (happens(random, is_grey ? room_probability : 0.3 * room_probability)) {
    scene.room = Room{{4, 4, 3}, random.uniform(0.1, 0.8)};
    if (happens(random, 0.3)) scene.effects.set(Effect::interreflection, Use::off);
  }
  if (happens(random, 0.3)) scene.ambient_w_m2 = log_uniform(random, 1e-5, 1e-2);
  Lens& lens = scene.lens;
  lens.diffraction = happens(random, 0.3);
  if (happens(random, 0.3)) lens.focus_distance_m = log_uniform(random, 0.2, 20);
  if (happens(random, 0.3)) lens.vignetting = {-random.uniform(0.1, 0.4), 0.1};
  if (happens(random, 0.3)) lens.veiling_glare = random.uniform(0.01, 0.3);
  if (happens(random, 0.3))
    lens.ghosts = {{random.uniform(0.01, 0.1), random.uniform(-1.2, -0.5), random.uniform(0, 3)}};
  if (happens(random, 0.1)) lens.ghosts.push_back({0.02, 0.6, 0});
  const Eigen::Vector3d eye = pose.origin_in_source();
  for (int i = 0; happens(random, 0.3) && i < 3; ++i) {
    const Lamp& lamp = scene.lamps[static_cast<std::size_t>(i) % scene.lamps.size()];
    const Eigen::Vector3d middle =
        eye + random.uniform(0.3, 0.8) * (lamp.centre_m - eye) + 0.03 * random_vector(random);
    const Eigen::Vector3d half(random.uniform(0.01, 0.1), random.uniform(0.01, 0.1),
                               random.uniform(0.01, 0.1));
    Box box{middle - half, middle + half};
    if ((box.min_m - eye).maxCoeff() > 0 || (eye - box.max_m).maxCoeff() > 0)
      scene.boxes.push_back(box);
  }
}

/// Electrons of a pixel that the brightest lamp covers, or of the whole lamp if it is smaller.
inline double brightest_e(const Scene& given, const Rigid3& pose) {
  Scene scene = given;
  scene.validate();
  double peak_e = 100;
  for (const Lamp& lamp : scene.lamps) {
    const auto px = scene.camera.project(pose * lamp.centre_m);
    if (!px) continue;
    const double of_point = 0.3 * lamp_electrons(lamp, pose, scene.camera, scene.sensor);
    const bool is_point = lamp.shape == LampShape::point;
    const double full_e =
        is_point
            ? of_point
            : scene.sensor.electrons(irradiance_at(lamp, pose, scene.camera, scene.sensor, *px));
    peak_e = std::max(peak_e, std::min(of_point, full_e));
  }
  return peak_e;
}

struct RandomView {
  Scene scene;
  Rigid3 pose;
  SimulateOptions options;
};

/// A scene in which each effect is present with a probability of about a third. Walls take most of
/// the time, so they have a probability of their own.
inline RandomView random_view(std::uint64_t stream, double room_probability = 0.06) {
  Random random(2024, stream);
  RandomView view;
  Scene& scene = view.scene;
  scene.camera = random_small_camera(random);
  view.pose = look_at({2, 2, 0.4}, {random.uniform(1, 3), random.uniform(1, 3), 3},
                      Eigen::Vector3d(random.uniform(-1, 1), 1, 0));
  const int count = 1 + random.below(4);
  for (int i = 0; i < count; ++i) {
    scene.lamps.push_back(random_lamp(i, scene.camera, view.pose, random));
    if (happens(random, 0.4)) let_blink(scene.lamps.back(), random);
  }
  randomise_sensor(scene, random);
  randomise_surroundings(scene, view.pose, room_probability, random);
  if (happens(random, 0.5)) {
    const double speed = log_uniform(random, 0.02, 1) / scene.sensor.exposure_s;
    view.options.velocity.head<3>() = 0.02 * speed * random_vector(random);
    view.options.velocity.tail<3>() = 0.04 * speed * random_vector(random);
  }
  // The image of a lamp out of focus that moves from row to row takes long.
  const bool by_rows = scene.sensor.row_time_s > 0 && !view.options.velocity.isZero(0);
  if (by_rows && happens(random, 0.8)) scene.lens.focus_distance_m.reset();
  view.options.start_s = random.uniform(0, 0.1);
  view.options.spacing_sigma = happens(random, 0.2) ? random.uniform(0.5, 1.5) : 1;
  view.options.seed = static_cast<std::uint64_t>(random.below(1000));
  view.options.frame = static_cast<std::uint32_t>(random.below(1000));
  view.options.noise = happens(random, 0.5);
  if (happens(random, 0.3)) view.options.noise_area = NoiseArea::around_lamps;
  for (const Effect off :
       {Effect::extent, Effect::light_gradient, Effect::psf, Effect::distortion, Effect::saturation,
        Effect::motion_blur, Effect::modulation, Effect::vignetting, Effect::occlusion,
        Effect::ambient, Effect::glare, Effect::ghosts, Effect::mosaic, Effect::gain,
        Effect::response, Effect::rolling_shutter, Effect::noise})
    if (happens(random, 0.08)) scene.effects.set(off, Use::off);
  if (scene.effects.of(Effect::saturation) == Use::off)
    scene.effects.set(Effect::blooming, Use::off);
  // The full well between well below the brightest pixel and above it.
  const double peak_e = brightest_e(scene, view.pose);
  Sensor& sensor = scene.sensor;
  sensor.full_well_e = peak_e * log_uniform(random, 0.2, 4);
  sensor.gain_dn_per_e =
      0.95 * sensor.full_scale_dn() / sensor.full_well_e * log_uniform(random, 0.8, 1.5);
  return view;
}

/// Sums of the grey levels over 4 x 4 parts of an image.
inline std::vector<double> sums_of_parts(const Image& image) {
  std::vector<double> sums(16, 0.0);
  std::size_t i = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x, ++i)
      sums[static_cast<std::size_t>(4 * (4 * y / image.height) + 4 * x / image.width)] +=
          image.type == PixelType::u8 ? image.u8[i] : image.u16[i];
  return sums;
}

inline void add_image(CaseResults& results, const Image& image) {
  results.add("parts", sums_of_parts(image));
  std::vector<double> pixels(image.u8.begin(), image.u8.end());
  pixels.insert(pixels.end(), image.u16.begin(), image.u16.end());
  results.summarise("pixels", pixels);
}

}  // namespace occ::test
