// SPDX-License-Identifier: Apache-2.0
// Lamps' power and order from rendered images at known poses, and from ideal blobs.
#include "libocc/photometry/light.hpp"

#include <algorithm>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// Small lamps with powers and orders that differ from the scene's: the truth to be estimated.
Scene true_room() {
  Scene scene = test::irregular_room();
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    Lamp& lamp = scene.lamps[i];
    const double part = static_cast<double>(i) / 5;
    lamp.radius_m = 0.03;
    lamp.half_power_rad = 0.6 + 0.5 * part;
    lamp.power_w = 0.12 * (1 + 0.3 * part);
  }
  scene.sensor.exposure_s = 1.2e-5;
  scene.sensor.full_well_e = 1e5;
  return scene;
}

Scene supposed(Scene scene) {
  for (Lamp& lamp : scene.lamps) {
    lamp.power_w = 0.1;
    lamp.half_power_rad = pi / 3;
  }
  return scene;
}

/// Poses looking up from positions all over the floor: emission angles of 0 to 50 degrees.
std::vector<Rigid3> poses_of(int count, Random& random, double reach_m = 1.8) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d position(2 + random.uniform(-reach_m, reach_m),
                                   2 + random.uniform(-reach_m, reach_m),
                                   random.uniform(0, 0.4 * reach_m));
    poses.push_back(look_at(position, {2, 2, 3}, {0.1, 1, 0}));
  }
  return poses;
}

/// Ideal blobs of each pose with noise of this relative sigma.
std::vector<std::vector<Blob>> blobs_of(const Scene& scene, const std::vector<Rigid3>& poses,
                                        double flux_sigma, Random& random) {
  std::vector<std::vector<Blob>> all;
  for (const Rigid3& pose : poses) {
    all.emplace_back();
    for (const Lamp& lamp : scene.lamps) {
      const auto px = project_lamp_centre(lamp, pose, scene.camera);
      if (!px || px->minCoeff() < 0 || px->x() > 639 || px->y() > 479) continue;
      Blob blob;
      blob.centroid_px = *px;
      blob.flux_dn = scene.sensor.gain_dn_per_e *
                     lamp_electrons(lamp, pose, scene.camera, scene.sensor) *
                     std::exp(flux_sigma * random.normal());
      blob.flux_sigma_dn = flux_sigma * blob.flux_dn;
      all.back().push_back(blob);
    }
  }
  return all;
}

Eigen::Vector2d error_of(const LampLight& light, const Lamp& truth) {
  return {std::log(light.power_w / truth.power_w), light.order - truth.order()};
}

TEST(CalibrateLight, ExactFluxesGiveExactLight) {
  Random random(1);
  const Scene truth = true_room();
  const auto poses = poses_of(12, random);
  const auto found = calibrate_light(supposed(truth), blobs_of(truth, poses, 1e-9, random), poses);
  ASSERT_TRUE(found.ok()) << found.message;
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    ASSERT_EQ(found->lamps[i].status, Status::ok) << found->lamps[i].message;
    EXPECT_LT(error_of(found->lamps[i], truth.lamps[i]).norm(), 1e-6);
    EXPECT_NEAR(found->scene.lamps[i].power_w, truth.lamps[i].power_w, 1e-6);
    EXPECT_NEAR(found->scene.lamps[i].half_power_rad, truth.lamps[i].half_power_rad, 1e-6);
  }
  Scene scene = found->scene;
  EXPECT_NO_THROW(scene.validate());
}

