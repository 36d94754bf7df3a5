// SPDX-License-Identifier: Apache-2.0
// Striped lamps in real photographs, which are not part of the project; skipped without them.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/detect/detect.hpp"

namespace occ {
namespace {

/// Real photographs, outside the project: one blob per lamp; its own code is the nearest one.
void check_photo(const std::string& name, Readout readout, const std::vector<double>& codes_hz) {
  const std::string path = std::string(LIBOCC_EXTRA_DATA) + "/luxapose/" + name;
  if (!std::ifstream(path)) GTEST_SKIP() << path << " is absent";
  const Image image = read_image(path);
  DetectOptions options;
  options.sensor = Sensor{};
  options.sensor->response = Response::srgb;
  options.sensor->row_time_s = 1 / 47540.0;
  options.sensor->exposure_s = 6e-5;
  options.sensor->readout = readout;
  std::vector<int> found(codes_hz.size(), 0);
  for (const Blob& blob : detect(image.view(), options)) {
    if (!blob.frequency_hz) continue;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < codes_hz.size(); ++i)
      if (std::abs(codes_hz[i] - *blob.frequency_hz) <
          std::abs(codes_hz[nearest] - *blob.frequency_hz))
        nearest = i;
    // The lamps' clocks have errors of about 1 %.
    const double sigma = std::hypot(blob.frequency_sigma_hz, 0.01 * codes_hz[nearest]);
    EXPECT_LT(std::abs(codes_hz[nearest] - *blob.frequency_hz), 4 * sigma) << *blob.frequency_hz;
    EXPECT_LT(blob.frequency_sigma_hz, 62) << *blob.frequency_hz;  // codes are 500 Hz apart
    EXPECT_LT(std::sqrt(blob.covariance_px2.trace()), 3);
    ++found[nearest];
  }
  EXPECT_EQ(found, std::vector<int>(codes_hz.size(), 1));
}

TEST(StripesPhoto, Rig) {
  check_photo("rig_x0_y1.27cm.jpg", Readout::rows, {2000, 2500, 3000, 3500, 4000});
}
TEST(StripesPhoto, RigUnknownReadout) {
  check_photo("rig_x0_y1.27cm.jpg", Readout::unknown, {2000, 2500, 3000, 3500, 4000});
}
TEST(StripesPhoto, Chandelier) {
  check_photo("chandelier_z10.97m.jpg", Readout::columns, {2000, 3000, 4000, 5000});
}
TEST(StripesPhoto, ChandelierUnknownReadout) {
  check_photo("chandelier_z10.97m.jpg", Readout::unknown, {2000, 3000, 4000, 5000});
}

}  // namespace
}  // namespace occ
