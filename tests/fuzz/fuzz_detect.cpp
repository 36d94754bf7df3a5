// SPDX-License-Identifier: Apache-2.0
// Any pixels under any valid options: detect returns blobs that make sense, within the image.
#include <fuzzer/FuzzedDataProvider.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "libocc/detect/detect.hpp"

namespace {

void check(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

occ::Sensor random_sensor(FuzzedDataProvider& bytes, occ::PixelType type) {
  occ::Sensor sensor;
  sensor.bit_depth = type == occ::PixelType::u8 ? 8 : bytes.ConsumeIntegralInRange<int>(9, 16);
  sensor.full_well_e = bytes.ConsumeFloatingPointInRange(10.0, 1e6);
  sensor.gain_dn_per_e = bytes.ConsumeFloatingPointInRange(1e-4, 100.0);
  sensor.read_noise_e = bytes.ConsumeFloatingPointInRange(0.0, 100.0);
  sensor.black_level_dn = bytes.ConsumeFloatingPointInRange(0.0, 200.0);
  sensor.response = bytes.PickValueInArray(
      {occ::Response::linear, occ::Response::gamma, occ::Response::srgb, occ::Response::table});
  sensor.gamma = bytes.ConsumeFloatingPointInRange(0.3, 4.0);
  if (sensor.response == occ::Response::table) sensor.response_table = {0, 0.5, 0.8, 1};
  if (bytes.ConsumeBool()) sensor.row_time_s = bytes.ConsumeFloatingPointInRange(1e-7, 1e-3);
  sensor.exposure_s = bytes.ConsumeFloatingPointInRange(1e-6, 1e-2);
  sensor.readout =
      bytes.PickValueInArray({occ::Readout::rows, occ::Readout::columns, occ::Readout::unknown});
  sensor.psf_sigma_px = bytes.ConsumeFloatingPointInRange(0.05, 5.0);
  return sensor;
}

occ::DetectOptions random_options(FuzzedDataProvider& bytes, occ::PixelType type) {
  occ::DetectOptions options;
  options.threshold_sigma = bytes.ConsumeFloatingPointInRange(0.01, 20.0);
  if (bytes.ConsumeBool()) options.threshold_dn = bytes.ConsumeFloatingPointInRange(0.0, 300.0);
  options.min_area_px = bytes.ConsumeIntegralInRange<int>(1, 20);
  options.max_blobs = bytes.ConsumeIntegralInRange<int>(1, 100);
  options.rims = bytes.ConsumeBool();
  if (bytes.ConsumeBool()) options.sensor = random_sensor(bytes, type);
  if (options.sensor && options.sensor->row_time_s > 0) options.stripes = bytes.ConsumeBool();
  options.max_frequency_hz = bytes.ConsumeFloatingPointInRange(1.0, 1e6);
  return options;
}

/// Pixels in a buffer of exactly their size, so that the sanitizer sees every step outside.
template <typename T>
struct Canvas {
  int width, height, channels;
  std::vector<T> pixels =
      std::vector<T>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                     static_cast<std::size_t>(channels));

  void set(int x, int y, T value) {
    const int first = (y * width + x) * channels;
    for (int c = 0; c < channels; ++c) pixels[first + c] = value;
  }

  /// A disc, perhaps in stripes: raw noise alone would seldom reach the code for rims and codes.
  void draw_disc(FuzzedDataProvider& bytes) {
    const double cx = bytes.ConsumeFloatingPointInRange(-5.0, width + 5.0);
    const double cy = bytes.ConsumeFloatingPointInRange(-5.0, height + 5.0);
    const double radius = bytes.ConsumeFloatingPointInRange(0.5, 60.0);
    const T level = bytes.ConsumeIntegral<T>();
    const int period = bytes.ConsumeIntegralInRange<int>(0, 20);
    for (int y = 0; y < height; ++y) {
      if (period > 1 && y % period < period / 2) continue;
      for (int x = 0; x < width; ++x) {
        if (std::hypot(x - cx, y - cy) <= radius) set(x, y, level);
      }
    }
  }

  void draw(FuzzedDataProvider& bytes) {
    const T background = bytes.ConsumeIntegral<T>();
    const int noise = bytes.ConsumeIntegralInRange<int>(1, 16);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      pixels[i] =
          static_cast<T>(background + (i * 2654435761u >> 7) % static_cast<unsigned>(noise));
    }
    for (int discs = bytes.ConsumeIntegralInRange<int>(0, 4); discs > 0; --discs) draw_disc(bytes);
    const std::vector<std::uint8_t> rest = bytes.ConsumeRemainingBytes<std::uint8_t>();
    for (std::size_t i = 0; i < rest.size() && i < pixels.size(); ++i) {
      pixels[i] = static_cast<T>(pixels[i] ^ (rest[i] * (sizeof(T) == 1 ? 1u : 257u)));
    }
  }