TEST(CalibrateLight, MeasuredEmissionLeavesOnlyThePowerUnknown) {
  Random random(1);
  Scene truth = true_room();
  const auto profile = test::profile_of(test::batwing, 5, 15);
  for (const std::size_t i : {0, 2, 3}) truth.lamps[i].photometry = profile;
  const auto poses = poses_of(12, random);
  Scene assumed = supposed(truth);
  for (const PowerFit powers : {PowerFit::each, PowerFit::common_factor}) {
    LightOptions options;
    options.powers = powers;
    if (powers == PowerFit::common_factor)
      for (std::size_t i = 0; i < truth.lamps.size(); ++i)
        assumed.lamps[i].power_w = truth.lamps[i].power_w / 1.7;
    const auto found =
        calibrate_light(assumed, blobs_of(truth, poses, 1e-9, random), poses, options);
    ASSERT_TRUE(found.ok()) << found.message;
    for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
      ASSERT_EQ(found->lamps[i].status, Status::ok) << found->lamps[i].message;
      EXPECT_NEAR(found->scene.lamps[i].power_w / truth.lamps[i].power_w, 1, 1e-6);
      EXPECT_EQ(found->scene.lamps[i].photometry, truth.lamps[i].photometry);
    }
    EXPECT_EQ(found->scene.lamps[0].half_power_rad, assumed.lamps[0].half_power_rad);
  }
}

TEST(CalibrateLight, CovarianceMatchesTheErrors) {
  Random random(2);
  const Scene truth = true_room();
  LightOptions options;
  options.model_sigma = 0;
  options.huber_sigma = 1e9;
  options.max_order_sigma = 10;
  double nees = 0, chi2 = 0;
  int count = 0, dof = 0;
  for (int run = 0; run < 60; ++run) {
    const auto poses = poses_of(10, random);
    const auto found =
        calibrate_light(supposed(truth), blobs_of(truth, poses, 0.01, random), poses, options);
    for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
      const LampLight& light = found->lamps[i];
      if (light.status != Status::ok) continue;
      const Eigen::Vector2d error = error_of(light, truth.lamps[i]);
      nees += error.dot(light.covariance.inverse() * error);
      chi2 += light.chi2;
      dof += light.dof;
      ++count;
    }
  }
  ASSERT_GT(count, 300);
  const auto interval = test::chi2_interval(2.0 * count);
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
  const auto of_chi2 = test::chi2_interval(dof);
  EXPECT_GT(chi2, of_chi2.first);
  EXPECT_LT(chi2, of_chi2.second);
}

TEST(CalibrateLight, RecoversRenderedAndDetectedLamps) {
  Scene truth = true_room();
  truth.lens.vignetting = {-0.3};
  Random random(5);
  const auto poses = poses_of(16, random);
  DetectOptions detecting;
  detecting.sensor = truth.sensor;
  std::vector<std::vector<Blob>> blobs;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    SimulateOptions options;
    options.seed = i + 1;
    blobs.push_back(detect(simulate(truth, poses[i], options).image.view(), detecting));
  }
  const auto found = calibrate_light(supposed(truth), blobs, poses);
  ASSERT_TRUE(found.ok()) << found.message;
  double nees = 0;
  int count = 0;
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    const LampLight& light = found->lamps[i];
    if (light.status != Status::ok) continue;
    const Eigen::Vector2d error = error_of(light, truth.lamps[i]);
    EXPECT_LT(std::abs(error[0]), 0.05);
    EXPECT_LT(std::abs(error[1]), 0.3);
    nees += error.dot(light.covariance.inverse() * error);
    ++count;
    if (light.dof > 0) {
      EXPECT_LT(light.chi2 / light.dof, 4);
    }
  }
  EXPECT_GE(count, 5);
  EXPECT_LT(nees, test::chi2_interval(2.0 * count, 3.3).second);
}

/// Scene whose powers are all wrong by the same factor.
Scene scaled(Scene scene, double factor) {
  for (Lamp& lamp : scene.lamps) {
    lamp.power_w /= factor;
    lamp.half_power_rad = pi / 3;
  }
  return scene;
}

