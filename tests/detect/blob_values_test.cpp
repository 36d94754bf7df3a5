// SPDX-License-Identifier: Apache-2.0
// Values of a blob beside its centre: background, flux, ellipse, response to a gradient of its
// light; and the share of noise pixels above the threshold. The truth is that of the drawing.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "tests/detect/detect_support.hpp"

namespace occ {
namespace {

using test::Canvas;

/// The blob nearest to a point; a default one and a failure if none is within 3 px.
Blob blob_near(const std::vector<Blob>& blobs, const Eigen::Vector2d& px) {
  for (const Blob& blob : blobs)
    if ((blob.centroid_px - px).norm() < 3) return blob;
  ADD_FAILURE() << "no blob at " << px.transpose();
  return {};
}

/// Detects spots on a background of `level_e` with these slopes, and returns the mean difference of
/// their background from the truth. Each difference must be below `max_dn`.
double background_error(const Eigen::Array2d& slope_e, double max_dn) {
  Canvas canvas(640, 512);
  for (int y = 0; y < 512; ++y)
    for (int x = 0; x < 640; ++x) canvas.at(x, y) = 800 + slope_e.x() * x + slope_e.y() * y;
  std::vector<Eigen::Vector2d> places;
  for (int row = 1; row < 7; ++row)  // the meshes at the border have the level of their neighbours
    for (int column = 1; column < 9; ++column) places.emplace_back(64 * column + 9, 64 * row + 40);
  for (const Eigen::Vector2d& px : places) canvas.add_spot(px, 1, 15000);
  Canvas::Noise noise;
  noise.full_scale_dn = 4095;
  noise.gain_dn_per_e = 0.5;
  Random random(4);
  const std::vector<Blob> blobs = detect(canvas.image(noise, &random).view());
  EXPECT_EQ(blobs.size(), places.size());
  double sum = 0;
  for (const Eigen::Vector2d& px : places) {
    // Thresholds, and with them the background, are constant over blocks of 64 x 64 pixels.
    const Eigen::Array2d block = (px.array() / 64).floor() * 64 + 32;
    const double truth = 5 + 0.5 * (800 + (slope_e * block).sum());
    const double found = blob_near(blobs, px).background_dn;
    EXPECT_NEAR(found, truth, max_dn) << px.transpose();
    sum += found - truth;
  }
  return sum / static_cast<double>(places.size());
}

TEST(BlobBackground, IsThatOfTheBlockAndUnbiased) {
  const double sigma_dn = 0.5 * std::sqrt(800.0 + 25);  // shot and read noise of a pixel
  EXPECT_NEAR(background_error({0, 0}, 1.2 * sigma_dn), 0, 0.08 * sigma_dn);
  EXPECT_NEAR(background_error({1, 1.5}, 2.5 * sigma_dn), 0, 0.25 * sigma_dn);
}

/// Part of the pixels of a noisy image without lamps that are above the threshold.
double share_above(double threshold_sigma, double background_e, const Canvas::Noise& noise) {
  Random random(5);
  const Canvas canvas(640, 512, background_e);
  DetectOptions options;
  options.threshold_sigma = threshold_sigma;
  options.min_area_px = 1;
  options.max_blobs = 1 << 20;
  double pixels = 0;
  for (const Blob& blob : detect(canvas.image(noise, &random).view(), options))
    pixels += blob.area_px;
  return pixels / (640 * 512);
}

TEST(Threshold, IsExceededByTheNoiseAsOftenAsItsSigmasSay) {
  // The estimated noise of a mesh scatters by a fifth. Meshes of too little noise count most, and
  // more so for high thresholds.
  Canvas::Noise noise;
  noise.read_e = 80;
  noise.gain_dn_per_e = 0.1;
  noise.black_dn = 60;
  const double sigmas = 1.5, expected = 0.5 * std::erfc(sigmas / std::sqrt(2.0));
  const double found = share_above(sigmas, 0, noise);
  EXPECT_GT(found, 0.8 * expected);
  EXPECT_LT(found, 1.5 * expected);
  noise.black_dn = 0;  // half of the noise is clipped at black: the rest has the same threshold
  const double clipped = share_above(sigmas, 0, noise);
  EXPECT_GT(clipped, 0.6 * expected);
  EXPECT_LT(clipped, 1.7 * expected);
}

TEST(BlobFlux, ErrorsAreAsLargeAsItSays) {
  const Canvas::Noise noise;
  for (const bool with_sensor : {true, false}) {
    for (const double radius : {0.0, 7.0}) {
      Random random(6);
      DetectOptions options;
      if (with_sensor) options.sensor = Canvas::sensor(noise, 0.9);
      double squares = 0, bias = 0;
      constexpr int trials = 120;
      for (int trial = 0; trial < trials; ++trial) {
        Canvas canvas(60, 60, 40);
        const Eigen::Vector2d px(random.uniform(25, 35), random.uniform(25, 35));
        double flux_e = 15000;
        if (radius > 0) {
          canvas.add_disc(px, radius, radius, 0, 0.9, 2000);
          flux_e = 2000 * pi * radius * radius;
        } else {
          canvas.add_spot(px, 0.9, flux_e);
        }
        const std::vector<Blob> blobs = detect(canvas.image(noise, &random).view(), options);
        ASSERT_EQ(blobs.size(), 1u);
        const double error = blobs[0].flux_dn - noise.gain_dn_per_e * flux_e;
        squares += std::pow(error / blobs[0].flux_sigma_dn, 2) / trials;
        bias += error / blobs[0].flux_sigma_dn / trials;
      }
      // Without a sensor the shot noise of the light is not known.
      EXPECT_LT(squares, with_sensor ? 1.35 : 12) << radius;
      EXPECT_GT(squares, with_sensor ? 0.75 : 0.5) << radius;
      EXPECT_LT(std::abs(bias), with_sensor ? 0.35 : 1) << radius;
    }
  }
}

TEST(BlobFlux, OfACutLampIsThatOfItsVisiblePart) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(77, 40), Eigen::Vector2d(2, 40),
                                    Eigen::Vector2d(40, 77), Eigen::Vector2d(40, 2)}) {
    Canvas canvas(80, 80);
    canvas.add_disc(px, 9, 9, 0, 0.8, 1e5);
    double visible_e = 0;
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x) visible_e += canvas.at(x, y);
    const std::vector<Blob> blobs = detect(canvas.image(fine, nullptr).view());
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_TRUE(blobs[0].cut_by_border);
    EXPECT_NEAR(blobs[0].flux_dn, fine.gain_dn_per_e * visible_e,
                0.01 * fine.gain_dn_per_e * visible_e)
        << px.transpose();
  }
}

