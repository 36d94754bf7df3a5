// SPDX-License-Identifier: Apache-2.0
// Reported residuals of lamps, and contradictions by the sizes of their images.
#include "libocc/refine/internal/residuals.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/light_evidence.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal;
using namespace internal::refine;
namespace {

struct SeenRoom {
  Scene scene = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 0.8}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  std::vector<Blob> blobs;

  explicit SeenRoom(int rim_points, double growth_px = 0) {
    test::Measurement m;
    m.rim_points = rim_points;
    m.growth_px = growth_px;
    blobs = test::exact_blobs(scene, pose, m);
    for (std::size_t i = 0; i < blobs.size(); ++i) {
      const auto axes = *predicted_axes_px(scene.lamps[i], pose, scene.camera);
      // Second moments without a rim contain the blur.
      const double blur_px = rim_points > 0 ? 0 : 2 * formation::gaussian_blur_px(scene);
      blobs[i].ellipse.semi_minor_px = std::hypot(axes[0], blur_px);
      blobs[i].ellipse.semi_major_px = std::hypot(axes[1], blur_px);
    }
  }
  Refined reported(Rung rung, double growth_px = 0) const {
    RefineOptions options;
    options.rung = rung;
    const std::vector<Match> matches = test::in_order(scene);
    const Observations observations = observe(matches, blobs, scene, options);
    State state{pose};
    state.growth_px = growth_px;
    Refined refined;
    report_residuals(state, matches, observations, scene, rung, refined);
    return refined;
  }
};

TEST(Residuals, OfCentroidsAreTheirDistances) {
  SeenRoom room(0);
  double sum = 0;
  for (std::size_t i = 0; i < room.blobs.size(); ++i) {
    const double off = 0.1 * static_cast<double>(i);
    room.blobs[i].centroid_px += off * Eigen::Vector2d(0.6, -0.8);
    sum += off * off;
  }
  const Refined refined = room.reported(Rung::centres);
  ASSERT_EQ(refined.lamps.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    const LampResidual& residual = refined.lamps[i];
    EXPECT_EQ(residual.match.lamp, static_cast<int>(i));
    EXPECT_EQ(residual.rung, Rung::centres);
    EXPECT_NEAR(residual.rms_px, 0.1 * static_cast<double>(i), 1e-9);
    EXPECT_LT((residual.centre_px -
               *project_lamp_centre(room.scene.lamps[i], room.pose, room.scene.camera))
                  .norm(),
              1e-9);
  }
  EXPECT_NEAR(refined.rms_px, std::sqrt(sum / 6), 1e-9);
}

TEST(Residuals, MergedBlobsCountOnlyIfAllAreMerged) {
  SeenRoom room(0);
  room.blobs[1].centroid_px.x() += 0.6;
  room.blobs[4].centroid_px.x() += 8;
  room.blobs[4].merged = true;
  const Refined refined = room.reported(Rung::centres);
  EXPECT_NEAR(refined.lamps[4].rms_px, 8, 1e-9);
  EXPECT_NEAR(refined.rms_px, 0.6 / std::sqrt(5), 1e-9);
  for (Blob& blob : room.blobs) blob.merged = true;
  EXPECT_NEAR(room.reported(Rung::centres).rms_px, std::sqrt((64 + 0.36) / 6), 1e-9);
}

TEST(Residuals, OfTheRungOfPointsAreThoseOfTheLampsCentres) {
  const SeenRoom room(0);
  const Refined refined = room.reported(Rung::points);
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector2d centre =
        *room.scene.camera.project(room.pose * room.scene.lamps[i].centre_m);
    EXPECT_EQ(refined.lamps[i].rung, Rung::points);
    EXPECT_LT((refined.lamps[i].centre_px - centre).norm(), 1e-9);
    EXPECT_NEAR(refined.lamps[i].rms_px, (room.blobs[i].centroid_px - centre).norm(), 1e-9);
  }
}