TEST(CalibrateLight, ACommonFactorKeepsRelativePowers) {
  Random random(11);
  const Scene truth = true_room();
  const auto poses = poses_of(12, random);
  LightOptions options;
  options.powers = PowerFit::common_factor;
  const auto found =
      calibrate_light(scaled(truth, 1.7), blobs_of(truth, poses, 1e-9, random), poses, options);
  ASSERT_TRUE(found.ok() && found->factor) << found.message;
  EXPECT_NEAR(found->factor->value, 1.7, 1e-6);
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    EXPECT_LT(error_of(found->lamps[i], truth.lamps[i]).norm(), 1e-6);
    EXPECT_NEAR(found->scene.lamps[i].power_w, truth.lamps[i].power_w, 1e-6);
    EXPECT_EQ(found->lamps[i].covariance(0, 0), found->factor->covariance(0, 0));
  }
}

TEST(CalibrateLight, ACommonFactorAppliesToUnobservedLamps) {
  Random random(12);
  Scene truth = true_room();
  const auto poses = poses_of(6, random, 0.02);  // too little for a single order
  Scene map = scaled(truth, 0.5);
  for (std::size_t i = 0; i < truth.lamps.size(); ++i)
    map.lamps[i].half_power_rad = truth.lamps[i].half_power_rad;
  auto blobs = blobs_of(truth, poses, 0.01, random);
  for (auto& of_image : blobs) of_image.erase(of_image.begin());
  LightOptions options;
  options.powers = PowerFit::common_factor;
  const auto found = calibrate_light(map, blobs, poses, options);
  ASSERT_TRUE(found.ok() && found->factor);
  EXPECT_EQ(found->lamps[0].status, Status::no_lamps);
  const double sigma = std::sqrt(found->factor->covariance(0, 0));
  EXPECT_LT(std::abs(std::log(found->factor->value / 0.5)), 4 * sigma);
  EXPECT_EQ(found->lamps[0].power_w, map.lamps[0].power_w * found->factor->value);
  EXPECT_EQ(found->scene.lamps[0].power_w, found->lamps[0].power_w);
  EXPECT_EQ(found->scene.lamps[0].half_power_rad, map.lamps[0].half_power_rad);
  const auto none = calibrate_light(map, {{}}, {poses[0]}, options);
  EXPECT_EQ(none.status, Status::degenerate);
  EXPECT_FALSE(none->factor);
  EXPECT_NE(none.message.find("no image shows a lamp unobstructed and isolated"),
            std::string::npos);
}

TEST(CalibrateLight, CovarianceOfACommonFactorMatchesTheErrors) {
  Random random(13);
  const Scene truth = true_room();
  LightOptions options;
  options.powers = PowerFit::common_factor;
  options.model_sigma = 0;
  options.huber_sigma = 1e9;
  options.max_order_sigma = 10;
  double nees = 0, chi2 = 0;
  int unknowns = 0, dof = 0;
  for (int run = 0; run < 100; ++run) {
    const auto poses = poses_of(10, random);
    const auto found =
        calibrate_light(scaled(truth, 0.8), blobs_of(truth, poses, 0.01, random), poses, options);
    ASSERT_TRUE(found.ok());
    std::vector<Eigen::Index> known{0};
    Eigen::VectorXd all(7);
    all[0] = std::log(found->factor->value / 0.8);
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto lamp = static_cast<std::size_t>(i);
      all[i + 1] = found->lamps[lamp].order - truth.lamps[lamp].order();
      if (found->lamps[lamp].status == Status::ok) known.push_back(i + 1);
    }
    if (known.size() < 7) continue;  // one that was held at the map's order is wrong by more
    nees += test::nees(all, found->factor->covariance);
    unknowns += 7;
    chi2 += found->lamps[0].chi2;
    dof += found->lamps[0].dof;
  }
  ASSERT_GT(unknowns, 400);
  const auto interval = test::chi2_interval(unknowns), of_chi2 = test::chi2_interval(dof);
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
  EXPECT_GT(chi2, of_chi2.first);
  EXPECT_LT(chi2, of_chi2.second);
}

