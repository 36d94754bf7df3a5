// SPDX-License-Identifier: Apache-2.0
// Measurements that the refinement takes from each blob, their sigmas, and blobs that it ignores.
#include "libocc/refine/internal/observations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <vector>

#include "libocc/refine/internal/light_evidence.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

/// One lamp of the room, seen from below, as a blob of 20 px with its image.
struct OneLamp {
  Scene scene = test::irregular_room();
  std::vector<Blob> blobs;
  RefineOptions options;
  Image image;

  OneLamp() {
    scene.lamps.resize(1);
    const Rigid3 pose = look_at({1.0, 1.1, 1.5}, {0.9, 1.0, 3}, {0.2, 1, 0});
    blobs = test::exact_blobs(scene, pose, {24, 0.04, 0.03, 0, 0, 0.02});
    Blob& blob = blobs[0];
    const Eigen::Vector2d c = blob.centroid_px;
    blob.x0 = static_cast<int>(c.x()) - 20;
    blob.x1 = blob.x0 + 41;
    blob.y0 = static_cast<int>(c.y()) - 20;
    blob.y1 = blob.y0 + 41;
    blob.ellipse = {c, 20, 20, 0};
    blob.covariance_px2 << 0.01, 0.002, 0.002, 0.02;
    options.flux = FluxModel::common_factor;
    image.width = scene.camera.width();
    image.height = scene.camera.height();
    image.u8.assign(static_cast<std::size_t>(image.width * image.height), 40);
  }

  Blob& blob() { return blobs[0]; }
  Observations all() const { return observe({{0, 0}}, blobs, scene, options); }
  LampObservation seen() const { return all().lamps.at(0); }
  LampObservation with_pixels() const {
    RefineOptions direct = options;
    direct.rung = Rung::direct;
    const ImageView view = image.view();
    return observe({{0, 0}}, blobs, scene, direct, &view).lamps.at(0);
  }
};

TEST(Observe, TheCentroidHasTheErrorsOfBlobAndModel) {
  OneLamp lamp;
  lamp.options.model_sigma_px = 0.2;
  const Eigen::Matrix2d expected =
      (lamp.blob().covariance_px2 + 0.04 * Eigen::Matrix2d::Identity()).inverse();
  EXPECT_TRUE(lamp.seen().has_centroid);
  EXPECT_LT((lamp.seen().centroid_information - expected).norm(), 1e-9 * expected.norm());
  EXPECT_NEAR(lamp.seen().common_covariance_px2(1, 1), 0.04 + lamp.blob().rim_covariance_px2(1, 1),
              1e-12);
  lamp.blob().saturated = true;  // its growth may be uneven
  EXPECT_LT(lamp.seen().centroid_information(0, 0), expected(0, 0));
  EXPECT_GT(lamp.seen().centroid_information(0, 0), 0.5 * expected(0, 0));
  lamp.blob().saturated = false;
  lamp.blob().cut_by_border = true;
  EXPECT_FALSE(lamp.seen().has_centroid);
  lamp.blob().cut_by_border = false;
  lamp.options.model_sigma_px = 0;
  lamp.blob().covariance_px2 << 1, 2, 2, 1;
  EXPECT_THROW(lamp.seen(), std::invalid_argument);
}

TEST(Observe, RimsAreUsedOnTheirRungWithTheirSigma) {
  OneLamp lamp;
  const std::size_t points = lamp.blob().rim.size();
  ASSERT_GT(points, 20u);
  Observations all = lamp.all();
  EXPECT_EQ(all.rim.size(), points);
  EXPECT_EQ(all.lamps[0].rim_end - all.lamps[0].rim_begin, points);
  EXPECT_NEAR(all.rim[0].inverse_sigma, 1 / 0.04, 1e-9);
  EXPECT_FALSE(all.rims_grow);
  EXPECT_EQ(all.lamps[0].common_covariance_px2(0, 0), lamp.blob().rim_covariance_px2(0, 0));
  for (const Rung rung : {Rung::points, Rung::centres}) {
    lamp.options.rung = rung;
    EXPECT_TRUE(lamp.all().rim.empty());
    EXPECT_FALSE(lamp.seen().has_rim());
  }
  lamp.options.rung = Rung::rims;
  // The points of a saturated rim have grown; their own errors are those that detect() states.
  lamp.blob().saturated = true;
  all = lamp.all();
  EXPECT_TRUE(all.rims_grow);
  EXPECT_NEAR(all.rim[0].inverse_sigma, 1 / 0.04, 1e-9);
  EXPECT_GT(all.lamps[0].common_covariance_px2(0, 0), square(0.1));
  lamp.blob().saturated = false;
  // Four points determine no ellipse; on a cut lamp, which has no centroid, each one counts.
  lamp.blob().rim.resize(4);
  EXPECT_FALSE(lamp.seen().has_rim());
  lamp.blob().cut_by_border = true;
  EXPECT_TRUE(lamp.seen().has_rim());
  lamp.blob().rim[0].sigma_px = 0;
  EXPECT_THROW(lamp.seen(), std::invalid_argument);
}