TEST(Residuals, OfRimsAreTheDistancesOfTheirPoints) {
  SeenRoom room(40);
  const double out_px = 0.3, across_px = 0.5;
  for (std::size_t k = 0; k < room.blobs[2].rim.size(); ++k)
    room.blobs[2].rim[k].px += (k % 2 == 0 ? out_px : -out_px) * room.blobs[2].rim[k].normal;
  room.blobs[3].centroid_px.x() += across_px;
  room.blobs[4].rim.clear();
  const Refined refined = room.reported(Rung::rims);
  EXPECT_NEAR(refined.lamps[1].rms_px, 0, 1e-3);
  EXPECT_NEAR(refined.lamps[2].rms_px, out_px, 1e-2);
  EXPECT_NEAR(refined.lamps[3].rms_px, 0, 1e-3);
  EXPECT_EQ(refined.lamps[3].rung, Rung::rims);
  EXPECT_EQ(refined.lamps[4].rung, Rung::centres);
  // The residual of all lamps is that of the centres.
  EXPECT_NEAR(refined.rms_px, across_px / std::sqrt(6), 1e-6);
}

TEST(Residuals, OfSaturatedRimsAreWithoutTheirGrowth) {
  SeenRoom room(40, 1.2);
  room.blobs[3].saturated = false;
  const Refined refined = room.reported(Rung::rims, 1.2);
  EXPECT_NEAR(refined.lamps[2].rms_px, 0, 0.02);
  EXPECT_NEAR(refined.lamps[3].rms_px, 1.2, 0.02);
}

TEST(Residuals, OfACutLampAreThoseOfItsRim) {
  SeenRoom room(40);
  room.blobs[1].cut_by_border = true;
  room.blobs[1].centroid_px.x() += 9;  // centroid of the visible part
  for (RimPoint& point : room.blobs[1].rim) point.px += 0.6 * point.normal;
  const Refined refined = room.reported(Rung::rims);
  EXPECT_NEAR(refined.lamps[1].rms_px, 0.6, 0.01);
  EXPECT_NEAR(refined.rms_px, 0.6 / std::sqrt(6), 0.01);
}

TEST(PredictedAxes, AreThoseOfTheProjectedDisc) {
  // Frontal disc: f r / d. Tilted by 60 degrees about x: half as high, to second order in its size.
  const Camera camera = test::vga_camera();
  Lamp lamp = test::disc_lamp(0, {0, 0, 4}, 0.08);
  lamp.normal = {0, 0, -1};
  const auto frontal = *predicted_axes_px(lamp, {}, camera);
  EXPECT_NEAR(frontal[0], 10, 1e-3);
  EXPECT_NEAR(frontal[1], 10, 1e-3);
  lamp.normal = {0, std::sin(1.0471975511965976), -0.5};
  const auto tilted = *predicted_axes_px(lamp, {}, camera);
  EXPECT_NEAR(tilted[0], 5, 0.01);
  EXPECT_NEAR(tilted[1], 10, 0.01);
  const Eigen::Matrix2d moments = *image_moments_px2(lamp, {}, camera);
  EXPECT_NEAR(moments(0, 0), 100, 0.1);
  EXPECT_NEAR(moments(1, 1), 25, 0.1);
  EXPECT_NEAR(moments(0, 1), 0, 1e-6);
  lamp.normal.z() = 0.5;
  EXPECT_FALSE(predicted_axes_px(lamp, {}, camera));
}