/// Recovers lamps from images without these effects; the detector's sensor has them off, too.
TEST(CalibrateLight, IgnoresEffectsThatAreOff) {
  Scene truth = true_room();
  truth.lens.vignetting = {-0.6};
  truth.sensor.response = Response::srgb;
  truth.sensor.bit_depth = 12;
  truth.sensor.gain_dn_per_e = 0.4;
  for (Lamp& lamp : truth.lamps) lamp.frequency_hz = 1000;
  for (const Effect effect : {Effect::vignetting, Effect::response, Effect::modulation})
    truth.effects.set(effect, Use::off);
  Random random(14);
  const auto poses = poses_of(16, random);
  DetectOptions detecting;
  detecting.sensor = truth.as_rendered().sensor;
  std::vector<std::vector<Blob>> blobs;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    SimulateOptions options;
    options.seed = i + 1;
    blobs.push_back(detect(simulate(truth, poses[i], options).image.view(), detecting));
  }
  const auto found = calibrate_light(supposed(truth), blobs, poses);
  ASSERT_TRUE(found.ok()) << found.message;
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    const LampLight& light = found->lamps[i];
    ASSERT_EQ(light.status, Status::ok) << light.message;
    EXPECT_LT(std::abs(error_of(light, truth.lamps[i])[0]), 0.02);
    EXPECT_LT(std::abs(error_of(light, truth.lamps[i])[1]), 0.1);
    EXPECT_TRUE(found->scene.lamps[i].frequency_hz) << "the scene itself stays as it is";
  }
  EXPECT_EQ(found->scene.lens.vignetting.size(), 1U);
}

TEST(CalibrateLight, MatchesReplaceTheGate) {
  Random random(7);
  const Scene truth = true_room();
  const auto poses = poses_of(8, random, 0.8);
  auto blobs = blobs_of(truth, poses, 1e-9, random);
  std::vector<std::vector<Match>> matches;
  for (auto& of_image : blobs) {
    ASSERT_EQ(of_image.size(), truth.lamps.size());
    for (Blob& blob : of_image) blob.centroid_px.x() += 5;
    std::reverse(of_image.begin(), of_image.end());
    matches.emplace_back();
    for (int lamp = 0; lamp < 6; ++lamp) matches.back().push_back({lamp, 5 - lamp});
  }
  EXPECT_EQ(calibrate_light(supposed(truth), blobs, poses).status, Status::degenerate);
  const auto found = calibrate_light(supposed(truth), blobs, poses, matches);
  for (std::size_t i = 0; i < truth.lamps.size(); ++i)
    EXPECT_LT(error_of(found->lamps[i], truth.lamps[i]).norm(), 1e-6);
  const auto error_message = [&] {
    return test::complaint([&] { calibrate_light(truth, blobs, poses, matches); });
  };
  matches[3][0].blob = 6;
  EXPECT_NE(error_message().find("matches[3].blob must be an index"), std::string::npos);
  matches[3][0] = {-1, 0};
  EXPECT_NE(error_message().find("matches[3].lamp must be an index"), std::string::npos);
  matches.pop_back();
  EXPECT_NE(error_message().find("matches must be a list for each of 8 images"), std::string::npos);
}

TEST(CalibrateLight, AnOutlierHasLittleWeight) {
  Random random(3);
  const Scene truth = true_room();
  const auto poses = poses_of(20, random);
  auto blobs = blobs_of(truth, poses, 0.01, random);
  for (Blob& blob : blobs[4]) blob.flux_dn *= 1.5;
  LightOptions plain;
  plain.huber_sigma = 1e9;
  const auto robust = calibrate_light(supposed(truth), blobs, poses);
  const auto least_squares = calibrate_light(supposed(truth), blobs, poses, plain);
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    EXPECT_LT(std::abs(error_of(robust->lamps[i], truth.lamps[i])[0]), 0.03);
    if (least_squares->lamps[i].fluxes[4].use != FluxUse::used) continue;
    EXPECT_GT(least_squares->lamps[i].variance_factor, 10);
    EXPECT_FALSE(least_squares->lamps[i].message.empty());
  }
}

