// SPDX-License-Identifier: Apache-2.0
// Coloured lamps in pictures as webcams and phones make them: sRGB, sharpened, with colours of half
// the resolution.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "libocc/core/internal/srgb.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/detect/detect.hpp"
#include "tests/detect/detect_support.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using test::Canvas;

constexpr int size = 120;
const Eigen::Vector3d green(0.05, 1, 0.6);

using Plane = std::vector<double>;

double& at(Plane& plane, int x, int y) {
  return plane[static_cast<std::size_t>(std::clamp(y, 0, size - 1) * size +
                                        std::clamp(x, 0, size - 1))];
}

/// Mean of each pixel and its eight neighbours.
Plane smoothed(Plane plane) {
  Plane out(plane.size());
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int v = -1; v <= 1; ++v)
        for (int u = -1; u <= 1; ++u) at(out, x, y) += at(plane, x + u, y + v) / 9;
  return out;
}

/// Picture of green light; 1 is full scale in green.
Image picture(Canvas& light, double sharpness, Random& random) {
  const Eigen::Vector3d grey(0.299, 0.587, 0.114);
  std::vector<Plane> rgb(3, Plane(size * size)), chroma;
  Plane luma(size * size);
  for (Eigen::Index k = 0; k < 3; ++k)
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        const double linear = green[k] * light.at(x, y) + 0.002 + 0.003 * random.normal();
        at(rgb[static_cast<std::size_t>(k)], x, y) =
            internal::core::srgb_encode(std::clamp(linear, 0.0, 1.0));
        at(luma, x, y) += grey[k] * at(rgb[static_cast<std::size_t>(k)], x, y);
      }
  Plane blurred = smoothed(luma);
  for (Plane& channel : rgb) {
    Plane difference(size * size);
    for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = channel[i] - luma[i];
    chroma.push_back(smoothed(std::move(difference)));
  }
  Image image;
  image.width = image.height = size;
  image.channels = 3;
  for (std::size_t i = 0; i < luma.size(); ++i) {
    const double sharp = luma[i] + sharpness * (luma[i] - blurred[i]);
    for (const Plane& difference : chroma)
      image.u8.push_back(
          static_cast<std::uint8_t>(std::round(255 * std::clamp(sharp + difference[i], 0.0, 1.0))));
  }
  return image;
}

std::vector<Vector2d> rectangle(const Vector2d& centre, double width, double height,
                                double angle_rad) {
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad)), across(-along.y(), along.x());
  std::vector<Vector2d> rim;
  const Vector2d corners[] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 128; ++k) {
      const Vector2d uv = corners[i] + k / 128.0 * (corners[(i + 1) % 4] - corners[i]);
      rim.push_back(centre + 0.5 * (uv.x() * width * along + uv.y() * height * across));
    }
  return rim;
}

struct Errors {
  int blobs = 0, rims = 0, clipped = 0, cornered = 0;
  double nees = 0, growth2 = 0;  ///< means: of the centroid by axis, of the size over its sigma
  double worst_nees = 0;
};

/// Measures one lamp each in many pictures, exposed to 0.15 to 2 times full scale.
Errors errors_of(bool discs, double min_exposure, double max_exposure) {
  constexpr int count = 60;
  Random random(5);
  Errors errors;
  DetectOptions options;
  options.sensor.emplace();
  options.sensor->response = Response::srgb;
  options.colours = {green};
  for (int i = 0; i < count; ++i) {
    const Vector2d centre(60 + random.uniform(-0.5, 0.5), 60 + random.uniform(-0.5, 0.5));
    const double angle = random.uniform(0, pi), width = random.uniform(26, 60);
    const double height = discs ? width * random.uniform(0.6, 1) : random.uniform(10, 25);
    const double exposure =
        std::exp(random.uniform(std::log(min_exposure), std::log(max_exposure)));
    Canvas light(size, size);
    if (discs)
      light.add_disc(centre, width / 2, height / 2, angle, 0.8, exposure);
    else
      light.add(rectangle(centre, width, height, angle), 0.8, exposure);
    const Image image = picture(light, random.uniform(0, 1), random);
    const std::vector<Blob> blobs = detect(image.view(), options);
    if (blobs.empty()) continue;
    const Blob& blob = blobs.front();
    const Vector2d off = blob.centroid_px - centre;
    const double nees = off.dot(blob.covariance_px2.inverse() * off) / 2;
    ++errors.blobs;
    errors.clipped += blob.saturated;
    errors.cornered += blob.corners_px.size() == 4;
    errors.nees += nees;
    errors.worst_nees = std::max(errors.worst_nees, nees);
    if (blob.rim.empty()) continue;
    ++errors.rims;
    // Second moments of a uniform rectangle and of an ellipse: 1/12 and 1/16 of the squared side.
    const double mean_side = std::sqrt(width * height);
    const double seen_side = std::sqrt(blob.ellipse.semi_major_px * blob.ellipse.semi_minor_px) *
                             (discs ? 2 : std::sqrt(3.0));
    errors.growth2 +=
        square(0.5 * (seen_side - mean_side)) / (blob.rim_covariance_px2(0, 0) + 1e-6);
  }
  errors.nees /= errors.blobs;
  errors.growth2 /= errors.rims;
  return errors;
}

void expect_true_sigmas(const Errors& errors) {
  EXPECT_LT(errors.nees, 1.5);
  EXPECT_LT(errors.worst_nees, 10);
  EXPECT_LT(errors.growth2, 2);
}

TEST(ProcessedColours, SigmasOfDiscsHold) {
  const Errors dim = errors_of(true, 0.15, 0.7), bright = errors_of(true, 1.1, 2);
  EXPECT_EQ(dim.blobs + bright.blobs, 120);
  EXPECT_LT(dim.clipped, 10);
  EXPECT_GT(bright.clipped, 50);
  for (const Errors& errors : {dim, bright}) {
    EXPECT_GE(errors.rims, 57);
    expect_true_sigmas(errors);
  }
}

TEST(ProcessedColours, RectanglesKeepTheirCorners) {
  const Errors dim = errors_of(false, 0.15, 0.7), bright = errors_of(false, 1.1, 2);
  EXPECT_GE(dim.cornered, 57);
  EXPECT_GE(bright.cornered, 57);
  EXPECT_GT(bright.clipped, 50);
  for (const Errors& errors : {dim, bright}) expect_true_sigmas(errors);
}

}  // namespace
}  // namespace occ