TEST(PredictedLightAxes, AreTwoDeviationsOfTheLight) {
  // Frontal rectangle of 0.4 m by 0.2 m: half the side over sqrt(3), times two.
  const Camera camera = test::vga_camera();
  Lamp lamp = test::disc_lamp(0, {0, 0, 4});
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.4, 0.2};
  lamp.normal = {0, 0, -1};
  lamp.x_axis = {0, 1, 0};
  const Eigen::Array2d axes = *predicted_light_axes_px(lamp, {}, camera);
  EXPECT_NEAR(axes[0], 25 / std::sqrt(12) * 2, 1e-9);
  EXPECT_NEAR(axes[1], 50 / std::sqrt(12) * 2, 1e-9);
  lamp.shape = LampShape::lame;  // an ellipse
  lamp.exponent = 2;
  EXPECT_NEAR((*predicted_light_axes_px(lamp, {}, camera))[1], 25, 1e-9);
  // One end of either side is behind the camera.
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {12, 0.2};
  lamp.x_axis = {0, 0, 1};
  lamp.normal = {0, -1, 0};
  EXPECT_FALSE(predicted_light_axes_px(lamp, {}, camera));
  lamp.size_m = {0.2, 12};
  lamp.x_axis = {1, 0, 0};
  EXPECT_FALSE(predicted_light_axes_px(lamp, {}, camera));
  lamp.size_m = {0.2, 6};
  EXPECT_TRUE(predicted_light_axes_px(lamp, {}, camera));
}

/// A lamp of a pose that fits: rim of `points`, or none.
struct SizedRoom : SeenRoom {
  Refined refined;

  explicit SizedRoom(int points = 40) : SeenRoom(points) {
    refined = reported(points > 0 ? Rung::rims : Rung::centres);
    refined.cam_from_world = pose;
  }
  void keep(std::size_t lamps) { refined.lamps.resize(lamps); }
  double size_px(std::size_t i) const {
    return std::sqrt(blobs[i].ellipse.semi_minor_px * blobs[i].ellipse.semi_major_px);
  }
  std::string message() const { return size_contradiction(refined, blobs, scene); }
};

TEST(SizeContradiction, IsARimThatMissesByMoreThanItsErrors) {
  SizedRoom room;
  EXPECT_EQ(room.message(), "");
  const double size = room.size_px(2);
  room.refined.lamps[2].rms_px = 0.04 * size;
  EXPECT_EQ(room.message(), "");
  room.refined.lamps[2].rms_px = 0.07 * size;
  EXPECT_NE(room.message().find("lamp 2's rim misses by"), std::string::npos) << room.message();
  // Three lamps fit some pose in any case: the sizes must agree better.
  room.refined.lamps[2].rms_px = 0.03 * size;
  EXPECT_EQ(room.message(), "");
  room.keep(3);
  EXPECT_NE(room.message(), "");
  room.refined.lamps[2].rms_px = 0.015 * size;
  EXPECT_EQ(room.message(), "");
}

TEST(SizeContradiction, AllowsForNoiseAndGrowthOfTheRim) {
  SizedRoom room;
  const double size = room.size_px(2), miss = 0.2 * size;
  room.refined.lamps[2].rms_px = miss;
  for (RimPoint& point : room.blobs[2].rim) point.sigma_px = miss / 4;
  EXPECT_EQ(room.message(), "");
  for (RimPoint& point : room.blobs[2].rim) point.sigma_px = miss / 7;
  EXPECT_NE(room.message(), "");
  room.blobs[2].rim_covariance_px2(0, 0) = miss * miss / 4;
  EXPECT_EQ(room.message(), "");
  room.blobs[2].rim_covariance_px2(0, 0) = miss * miss / 16;
  EXPECT_NE(room.message(), "");
}

TEST(SizeContradiction, IsNotTestedOfCodedSaturatedAndExcludedLamps) {
  const auto message_with = [](auto change) {
    SizedRoom room;
    room.refined.lamps[2].rms_px = 0.2 * room.size_px(2);
    EXPECT_NE(room.message(), "");
    change(room);
    return room.message();
  };
  EXPECT_EQ(message_with([](SizedRoom& r) { r.blobs[2].saturated = true; }), "");
  EXPECT_EQ(message_with([](SizedRoom& r) { r.refined.lamps[2].contradicts = true; }), "");
  EXPECT_EQ(message_with([](SizedRoom& r) {
              r.blobs[2].frequency_hz = 1000;
              r.scene.lamps[2].frequency_hz = 1000;
            }),
            "");
  EXPECT_NE(message_with([](SizedRoom& r) { r.scene.lamps[2].frequency_hz = 1000; }), "");
  EXPECT_NE(message_with([](SizedRoom& r) { r.blobs[2].frequency_hz = 1000; }), "");
}