TEST(CalibrateLight, ReportsWhyAFluxIsExcluded) {
  Random random(4);
  Scene truth = true_room();
  const std::vector<Rigid3> poses(1, look_at({2, 2, 0}, {2, 2, 3}, {0, 1, 0}));
  auto blobs = blobs_of(truth, poses, 0.01, random);
  ASSERT_EQ(blobs[0].size(), 6U);
  blobs[0][0].saturated = true;
  blobs[0][1].merged = true;
  blobs[0][2].cut_by_border = true;
  blobs[0][3].centroid_px.x() += 4;
  truth.lamps[4].frequency_hz = 1000;
  Blob beside = blobs[0][5];
  beside.centroid_px.y() += 2;
  blobs[0].push_back(beside);
  Lamp turned = truth.lamps[0];
  turned.id = 77;
  turned.normal = Eigen::Vector3d::UnitZ();
  turned.centre_m.x() += 0.5;
  truth.lamps.push_back(turned);
  Lamp covered = truth.lamps[5];
  covered.id = 78;
  covered.centre_m += Eigen::Vector3d(0.3, 0.2, 0);
  truth.lamps.push_back(covered);
  const Eigen::Vector3d above = covered.centre_m - Eigen::Vector3d(0, 0, 0.1);
  truth.boxes.push_back({above, above + Eigen::Vector3d(0.05, 0.05, 0.05)});  // half of it
  const auto found = calibrate_light(truth, blobs, poses);
  EXPECT_EQ(found.status, Status::degenerate);
  const std::vector<FluxUse> expected{FluxUse::saturated,   FluxUse::merged, FluxUse::cut,
                                      FluxUse::no_blob,     FluxUse::blinks, FluxUse::not_alone,
                                      FluxUse::out_of_view, FluxUse::hidden};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(found->lamps[i].fluxes[0].use, expected[i]) << to_string(expected[i]);
    EXPECT_EQ(found->lamps[i].status, Status::no_lamps);
    EXPECT_EQ(found->lamps[i].power_w, truth.lamps[i].power_w) << "the scene's";
  }
}

TEST(CalibrateLight, ASmallRangeOfAnglesLeavesTheOrderUndetermined) {
  Random random(6);
  const Scene truth = true_room();
  Scene scene = truth;
  for (Lamp& lamp : scene.lamps) lamp.power_w = 0.1;
  const auto poses = poses_of(6, random, 0.02);
  const auto found = calibrate_light(scene, blobs_of(truth, poses, 0.01, random), poses);
  EXPECT_EQ(found.status, Status::degenerate);
  for (std::size_t i = 0; i < truth.lamps.size(); ++i) {
    const LampLight& light = found->lamps[i];
    EXPECT_EQ(light.status, Status::degenerate);
    EXPECT_NE(light.message.find("order is not determined by 6 fluxes at"), std::string::npos);
    EXPECT_TRUE(std::isinf(light.covariance(1, 1)));
    EXPECT_NEAR(light.power_w, truth.lamps[i].power_w, 5 * std::sqrt(light.covariance(0, 0)));
    EXPECT_EQ(found->scene.lamps[i].power_w, scene.lamps[i].power_w) << "not touched";
  }
}

TEST(CalibrateLight, RejectsInvalidInput) {
  const Scene scene = true_room();
  const auto error_message = [&](const std::vector<Rigid3>& poses, const LightOptions& options) {
    return test::complaint([&] { calibrate_light(scene, {{}, {}}, poses, options); });
  };
  EXPECT_NE(error_message({Rigid3{}}, {}).find("one pose for each of 2 images"), std::string::npos);
  Rigid3 skew;
  skew.rotation(0, 1) = 1;
  EXPECT_NE(error_message({Rigid3{}, skew}, {}).find("cam_from_world[1]"), std::string::npos);
  LightOptions options;
  options.gate_px = -1;
  EXPECT_NE(error_message({Rigid3{}, Rigid3{}}, options).find("gate_px"), std::string::npos);
}

}  // namespace
}  // namespace occ