  occ::ImageView view(occ::PixelType type) const {
    return {pixels.data(), width, height,
            channels,      type,  static_cast<std::size_t>(width * channels) * sizeof(T)};
  }
};

void check_rim(const occ::Blob& blob) {
  for (const occ::RimPoint& point : blob.rim) {
    check(point.px.allFinite(), "rim point is finite");
    check(std::abs(point.normal.norm() - 1) < 1e-6, "rim normal is unit");
    check(point.sigma_px > 0 && std::isfinite(point.sigma_px), "rim sigma is positive");
  }
}

void check_blob(const occ::Blob& blob, const occ::ImageView& image) {
  check(blob.x0 >= 0 && blob.x0 <= blob.x1 && blob.x1 < image.width, "box lies in the image (x)");
  check(blob.y0 >= 0 && blob.y0 <= blob.y1 && blob.y1 < image.height, "box lies in the image (y)");
  check(blob.area_px > 0, "area is positive");
  check(blob.area_px <= (blob.x1 - blob.x0 + 1) * (blob.y1 - blob.y0 + 1), "area fits the box");
  check(blob.centroid_px.allFinite(), "centroid is finite");
  check(blob.covariance_px2.allFinite(), "covariance is finite");
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(blob.covariance_px2);
  check(axes.eigenvalues()[0] >= -1e-9 * axes.eigenvalues()[1], "covariance is not negative");
  for (const double value :
       {blob.flux_dn, blob.flux_sigma_dn, blob.peak_dn, blob.background_dn, blob.noise_dn,
        blob.ellipse.semi_major_px, blob.ellipse.semi_minor_px, blob.ellipse.angle_rad}) {
    check(std::isfinite(value), "measurements are finite");
  }
  check(blob.ellipse.centre_px.allFinite(), "ellipse's centre is finite");
  check(blob.ellipse.semi_major_px >= blob.ellipse.semi_minor_px, "axes are in order");
  if (blob.frequency_hz) check(*blob.frequency_hz > 0, "frequency is positive");
  check_rim(blob);
}

template <typename T>
void detect_on(FuzzedDataProvider& bytes, occ::PixelType type) {
  const int longest = bytes.ConsumeBool() ? 300 : 40;
  Canvas<T> canvas{bytes.ConsumeIntegralInRange<int>(1, longest),
                   bytes.ConsumeIntegralInRange<int>(1, longest),
                   bytes.PickValueInArray({1, 3, 4})};
  const occ::DetectOptions options = random_options(bytes, type);
  canvas.draw(bytes);
  const occ::ImageView image = canvas.view(type);
  const std::vector<occ::Blob> blobs = occ::detect(image, options);
  check(blobs.size() <= static_cast<std::size_t>(options.max_blobs), "no more than max_blobs");
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    check_blob(blobs[i], image);
    check(i == 0 || blobs[i - 1].flux_dn >= blobs[i].flux_dn, "brightest first");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  if (bytes.ConsumeBool()) {
    detect_on<std::uint8_t>(bytes, occ::PixelType::u8);
  } else {
    detect_on<std::uint16_t>(bytes, occ::PixelType::u16);
  }
  return 0;
}