TEST(SizeContradiction, OfThreeLampsWithoutRimsIsThatOfTheirAxes) {
  SizedRoom room(0);
  for (Lamp& lamp : room.scene.lamps) lamp.radius_m = 0.2;
  for (std::size_t i = 0; i < room.blobs.size(); ++i) {
    const auto axes = *predicted_axes_px(room.scene.lamps[i], room.pose, room.scene.camera);
    room.blobs[i].ellipse.semi_minor_px = axes[0];
    room.blobs[i].ellipse.semi_major_px = axes[1];
  }
  const double minor = room.blobs[1].ellipse.semi_minor_px;
  EXPECT_GT(minor, 20);
  room.blobs[1].ellipse.semi_minor_px = 0.6 * minor;
  EXPECT_EQ(room.message(), "");  // six lamps agree on the pose
  room.keep(3);
  EXPECT_NE(room.message().find("lamp 1 has another size"), std::string::npos) << room.message();
  room.blobs[1].ellipse.semi_minor_px = 1.4 * minor;
  EXPECT_NE(room.message(), "");
  room.blobs[1].ellipse.semi_minor_px = 0.9 * minor;
  EXPECT_EQ(room.message(), "");
  room.blobs[1].ellipse.semi_major_px *= 1.4;
  EXPECT_NE(room.message(), "");
  const auto message_with = [&](auto change) {
    SizedRoom changed = room;
    change(changed);
    return changed.message();
  };
  EXPECT_EQ(message_with([](SizedRoom& r) { r.blobs[1].merged = true; }), "");
  EXPECT_EQ(message_with([](SizedRoom& r) { r.blobs[1].cut_by_border = true; }), "");
  EXPECT_EQ(message_with([](SizedRoom& r) { r.blobs[1].striped = true; }), "");
  EXPECT_EQ(message_with([](SizedRoom& r) { r.scene.lamps[1].shape = LampShape::point; }), "");
  // A partial blob is not counted: three whole ones of four remain.
  SizedRoom four = room;
  four.refined.lamps.push_back(four.refined.lamps[0]);
  four.refined.lamps[3].match = {3, 3};
  EXPECT_EQ(four.message(), "");
  four.blobs[3].merged = true;
  EXPECT_NE(four.message(), "");
  // A lamp that the pose does not show.
  room.blobs[1].ellipse.semi_major_px /= 1.4;
  EXPECT_EQ(room.message(), "");
  room.scene.lamps[1].normal = Eigen::Vector3d::UnitZ();
  EXPECT_NE(room.message(), "");
}

TEST(SizeContradiction, SmallSpotsHaveNoShape) {
  SizedRoom room(0);
  for (Lamp& lamp : room.scene.lamps) lamp.radius_m = 0.012;
  const auto axes = *predicted_axes_px(room.scene.lamps[1], room.pose, room.scene.camera);
  EXPECT_LT(axes[1], 3);
  room.keep(3);
  for (Blob& blob : room.blobs) blob.ellipse.semi_minor_px = blob.ellipse.semi_major_px = 6;
  EXPECT_EQ(room.message(), "");
}

/// Beta function B(1 + k, 6 + n - k) over B(1, 6 + n) by Simpson's rule.
double ratio_of_betas(int k, int n) {
  constexpr int steps = 4000;
  double some = 0, none = 0;
  for (int i = 0; i <= steps; ++i) {
    const double x = static_cast<double>(i) / steps;
    const double weight = i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2;
    some += weight * std::pow(x, k) * std::pow(1 - x, n - k + 5);
    none += weight * std::pow(1 - x, n + 5);
  }
  return some / none;
}