TEST(Observe, GrowthOfASaturatedRimFollowsItsResponseToLight) {
  OneLamp lamp;
  const auto sigma_px = [&] { return std::sqrt(lamp.seen().common_covariance_px2(0, 0)); };
  EXPECT_EQ(sigma_px(), 0);
  lamp.blob().saturated = true;
  const double without_response = sigma_px();
  EXPECT_GT(without_response, 0.1);
  EXPECT_LT(without_response, 1);
  // A relative gradient of 1 / size moves the rim by the response over the size: so does a change
  // of the light by one e-fold. The light of a lamp is known to half an e-fold.
  lamp.blob().light_response_px2 = 6 * Eigen::Matrix2d::Identity();
  EXPECT_NEAR(sigma_px(), 0.5 * 6 / 20, 1e-9);
  lamp.blob().light_response_px2 << 4, 1, 1, 8;
  lamp.blob().ellipse.semi_major_px = 30;
  lamp.blob().ellipse.semi_minor_px = 10;
  EXPECT_NEAR(sigma_px(), 0.5 * 6 / 20, 1e-9);
}

TEST(Observe, FluxesAreThoseOfWholeSteadyLamps) {
  OneLamp lamp;
  lamp.scene.lamps[0].power_sigma = 0.03;
  EXPECT_TRUE(lamp.seen().has_flux);
  EXPECT_NEAR(lamp.seen().log_electrons,
              std::log(lamp.blob().flux_dn / lamp.scene.sensor.gain_dn_per_e), 1e-12);
  const double relative = lamp.blob().flux_sigma_dn / lamp.blob().flux_dn;
  EXPECT_NEAR(lamp.seen().flux_inverse_sigma, 1 / std::hypot(relative, 0.03), 1e-9);
  const auto left_out = [](const std::function<void(OneLamp&)>& change) {
    OneLamp changed;
    change(changed);
    return !changed.seen().has_flux && !changed.all().has_flux;
  };
  EXPECT_TRUE(left_out([](OneLamp& l) { l.options.flux = FluxModel::ignore; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().saturated = true; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().cut_by_border = true; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().flux_dn = 0; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.scene.lamps[0].frequency_hz = 200; }));
  EXPECT_TRUE(left_out([](OneLamp& l) {
    l.blob().flux_sigma_dn = 0;
    l.scene.lamps[0].power_sigma = 0;
  }));
}

TEST(Observe, PixelsAreThoseOfLampsThatCanBeRendered) {
  EXPECT_TRUE(OneLamp().with_pixels().has_pixels());
  const auto left_out = [](const std::function<void(OneLamp&)>& change) {
    OneLamp changed;
    change(changed);
    return !changed.with_pixels().has_pixels();
  };
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().saturated = true; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().cut_by_border = true; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().merged = true; }));
  EXPECT_TRUE(left_out([](OneLamp& l) { l.blob().striped = true; }));
  for (const int side : {0, 1, 2, 3})
    EXPECT_TRUE(left_out([&](OneLamp& l) {
      if (side == 0) l.blob().x0 += 30;
      if (side == 1) l.blob().x1 -= 30;
      if (side == 2) l.blob().y0 += 30;
      if (side == 3) l.blob().y1 -= 30;
    })) << side;
  EXPECT_TRUE(left_out([](OneLamp& l) {
    l.scene.lamps[0].frequency_hz = 200;
    l.scene.sensor.row_time_s = 1e-5;
  }));
  EXPECT_FALSE(left_out([](OneLamp& l) { l.scene.lamps[0].frequency_hz = 200; }));
  EXPECT_FALSE(left_out([](OneLamp& l) {  // no ellipse fits a rectangle
    l.blob().merged = true;
    l.scene.lamps[0].shape = LampShape::rectangle;
    l.scene.lamps[0].size_m = {0.2, 0.2};
  }));
  EXPECT_FALSE(left_out([](OneLamp& l) {
    l.blob().saturated = true;
    l.blob().rim.clear();
  }));
}

