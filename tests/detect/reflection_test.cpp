// SPDX-License-Identifier: Apache-2.0
// A reflected image has the reflected blobs: the result prefers neither axis nor direction.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "libocc/detect/detect_windows.hpp"
#include "tests/detect/detect_support.hpp"

namespace occ {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using test::Canvas;

/// Exchanges x and y, then reverses x, then y.
struct Reflection {
  const char* name;
  bool exchanged, reversed_x, reversed_y;

  int width(const Image& image) const { return exchanged ? image.height : image.width; }
  int height(const Image& image) const { return exchanged ? image.width : image.height; }

  Matrix2d matrix() const {
    Matrix2d m = Matrix2d::Identity();
    if (exchanged) m << 0, 1, 1, 0;
    if (reversed_x) m.row(0) *= -1;
    if (reversed_y) m.row(1) *= -1;
    return m;
  }
  Vector2d shift(const Image& image) const {
    return {reversed_x ? width(image) - 1 : 0, reversed_y ? height(image) - 1 : 0};
  }

  Image operator()(const Image& image) const {
    Image out = image;
    out.width = width(image);
    out.height = height(image);
    const Vector2d by = shift(image);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const Vector2d to = matrix() * Vector2d(x, y) + by;
        const auto i = static_cast<std::size_t>(y * image.width + x);
        const auto k = static_cast<std::size_t>(to.y() * out.width + to.x());
        if (!image.u8.empty()) out.u8[k] = image.u8[i];
        if (!image.u16.empty()) out.u16[k] = image.u16[i];
      }
    return out;
  }
};

constexpr Reflection reflections[] = {{"reversed x", false, true, false},
                                      {"reversed y", false, false, true},
                                      {"exchanged", true, false, false},
                                      {"turned by 90 degrees", true, true, false}};