TEST(BlobCovariance, OfASpotInStrongReadNoiseIsConsistentWithoutASensor) {
  Random random(8);
  Canvas::Noise noise;
  noise.read_e = 40;
  double nees = 0;
  constexpr int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    Canvas canvas(50, 50, 40);
    const Eigen::Vector2d px(random.uniform(22, 28), random.uniform(22, 28));
    canvas.add_spot(px, 1.2, 20000);
    const std::vector<Blob> blobs = detect(canvas.image(noise, &random).view());
    ASSERT_FALSE(blobs.empty());  // one mesh: a few pixels of noise may exceed the threshold
    const Eigen::Vector2d error = blobs[0].centroid_px - px;
    nees += error.dot(blobs[0].covariance_px2.inverse() * error) / (2 * trials);
  }
  EXPECT_NEAR(nees, 1, 0.3);
}

TEST(BlobMerged, ADiscWithASmallAppendageIsOneLamp) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  Canvas canvas(90, 90, 40);
  canvas.add_disc({45.3, 44.8}, 16, 16, 0, 0.8, 1e5);
  canvas.add_disc({45.3, 62.5}, 1.2, 4, 0, 0.8, 1e5);  // a streak at its lower end
  const std::vector<Blob> blobs = detect(canvas.image(fine, nullptr).view());
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_FALSE(blobs[0].merged);
  EXPECT_LT((blobs[0].centroid_px - Eigen::Vector2d(45.3, 44.8)).norm(), 0.5);
}