TEST(Observe, PixelsAreElectronsAroundTheBlob) {
  OneLamp lamp;
  lamp.blobs.push_back(lamp.blob());  // another lamp to the right, whose box ends inside the window
  lamp.blobs[1].x0 = lamp.blob().x1 + 4;
  lamp.blobs[1].x1 = lamp.blobs[1].x0 + 10;
  lamp.image
      .u8[static_cast<std::size_t>((lamp.blob().y0 + 5) * lamp.image.width + lamp.blob().x0 + 7)] =
      90;
  const BlobWindow window = lamp.with_pixels().window;
  const int margin = lamp.blob().x0 - window.x0;
  EXPECT_GE(margin, 2);  // it shows the background
  EXPECT_LE(margin, 10);
  EXPECT_EQ(lamp.blob().y0 - window.y0, margin);
  EXPECT_EQ(window.width, 42 + 2 * margin);
  EXPECT_EQ(window.height, 42 + 2 * margin);
  const Sensor& sensor = lamp.scene.sensor;
  const auto at = [&](int x, int y) {
    return window
        .electrons[static_cast<std::size_t>((y - window.y0) * window.width + x - window.x0)];
  };
  const double dark = (40 - sensor.black_level_dn) / sensor.gain_dn_per_e;
  const double lit = (90 - sensor.black_level_dn) / sensor.gain_dn_per_e;
  EXPECT_NEAR(at(lamp.blob().x0, lamp.blob().y0), dark, 1e-4 * dark);
  EXPECT_NEAR(at(lamp.blob().x0 + 7, lamp.blob().y0 + 5), lit, 1e-4 * lit);
  EXPECT_TRUE(std::isnan(at(window.x0 + window.width - 1, lamp.blob().y0)));
  EXPECT_TRUE(std::isnan(at(lamp.blob().x1 + 2, lamp.blob().y1)));  // the light around its box
  EXPECT_FALSE(std::isnan(at(lamp.blob().x1 - 2, lamp.blob().y0)));
  // A window ends at the border of the image.
  lamp.blobs.resize(1);
  lamp.blob().centroid_px = {638, 478};
  lamp.blob().x0 = 635;
  lamp.blob().x1 = 639;
  lamp.blob().y0 = 470;
  lamp.blob().y1 = 479;
  const BlobWindow corner = lamp.with_pixels().window;
  EXPECT_EQ(corner.x0 + corner.width, 640);
  EXPECT_EQ(corner.y0 + corner.height, 480);
}

TEST(Observe, ChecksItsInput) {
  OneLamp lamp;
  const auto complaint = [&](const std::vector<Match>& matches) {
    return test::complaint([&] { observe(matches, lamp.blobs, lamp.scene, lamp.options); });
  };
  EXPECT_EQ(complaint({{0, 0}}), "");
  for (const int wrong : {-1, 1}) {
    EXPECT_NE(complaint({{wrong, 0}}).find("match.lamp"), std::string::npos);
    EXPECT_NE(complaint({{0, wrong}}).find("match.blob"), std::string::npos);
  }
  lamp.scene.lamps[0].normal *= 2;
  EXPECT_NE(complaint({{0, 0}}).find("normal"), std::string::npos);
}

