// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/simulate.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/exposure.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"
#include "libocc/simulate/internal/sensor_noise.hpp"

namespace occ {
namespace {

constexpr int truth_rim_points = 64;
constexpr double no_electrons = 1e-6;  // less than this in a pixel is rounding

// Mean signal electrons of every pixel, dark current not included.
using Signal = std::vector<double>;

// Adds a lamp's image as its blinking lets each line see it; returns the electrons added.
double add_lamp(const Patch& image, const std::vector<double>& lit, bool by_columns,
                const Camera& camera, Signal& signal) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const double* from = &image.values[static_cast<std::size_t>(y * image.width)];
    double* to =
        &signal[static_cast<std::size_t>(image.y0 + y) * static_cast<std::size_t>(camera.width()) +
                static_cast<std::size_t>(image.x0)];
    for (int x = 0; x < image.width; ++x) {
      const int line = by_columns ? image.x0 + x : image.y0 + y;
      const double electrons = from[x] * lit[static_cast<std::size_t>(line)];
      if (!(electrons > no_electrons)) continue;
      to[x] += electrons;
      sum += electrons;
    }
  }
  return sum;
}

// Whether the closed polygon winds around the point.
bool surrounds(const std::vector<Eigen::Vector2d>& rim, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Eigen::Vector2d a = rim[i] - point, b = rim[(i + 1) % rim.size()] - point;
    if ((a.y() > 0) == (b.y() > 0)) continue;
    if (a.x() + (b.x() - a.x()) * a.y() / (a.y() - b.y()) > 0) inside = !inside;
  }
  return inside;
}

// Where a lamp that can be rendered is in the image.
void locate_image(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                  LampTruth& truth) {
  const auto rim = project_rim(lamp, cam_from_world, camera, truth_rim_points);
  if (!rim) return;
  if (const auto px = project_lamp_centre(lamp, cam_from_world, camera))
    truth.image_centre_px = *px;
  const auto inside = std::count_if(rim->begin(), rim->end(),
                                    [&](const Eigen::Vector2d& px) { return camera.contains(px); });
  truth.whole = inside == static_cast<std::ptrdiff_t>(rim->size());
  const Eigen::Vector2d middle(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  truth.in_view = inside > 0 || surrounds(*rim, middle);
  if (truth.in_view) truth.rim_px = *rim;
}

template <typename Pixel>
std::vector<Pixel> expose(const Signal& signal, const Sensor& sensor,
                          const SimulateOptions& options) {
  const Digitiser digitiser(sensor);
  const double dark_e = sensor.electrons(0);
  std::vector<Pixel> pixels(signal.size());
  if (!options.noise) {
    for (std::size_t i = 0; i < signal.size(); ++i)
      pixels[i] = static_cast<Pixel>(
          digitiser.grey_level(std::min(dark_e + signal[i], sensor.full_well_e)));
    return pixels;
  }
  const SensorNoise noise(sensor, digitiser, options.seed, options.frame);
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

void check(const SimulateOptions& options) {
  require(std::isfinite(options.start_s), "start_s", options.start_s, "finite");
  require(options.spacing_sigma > 0 && options.spacing_sigma <= 2, "spacing_sigma",
          options.spacing_sigma, "in (0, 2]");
}

}  // namespace

Rendered simulate(const Scene& given, const Rigid3& cam_from_world,
                  const SimulateOptions& options) {
  Scene scene = given;
  scene.validate();
  check(options);
  Rendered rendered;
  rendered.cam_from_world = Rigid3::from_matrix(cam_from_world.matrix());

  const Camera& camera = scene.camera;
  const Sensor& sensor = scene.sensor;
  const PixelPsf psf(sensor.psf_sigma_px);
  const double spacing_px = options.spacing_sigma * sensor.psf_sigma_px;
  const bool by_columns = sensor.readout == Readout::columns;
  const int lines = by_columns ? camera.width() : camera.height();
  Signal signal(static_cast<std::size_t>(camera.width()) *
                static_cast<std::size_t>(camera.height()));
  for (const Lamp& lamp : scene.lamps) {
    LampTruth truth;
    truth.id = lamp.id;
    if (const auto px = camera.project(cam_from_world * lamp.centre_m)) truth.centre_px = *px;
    if (const auto image = lamp_image(lamp, cam_from_world, camera, sensor, psf, spacing_px)) {
      locate_image(lamp, cam_from_world, camera, truth);
      truth.electrons = add_lamp(*image, lit_fractions(lamp, sensor, options.start_s, lines),
                                 by_columns, camera, signal);
    }
    rendered.lamps.push_back(truth);
  }

  Image& image = rendered.image;
  image.width = camera.width();
  image.height = camera.height();
  if (sensor.bit_depth > 8) {
    image.type = PixelType::u16;
    image.u16 = expose<std::uint16_t>(signal, sensor, options);
  } else {
    image.u8 = expose<std::uint8_t>(signal, sensor, options);
  }
  return rendered;
}

}  // namespace occ