Vector2d direction(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

double nearest_px(const std::vector<RimPoint>& rim, const Vector2d& px) {
  double nearest = 1e9;
  for (const RimPoint& point : rim) nearest = std::min(nearest, (point.px - px).norm());
  return nearest;
}

void expect_reflected(const Blob& blob, const Blob& seen, const Reflection& by, const Image& image,
                      double tolerance) {
  const Matrix2d m = by.matrix();
  const Vector2d shift = by.shift(image);
  const double size = std::max(1.0, blob.ellipse.semi_major_px);
  // Errors of a plateau are evaluated at 16 points of the rim, whose places depend on the axes.
  const double of_covariance = blob.cut_by_border ? 0.2 : 10 * tolerance;
  EXPECT_LT((m * blob.centroid_px + shift - seen.centroid_px).norm(), tolerance);
  EXPECT_LT((m * blob.covariance_px2 * m.transpose() - seen.covariance_px2).norm(),
            of_covariance * blob.covariance_px2.norm());
  EXPECT_LT((m * blob.light_response_px2 * m.transpose() - seen.light_response_px2).norm(),
            10 * tolerance * size * size);
  EXPECT_NEAR(blob.flux_dn, seen.flux_dn, tolerance * blob.flux_dn);
  EXPECT_NEAR(blob.flux_sigma_dn, seen.flux_sigma_dn, 10 * tolerance * blob.flux_sigma_dn);
  EXPECT_EQ(blob.peak_dn, seen.peak_dn);
  EXPECT_NEAR(blob.background_dn, seen.background_dn, 1e-4 * blob.background_dn + 1e-9);
  EXPECT_NEAR(blob.noise_dn, seen.noise_dn, 10 * tolerance * blob.noise_dn);
  EXPECT_NEAR(blob.area_px, seen.area_px, blob.striped ? tolerance * blob.area_px : 0);
  const Vector2d a = m * Vector2d(blob.x0, blob.y0) + shift;
  const Vector2d b = m * Vector2d(blob.x1, blob.y1) + shift;
  // The box of a striped lamp is that of its ellipse.
  const double of_box = blob.striped ? 1 : 0;
  EXPECT_LE((a.cwiseMin(b) - Vector2d(seen.x0, seen.y0)).cwiseAbs().maxCoeff(), of_box);
  EXPECT_LE((a.cwiseMax(b) - Vector2d(seen.x1, seen.y1)).cwiseAbs().maxCoeff(), of_box);
  EXPECT_NEAR(blob.ellipse.semi_major_px, seen.ellipse.semi_major_px, 2 * tolerance * size);
  EXPECT_NEAR(blob.ellipse.semi_minor_px, seen.ellipse.semi_minor_px, 2 * tolerance * size);
  if (blob.ellipse.semi_major_px > 1.1 * blob.ellipse.semi_minor_px) {
    const Vector2d axis = m * direction(blob.ellipse.angle_rad);
    EXPECT_GT(std::abs(axis.dot(direction(seen.ellipse.angle_rad))), 1 - 10 * tolerance);
  }
  EXPECT_EQ(blob.saturated, seen.saturated);
  EXPECT_EQ(blob.merged, seen.merged);
  EXPECT_EQ(blob.cut_by_border, seen.cut_by_border);
  EXPECT_EQ(blob.striped, seen.striped);
  ASSERT_EQ(blob.frequency_hz.has_value(), seen.frequency_hz.has_value());
  if (blob.frequency_hz) {
    EXPECT_NEAR(*blob.frequency_hz, *seen.frequency_hz, 0.3 * blob.frequency_sigma_hz);
    EXPECT_NEAR(blob.frequency_sigma_hz / seen.frequency_sigma_hz, 1, 0.1);
  }
  ASSERT_EQ(blob.rim.size(), seen.rim.size());
  double farthest_px = 0;
  for (const RimPoint& point : blob.rim)
    farthest_px = std::max(farthest_px, nearest_px(seen.rim, m * point.px + shift));
  EXPECT_LT(farthest_px, 3 * tolerance);
  // A stretch is the cosine and sine of twice an angle, which the exchange of axes reverses.
  RimErrorCovariance::Scalar sign = by.exchanged ? -1 : 1;
  RimErrorCovariance of_errors = RimErrorCovariance::Zero();
  of_errors(0, 0) = 1;
  of_errors.block<2, 2>(1, 1) = m;
  of_errors(3, 3) = sign;
  of_errors(4, 4) = sign * m.determinant();
  EXPECT_LT((of_errors * blob.rim_covariance_px2 * of_errors.transpose() - seen.rim_covariance_px2)
                .norm(),
            of_covariance * blob.rim_covariance_px2.norm() + 1e-15);
}

void expect_reflected(const Image& image, const DetectOptions& options, std::size_t blobs,
                      double tolerance) {
  const std::vector<Blob> found = detect(image.view(), options);
  ASSERT_EQ(found.size(), blobs);
  for (const Reflection& by : reflections) {
    SCOPED_TRACE(by.name);
    DetectOptions reflected = options;
    if (reflected.sensor && by.exchanged)
      reflected.sensor->readout =
          options.sensor->readout == Readout::rows ? Readout::columns : Readout::rows;
    const Image seen = by(image);
    const std::vector<Blob> again = detect(seen.view(), reflected);
    ASSERT_EQ(again.size(), found.size());
    for (const Blob& blob : found) {
      const Vector2d px = by.matrix() * blob.centroid_px + by.shift(image);
      SCOPED_TRACE(px.transpose());
      const auto same = std::min_element(again.begin(), again.end(), [&](auto& a, auto& b) {
        return (a.centroid_px - px).norm() < (b.centroid_px - px).norm();
      });
      expect_reflected(blob, *same, by, image, tolerance);
    }
  }
}

Canvas::Noise fine() {
  Canvas::Noise noise;
  noise.full_scale_dn = 65535;
  return noise;
}

DetectOptions known_sensor() {
  DetectOptions options;
  options.sensor = Canvas::sensor(fine(), 0.8);
  return options;
}

TEST(Reflections, OfSpotsAndDiscs) {
  Canvas canvas(320, 256, 400);
  canvas.add_spot({40.3, 31.6}, 1.1, 4e4);
  canvas.add_spot({100.7, 30.2}, 2.3, 4e5);
  canvas.add_disc({170.4, 40.3}, 3.4, 2.1, 0.7, 0.8, 2e5);
  canvas.add_disc({60.3, 110.8}, 16, 11, 0.6, 0.8, 2e5);
  canvas.add_disc({160.6, 120.2}, 30, 19, -1.1, 0.9, 3e5);
  canvas.add_disc({250.2, 100.4}, 9, 8, 1.2, 0.8, 3e6);  // saturated
  canvas.add_disc({270.3, 210.9}, 12, 12, 0, 0.8, 2e5);  // two that touch
  canvas.add_disc({284.7, 224.1}, 8, 8, 0, 0.8, 2e5);
  canvas.add_disc({60.9, 250.1}, 14, 10, 0.3, 0.8, 2e5);  // cut by the border
  const Image image = canvas.image(fine(), nullptr);
  expect_reflected(image, {}, 8, 2e-3);
  expect_reflected(image, known_sensor(), 8, 2e-3);
  DetectOptions options;
  options.rims = false;
  expect_reflected(image, options, 8, 2e-3);
}

// Lamps that fill many meshes of the background: whole, and cut by one and by two borders. Spots
// close to them and far away have the background between the lamps.
TEST(Reflections, OfLampsCloseToTheCamera) {
  for (const Vector2d& px : {Vector2d(220, 190), Vector2d(350, 180), Vector2d(370, 300)}) {
    SCOPED_TRACE(px.transpose());
    Canvas canvas(448, 384, 400);
    canvas.add_disc(px, 130, 120, 0.4, 0.9, 2e5);
    canvas.add_spot({20.3, 25.8}, 1.1, 4e4);
    canvas.add_spot({60.6, 350.2}, 1.3, 6e4);
    expect_reflected(canvas.image(fine(), nullptr), {}, 3, 5e-3);
  }
}

// Two lamps in one blob.
TEST(Reflections, OfPairsOfSpots) {
  Canvas canvas(320, 256, 400);
  for (const double angle : {0.3, 1.0, 1.9, 2.7}) {
    const Vector2d px(60 + 70 * angle, 60 + 40 * angle);
    canvas.add_spot(px + 2.6 * direction(angle), 1.3, 2e4);
    canvas.add_spot(px - 2.6 * direction(angle), 1.3, 1.6e4);
  }
  expect_reflected(canvas.image(fine(), nullptr), {}, 4, 2e-3);
}

enum class StripedLampShape { disc, rectangle, gaussian };

/// Lamp that blinks with a square wave under a rolling shutter by rows.
void add_stripes(Canvas& canvas, const Vector2d& centre, const Vector2d& semi,
                 StripedLampShape shape, double lines_per_period, double phase, int first_row = 0) {
  for (int y = first_row; y < canvas.height(); ++y) {
    const double cycles = y / lines_per_period + phase;
    if (cycles - std::floor(cycles) > 0.5) continue;
    for (int x = 0; x < 240; ++x) {
      const Vector2d d = Vector2d(x, y) - centre, q = d.cwiseQuotient(semi);
      const double slope = q.cwiseQuotient(semi).norm() / std::max(1e-9, q.norm());
      const double outside = shape == StripedLampShape::rectangle
                                 ? (d.cwiseAbs() - semi).maxCoeff()
                                 : (q.norm() - 1) / std::max(1e-9, slope);
      canvas.at(x, y) +=
          2e5 * (shape == StripedLampShape::gaussian ? std::exp(-2 * q.squaredNorm())
                                                     : 0.5 * std::erfc(outside / std::sqrt(2.0)));
    }
  }
}

TEST(Reflections, OfStripedLamps) {
  DetectOptions options = known_sensor();
  options.sensor->row_time_s = 2e-5;
  options.sensor->exposure_s = 5e-5;
  for (const auto shape :
       {StripedLampShape::disc, StripedLampShape::rectangle, StripedLampShape::gaussian}) {
    SCOPED_TRACE(static_cast<int>(shape));
    const double phase = shape == StripedLampShape::disc ? 0.1 : 0.6;
    Canvas canvas(240, 240, 400);
    add_stripes(canvas, {70.3, 80.8}, {44, 38}, shape, 13.3, phase);
    const bool alone = shape == StripedLampShape::gaussian;  // its image is wide
    if (!alone) add_stripes(canvas, {180.3, 160.8}, {33, 38}, shape, 11.1, phase);
    expect_reflected(canvas.image(fine(), nullptr), options, alone ? 1 : 2, 0.02);
    if (alone) continue;
    Canvas hidden(240, 240, 400);  // its upper part is behind a straight edge
    add_stripes(hidden, {110.3, 120.8}, {44, 48}, shape, 9.7, phase, 100);
    expect_reflected(hidden.image(fine(), nullptr), options, 1, 0.02);
  }
}

}  // namespace
}  // namespace occ