TEST(FluxRatio, IsALowerLimitWhereLightIsMissing) {
  OneLamp lamp;
  const Rigid3 pose = look_at({1.0, 1.1, 1.5}, {0.9, 1.0, 3}, {0.2, 1, 0});
  const auto ratio = [&](const std::function<void(Lamp&, Blob&)>& change) {
    OneLamp changed;
    changed.scene.lamps[0].power_sigma = 0.1;
    change(changed.scene.lamps[0], changed.blob());
    return flux_ratio(changed.scene.lamps[0], changed.blob(), pose, changed.scene);
  };
  const auto plain = ratio([](Lamp&, Blob&) {});
  ASSERT_TRUE(plain);
  // An exact measurement, in grey levels.
  EXPECT_NEAR(plain->log_ratio, std::log(OneLamp().scene.sensor.gain_dn_per_e), 0.01);
  EXPECT_FALSE(plain->at_least);
  EXPECT_GT(plain->sigma, 0.2);  // powers are seldom measured
  EXPECT_LT(plain->sigma, 1);
  const double uncertain = ratio([](Lamp& l, Blob&) { l.power_sigma = 3; })->sigma;
  EXPECT_NEAR(uncertain * uncertain - plain->sigma * plain->sigma, 9 - 0.01, 1e-6);
  const double noisy = ratio([](Lamp&, Blob& b) { b.flux_sigma_dn = 2 * b.flux_dn; })->sigma;
  EXPECT_NEAR(noisy * noisy - plain->sigma * plain->sigma, 4, 0.01);
  EXPECT_TRUE(ratio([](Lamp&, Blob& b) { b.saturated = true; })->at_least);
  EXPECT_TRUE(ratio([](Lamp&, Blob& b) { b.cut_by_border = true; })->at_least);
  EXPECT_TRUE(ratio([](Lamp&, Blob& b) { b.striped = true; })->at_least);
  EXPECT_TRUE(ratio([](Lamp& l, Blob&) { l.frequency_hz = 200; })->at_least);
  EXPECT_FALSE(ratio([](Lamp&, Blob& b) { b.flux_dn = 0; }));
  EXPECT_FALSE(ratio([](Lamp&, Blob& b) { b.flux_sigma_dn = 0; }));
}

TEST(FluxRatio, AllowsForVignetting) {
  Scene scene = test::irregular_room();
  Blob blob;
  blob.flux_dn = 100;
  blob.flux_sigma_dn = 1;
  blob.centroid_px = {600, 440};
  const double without = *log_flux(blob, scene);
  scene.lens.vignetting = {-0.3};
  EXPECT_GT(*log_flux(blob, scene), without + 0.05);  // the lamp is brighter than it looks
  blob.centroid_px = {319.5, 239.5};
  EXPECT_NEAR(*log_flux(blob, scene), without, 1e-6);
}

TEST(RefinedDof, CountsWhatWasMeasured) {
  const Scene room = test::irregular_room();
  const Rigid3 truth = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  const std::vector<Blob> blobs = test::exact_blobs(room, truth, {24, 0.05, 0.03, 0, 0, 0.02});
  const auto dof = [&](const RefineOptions& options, std::vector<Blob> seen) {
    return refine(truth, test::in_order(room), seen, room, options)->dof;
  };
  RefineOptions options;
  options.rung = Rung::centres;
  EXPECT_EQ(dof(options, blobs), 2 * 6 - 6);
  options.flux = FluxModel::known_power;
  EXPECT_EQ(dof(options, blobs), 2 * 6 + 6 - 6);
  options.flux = FluxModel::common_factor;
  EXPECT_EQ(dof(options, blobs), 2 * 6 + 6 - 1 - 6);
  options.flux = FluxModel::ignore;
  options.prior.emplace().height_m = truth.origin_in_source().z();
  EXPECT_EQ(dof(options, blobs), 2 * 6 + 1 - 6);
  options.prior.reset();
  options.rung = Rung::rims;
  int points = 0;
  for (const Blob& blob : blobs) points += static_cast<int>(blob.rim.size());
  EXPECT_EQ(dof(options, blobs), points - 6);
  std::vector<Blob> one_spot = blobs;
  one_spot[2].rim.clear();
  EXPECT_EQ(dof(options, one_spot), points - static_cast<int>(blobs[2].rim.size()) + 2 - 6);
}

}  // namespace
}  // namespace occ
