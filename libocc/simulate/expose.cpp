// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/expose.hpp"

#include <algorithm>

#include "libocc/simulate/internal/digitiser.hpp"
#include "libocc/simulate/internal/sensor_noise.hpp"

namespace occ {
namespace {

template <typename Pixel>
std::vector<Pixel> grey_levels(const Signal& signal, const Sensor& sensor, const Frame& frame) {
  const Digitiser digitiser(sensor);
  const double dark_e = sensor.electrons(0);
  std::vector<Pixel> pixels(signal.size());
  if (!frame.plan.applies(Effect::noise)) {
    for (std::size_t i = 0; i < signal.size(); ++i)
      pixels[i] = static_cast<Pixel>(
          digitiser.grey_level(std::min(dark_e + signal[i], sensor.full_well_e)));
    return pixels;
  }
  const SensorNoise noise(sensor, digitiser, frame.options.seed, frame.options.frame);
  constexpr std::size_t block = SensorNoise::dark_block;
  for (std::size_t first = 0; first < signal.size(); first += block) {
    const auto dark = noise.dark(static_cast<std::uint32_t>(first / block));
    for (std::size_t i = first; i < std::min(first + block, signal.size()); ++i)
      pixels[i] = static_cast<Pixel>(
          signal[i] > 0 ? noise.lit(static_cast<std::uint32_t>(i), dark_e + signal[i])
                        : dark[i - first]);
  }
  return pixels;
}

// The sensor without the effects that the plan leaves out.
Sensor simplified(const Frame& frame) {
  Sensor sensor = frame.scene.sensor;
  if (!frame.plan.applies(Effect::response)) sensor.response = Response::linear;
  if (!frame.plan.applies(Effect::saturation)) sensor.full_well_e = 1e30;
  return sensor;
}

}  // namespace

Image expose(const Signal& signal, const Frame& frame) {
  const Sensor sensor = simplified(frame);
  Image image;
  image.width = frame.scene.camera.width();
  image.height = frame.scene.camera.height();
  if (sensor.bit_depth > 8) {
    image.type = PixelType::u16;
    image.u16 = grey_levels<std::uint16_t>(signal, sensor, frame);
  } else {
    image.u8 = grey_levels<std::uint8_t>(signal, sensor, frame);
  }
  return image;
}

}  // namespace occ