// The well is full below full scale. Read noise scatters the grey level of a clipped pixel, so
// pixels within three of its sigmas count as clipped.
TEST(BlobSaturated, FollowsTheFullWell) {
  Canvas::Noise noise;
  noise.full_scale_dn = 65535;
  noise.gain_dn_per_e = 1;
  noise.read_e = 100;
  DetectOptions options;
  options.sensor = Canvas::sensor(noise, 0.8);
  options.sensor->full_well_e = 20000;
  for (const auto& [below_sigmas, saturated] :
       {std::pair{0.0, true}, {2.5, true}, {3.5, false}, {10.0, false}}) {
    Canvas canvas(60, 60);
    canvas.add_disc({30.2, 29.7}, 9, 9, 0, 0.8, 20000 - 100 * below_sigmas);
    const std::vector<Blob> blobs = detect(canvas.image(noise, nullptr).view(), options);
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_EQ(blobs[0].saturated, saturated) << below_sigmas;
  }
}

/// Adds a Gaussian of this covariance whose light is integrated over each pixel.
void add_gaussian(const Eigen::Vector2d& px, const Eigen::Matrix2d& covariance, double flux_e,
                  const Eigen::Vector2d& gradient, Canvas& canvas) {
  const Eigen::Matrix2d inverse = covariance.inverse();
  const double peak = flux_e / (2 * pi * std::sqrt(covariance.determinant()));
  constexpr int parts = 4;
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.height(); ++x)
      for (int i = 0; i < parts * parts; ++i) {
        const Eigen::Vector2d at(x - 0.5 + (i % parts + 0.5) / parts,
                                 y - 0.5 + (i / parts + 0.5) / parts);
        const Eigen::Vector2d d = at - px;
        canvas.at(x, y) +=
            peak * (1 + gradient.dot(d)) * std::exp(-0.5 * d.dot(inverse * d)) / (parts * parts);
      }
}

TEST(BlobEllipse, OfASpotHasItsSecondMoments) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  for (const double angle : {-1.2, -0.3, 0.4, 1.1}) {
    const Eigen::Rotation2Dd turn(angle);
    const Eigen::Matrix2d covariance = turn.toRotationMatrix() *
                                       Eigen::Vector2d(4.0, 1.44).asDiagonal() *
                                       turn.toRotationMatrix().transpose();
    Canvas canvas(60, 60, 40);
    add_gaussian({30.2, 29.7}, covariance, 3e6, {0, 0}, canvas);
    const std::vector<Blob> blobs = detect(canvas.image(fine, nullptr).view());
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_NEAR(blobs[0].ellipse.semi_major_px, 2 * 2.0, 0.15);
    EXPECT_NEAR(blobs[0].ellipse.semi_minor_px, 2 * 1.2, 0.15);
    EXPECT_NEAR(blobs[0].ellipse.angle_rad, angle, 0.03);
    EXPECT_FALSE(blobs[0].merged);  // a single elongated lamp has no valley
    EXPECT_LT((blobs[0].centroid_px - Eigen::Vector2d(30.2, 29.7)).norm(), 0.01);
  }
}

TEST(BlobMerged, TwoSpotsSideBySideAreMarked) {
  const Canvas::Noise noise;
  for (const double angle : {0.0, 0.7, 1.5, 2.4}) {
    Random random(7);
    const Eigen::Vector2d half = 2.6 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    Canvas canvas(60, 60, 40);
    canvas.add_spot(Eigen::Vector2d(30, 30) + half, 1.3, 20000);
    canvas.add_spot(Eigen::Vector2d(30, 30) - half, 1.3, 16000);
    const std::vector<Blob> blobs = detect(canvas.image(noise, &random).view());
    ASSERT_EQ(blobs.size(), 1u) << angle;
    EXPECT_TRUE(blobs[0].merged) << angle;
    // The covariance holds both lamps.
    const Eigen::Vector2d error = blobs[0].centroid_px - (Eigen::Vector2d(30, 30) + half);
    EXPECT_LT(error.dot(blobs[0].covariance_px2.inverse() * error), 9) << angle;
  }
}

/// Disc with light 1 + gradient . d, as a sum of spots.
void add_sloped_disc(const Eigen::Vector2d& px, double radius, double psf_px, double level_e,
                     const Eigen::Vector2d& gradient, Canvas& canvas) {
  constexpr double step = 1;  // the sum ripples by less than 1e-5
  const int n = static_cast<int>(radius / step) + 1;
  for (int i = -n; i <= n; ++i) {
    // Each row of spots ends at the rim; the outermost ones have the rest of the area.
    const double y = (i + 0.5) * step;
    if (!(std::abs(y) < radius)) continue;
    const double half = std::sqrt(radius * radius - y * y);
    const int count = std::max(1, static_cast<int>(std::round(2 * half / step)));
    const double width = 2 * half / count;
    for (int k = 0; k < count; ++k) {
      const Eigen::Vector2d d(-half + (k + 0.5) * width, y);
      canvas.add_spot(px + d, psf_px, level_e * width * step * (1 + gradient.dot(d)));
    }
  }
}