SeenLight seen_light(double log_ratio, double log_light, double log_size, double sigma) {
  SeenLight light;
  light.log_size = log_size;
  light.flux = FluxRatio{log_ratio, log_light, sigma, false};
  return light;
}

TEST(LightRatio, IsThatOfTheMostFavourableFactor) {
  const std::vector<SeenLight> lamps{seen_light(0.1, 2, 0.3, 0.5), seen_light(0.7, 3, -0.2, 0.4),
                                     seen_light(-0.4, 1, 0.1, 0.8), SeenLight{1.1, {}, 0.05}};
  const auto at = [&](double gain) {
    double product = 1;
    for (const SeenLight& lamp : lamps) {
      double density = std::exp(lamp.log_size);
      if (lamp.flux)
        density *= std::exp(-0.5 * std::pow((lamp.flux->log_ratio - gain) / lamp.flux->sigma, 2));
      product *= (1 - lamp.open) * density + lamp.open;
    }
    return std::log(product);
  };
  const double gains[] = {0.1, 0.7, -0.4};
  double expected = -1e9;
  for (const double gain : gains) expected = std::max(expected, at(gain));
  EXPECT_NEAR(log_light_ratio(lamps, {}), expected, 1e-12);
  // Blobs of more than three times the flux of the brightest lamp, which is 3 + gain.
  const std::vector<double> others{0, 3, 4.1, 4.6, 4.9, 7};
  expected = -1e9;
  for (const double gain : gains) {
    int brighter = 0;
    for (const double other : others) brighter += other > gain + 3 + std::log(3);
    expected = std::max(expected, at(gain) + std::log(ratio_of_betas(brighter, 6)));
  }
  EXPECT_NEAR(log_light_ratio(lamps, others), expected, 1e-6);
}

TEST(LightRatio, OfSizesAloneNeedsNoFlux) {
  const std::vector<SeenLight> lamps{{0.7, {}, 0.02}, {-9, {}, 0.02}};
  EXPECT_NEAR(log_light_ratio(lamps, {5, 6}),
              std::log(0.98 * std::exp(0.7) + 0.02) + std::log(0.98 * std::exp(-9) + 0.02), 1e-12);
}

TEST(FluxRatioOfALamp, AddsTheVariancesAndKnowsLowerBounds) {
  SeenRoom room(0);
  Lamp& lamp = room.scene.lamps[1];
  Blob& blob = room.blobs[1];
  blob.flux_dn = 400;
  blob.flux_sigma_dn = 120;
  lamp.power_sigma = 0.4;
  const auto ratio = [&] { return *flux_ratio(lamp, blob, room.pose, room.scene); };
  // Powers are seldom measured: half of ln of the flux is unknown.
  EXPECT_NEAR(ratio().sigma, std::sqrt(0.16 + 0.09 + 0.25), 1e-12);
  EXPECT_NEAR(ratio().log_light + ratio().log_ratio, std::log(400), 1e-12);
  EXPECT_FALSE(ratio().at_least);
  for (bool Blob::*flag : {&Blob::saturated, &Blob::cut_by_border, &Blob::striped}) {
    blob.*flag = true;
    EXPECT_TRUE(ratio().at_least);
    blob.*flag = false;
  }
  lamp.frequency_hz = 500;
  EXPECT_TRUE(ratio().at_least);
  lamp.frequency_hz.reset();
  lamp.code.emplace();
  EXPECT_TRUE(ratio().at_least);
  blob.flux_sigma_dn = 0;  // no measurement
  EXPECT_FALSE(flux_ratio(lamp, blob, room.pose, room.scene));
  blob.flux_sigma_dn = 120;
  room.scene.lens.vignetting = {-0.5};
  const double transmission = std::exp(std::log(400) - *log_flux(blob, room.scene));
  EXPECT_LT(transmission, 1);
  EXPECT_GT(transmission, 0.5);
}

}  // namespace
}  // namespace occ