/// Shift of a blob's centre per gradient of its light, by central differences.
template <class Draw>
Eigen::Matrix2d measured_response(const DetectOptions& options, const Canvas::Noise& noise,
                                  double gradient, Draw&& draw, Blob& uniform) {
  const auto blob_with = [&](const Eigen::Vector2d& g) {
    Canvas canvas(80, 80, 40);
    draw(g, canvas);
    const std::vector<Blob> blobs = detect(canvas.image(noise, nullptr).view(), options);
    EXPECT_EQ(blobs.size(), 1u);
    return blobs.empty() ? Blob{} : blobs[0];
  };
  uniform = blob_with({0, 0});
  Eigen::Matrix2d response;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d g = gradient * Eigen::Vector2d::Unit(axis);
    response.col(axis) = (blob_with(g).centroid_px - blob_with(-g).centroid_px) / (2 * gradient);
  }
  return response;
}

TEST(BlobLightResponse, OfASpotIsTheShiftByAGradientOfItsLight) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  DetectOptions options;
  options.sensor = Canvas::sensor(fine, 0.8);
  const Eigen::Vector2d px(40.2, 39.7);
  Blob blob;
  // The light of a lamp of 2.5 px, blurred by the PSF of 0.8 px.
  const Eigen::Matrix2d found = measured_response(
      options, fine, 0.02,
      [&](const Eigen::Vector2d& g, Canvas& canvas) {
        add_sloped_disc(px, 2.5, 0.8, 1e5, g, canvas);
      },
      blob);
  EXPECT_TRUE(blob.rim.empty());
  EXPECT_GT(found(0, 0), 0.5);
  EXPECT_LT((blob.light_response_px2 - found).norm(), 0.15 * found.norm()) << found;
}

TEST(BlobLightResponse, OfMomentsIsTheShiftByAGradientOfTheLight) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  DetectOptions options;
  options.sensor = Canvas::sensor(fine, 0.8);
  options.rims = false;
  const Eigen::Vector2d px(40.2, 39.7);
  Blob blob;
  const Eigen::Matrix2d found = measured_response(
      options, fine, 0.01,
      [&](const Eigen::Vector2d& g, Canvas& canvas) {
        add_sloped_disc(px, 9, 0.8, 1e5, g, canvas);
      },
      blob);
  EXPECT_NEAR(found(0, 0), 81.0 / 4, 0.5);  // the second moment of a disc
  EXPECT_LT((blob.light_response_px2 - found).norm(), 0.05 * found.norm());
  EXPECT_LT((blob.centroid_px - px).norm(), 0.02);
}

TEST(BlobLightResponse, OfASaturatedRimIsTheShiftByAGradientOfTheLight) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  DetectOptions options;
  options.sensor = Canvas::sensor(fine, 0.8);
  const Eigen::Vector2d px(40.2, 39.7);
  Blob blob;
  const Eigen::Matrix2d found = measured_response(
      options, fine, 0.02,
      [&](const Eigen::Vector2d& g, Canvas& canvas) {
        add_sloped_disc(px, 9, 0.8, 6e6, g, canvas);
      },
      blob);
  EXPECT_TRUE(blob.saturated);
  EXPECT_FALSE(blob.rim.empty());
  EXPECT_GT(found(0, 0), 0.5);
  EXPECT_LT((blob.light_response_px2 - found).norm(), 0.15 * found.norm()) << found;
}

TEST(BlobLightResponse, ARimOfLargeDiscsMeasuresTheGradientItself) {
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  const Eigen::Vector2d px(40.2, 39.7);
  Blob blob;
  const Eigen::Matrix2d found = measured_response(
      {}, fine, 0.02,
      [&](const Eigen::Vector2d& g, Canvas& canvas) {
        add_sloped_disc(px, 14, 0.8, 1e5, g, canvas);
      },
      blob);
  EXPECT_FALSE(blob.rim.empty());
  EXPECT_LT(found.norm(), 0.1);
  EXPECT_EQ(blob.light_response_px2.norm(), 0);
}

}  // namespace
}  // namespace occ
