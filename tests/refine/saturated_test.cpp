// SPDX-License-Identifier: Apache-2.0
// Over-exposed lamps by their rims, from 1.5 to 100 times full scale, under sharp and broad PSFs: a
// rim grows, and by more where the lamp is brighter.
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/simulate_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

struct Exposure {
  double psf_px, over;
  bool sampled_psf = false;  ///< at whole pixels, which is not the renderer's
  bool known = true;         ///< detection and refinement use the sensor model
  bool level_light = false;  ///< no gradient of light over a lamp, as if cos^4 was corrected
};

/// Lamps on the optical axis are so many times as bright as full scale.
Scene exposed(const Exposure& e) {
  Scene scene = test::irregular_room();
  Sensor& sensor = scene.sensor;
  sensor.psf_sigma_px = e.psf_px;
  sensor.full_well_e = 1e6;
  const double radiance = 17, full_e = (255 - sensor.black_level_dn) / sensor.gain_dn_per_e;
  for (Lamp& lamp : scene.lamps) lamp.power_w = radiance * pi * lamp.area_m2();
  const double irradiance = pi / 4 * radiance / (sensor.f_number * sensor.f_number);
  sensor.exposure_s *= e.over * full_e / sensor.electrons(irradiance);
  return scene;
}

/// Convolved along x, then, transposed, along y.
Eigen::MatrixXd blurred_by_samples(const Eigen::MatrixXd& sharp, double sigma_px) {
  const Eigen::Index reach = static_cast<Eigen::Index>(4 * sigma_px + 0.5);
  Eigen::VectorXd kernel(2 * reach + 1);
  for (Eigen::Index k = -reach; k <= reach; ++k)
    kernel[k + reach] = std::exp(-0.5 * std::pow(static_cast<double>(k) / sigma_px, 2));
  kernel /= kernel.sum();
  const auto along_rows = [&](const Eigen::MatrixXd& in) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(in.rows(), in.cols());
    for (Eigen::Index x = 0; x < in.rows(); ++x)
      for (Eigen::Index k = -reach; k <= reach; ++k)
        out.row(x) += kernel[k + reach] * in.row(std::clamp<Eigen::Index>(x + k, 0, in.rows() - 1));
    return out;
  };
  return along_rows(along_rows(sharp).transpose()).transpose();
}

Image photograph(const Scene& scene, const Rigid3& pose, bool sampled_psf, std::uint64_t seed) {
  const Sensor& sensor = scene.sensor;
  if (!sampled_psf) {
    SimulateOptions options;
    options.seed = seed;
    return simulate(scene, pose, options).image;
  }
  Scene sharp = scene;
  sharp.sensor.psf_sigma_px = 0.02;
  const double peak_e = sensor.full_well_e;
  const Eigen::MatrixXd mean_e =
      blurred_by_samples(test::mean_electrons(sharp, pose, peak_e), sensor.psf_sigma_px);
  Random random(seed);
  Image image;
  image.width = 640;
  image.height = 480;
  for (Eigen::Index y = 0; y < mean_e.cols(); ++y) {
    for (Eigen::Index x = 0; x < mean_e.rows(); ++x) {
      const double e =
          mean_e(x, y) +
          std::hypot(std::sqrt(std::max(0.0, mean_e(x, y))), sensor.read_noise_e) * random.normal();
      const double dn = std::round(sensor.black_level_dn + sensor.gain_dn_per_e * e);
      image.u8.push_back(static_cast<std::uint8_t>(std::clamp(dn, 0.0, 255.0)));
    }
  }
  return image;
}

struct Nees {
  double position = 0, pose = 0;  // means, 3 and 6 expected
};

/// `aware`: of how rims answer to light.
Nees mean_nees(const Exposure& exposure, int frames, bool aware = true) {
  Scene scene = exposed(exposure);
  Scene believed = scene;
  if (exposure.level_light) scene.effects.set(Effect::light_gradient, Use::off);
  if (!exposure.known) believed.sensor = Sensor();
  DetectOptions detect_options;
  detect_options.sensor = believed.sensor;
  Random random(4);
  Nees mean;
  for (int n = 0; n < frames;) {
    const Rigid3 pose = test::random_room_pose(random);
    const auto truth = simulate(scene, pose, test::noiseless()).lamps;
    const auto cut = [](const LampTruth& lamp) { return lamp.in_view && !lamp.whole; };
    if (std::any_of(truth.begin(), truth.end(), cut)) continue;
    const std::uint64_t seed = static_cast<std::uint64_t>(++n);
    const Image image = photograph(scene, pose, exposure.sampled_psf, seed);
    std::vector<Blob> blobs = detect(image.view(), detect_options);
    std::vector<Match> matches;
    for (std::size_t b = 0; b < blobs.size(); ++b) {
      if (!aware) {
        blobs[b].light_response_px2.setZero();
        blobs[b].rim_light_response_px = 0;
      }
      for (std::size_t l = 0; l < truth.size(); ++l)
        if (truth[l].whole && (blobs[b].centroid_px - truth[l].image_centre_px).norm() < 3)
          matches.push_back({static_cast<int>(l), static_cast<int>(b)});
    }
    const auto refined = refine(pose, matches, blobs, believed);
    EXPECT_TRUE(refined.ok()) << refined.message;
    const Vector6 error = difference(refined->cam_from_world, pose);
    const Eigen::Vector3d slip =
        refined->cam_from_world.origin_in_source() - pose.origin_in_source();
    const Eigen::Matrix3d covariance =
        position_covariance(refined->cam_from_world, refined->covariance);
    mean.pose += test::nees(error, refined->covariance) / frames;
    mean.position += test::nees(slip, covariance) / frames;
  }
  return mean;
}

// The lamps being as bright as the scene says and the PSF the one they are rendered with, errors
// are smaller than they might be.
TEST(RefineSaturated, ErrorsAreNoLargerThanStated) {
  constexpr int frames = 15;
  for (const bool known : {true, false}) {
    for (const double psf_px : {0.5, 0.8, 1.2, 2.0}) {
      for (const double over : {1.5, 4.0, 8.0, 30.0, 100.0}) {
        if (psf_px == 2.0 && over == 100.0) continue;  // the renderer's 1e-4 shows there
        if (psf_px == 2.0 && over == 1.5) continue;    // some lamps have no clipped rim
        SCOPED_TRACE(std::to_string(psf_px) + " px, " + std::to_string(over) + " times");
        const Nees nees = mean_nees({psf_px, over, false, known}, frames);
        EXPECT_LT(nees.pose, test::chi2_interval(6.0 * frames).second / frames);
        EXPECT_LT(nees.position, test::chi2_interval(3.0 * frames).second / frames);
      }
    }
  }
}

// The covariance contains the error of the pose if the gradient of light that the scene predicts is
// absent, as where a phone corrects it. Here it is present, so errors are smaller than stated, but
// not by an order of magnitude.
TEST(RefineSaturated, ErrorsAreNoLargerThanStatedUnderAPsfThatIsSampledAtPixels) {
  constexpr int frames = 12;
  for (const double over : {6.0, 12.0}) {
    const Nees nees = mean_nees({0.8, over, true}, frames);
    EXPECT_LT(nees.pose, test::chi2_interval(6.0 * frames).second / frames) << over;
    EXPECT_GT(nees.pose, 0.6) << over;
    EXPECT_LT(nees.position, test::chi2_interval(3.0 * frames).second / frames) << over;
    EXPECT_GT(nees.position, 0.2) << over;
  }
}

TEST(RefineSaturated, ARimGrowsByMoreWhereTheLampIsBrighter) {
  EXPECT_LT(mean_nees({0.8, 8}, 5).position, 3);
  EXPECT_GT(mean_nees({0.8, 8}, 5, false).position, 10);
}

// The brighter end of a long lamp is wider, which is no shift. Two panels near the corners of the
// image determine the pose weakly.
TEST(RefineSaturated, LongLampsAreWithinTheirSigma) {
  Scene scene = exposed({0.8, 4});
  scene.lamps.clear();
  for (const double side : {-1.0, 1.0}) {
    Lamp lamp;
    lamp.id = side > 0;
    lamp.shape = LampShape::rectangle;
    lamp.centre_m = {2 + side * 0.9, 2 + side * 0.6, 3};
    lamp.normal = -Eigen::Vector3d::UnitZ();
    lamp.x_axis = {std::cos(0.5 + side), std::sin(0.5 + side), 0};
    lamp.size_m = {0.6, 0.3};
    lamp.power_w = 17 * pi * lamp.area_m2();
    scene.lamps.push_back(lamp);
  }
  DetectOptions detect_options;
  detect_options.sensor = scene.sensor;
  detect_options.polygons = true;
  constexpr int frames = 10;
  double nees = 0, nees_of_shift = 0;
  for (int n = 0; n < frames; ++n) {
    const Rigid3 pose = look_at({1.9 + 0.02 * n, 2.1, 1.2}, {2, 2, 3}, Eigen::Vector3d::UnitY());
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(n);
    const Rendered seen = simulate(scene, pose, options);
    std::vector<Blob> blobs = detect(seen.image.view(), detect_options);
    std::vector<Match> matches;
    for (std::size_t b = 0; b < blobs.size(); ++b)
      for (std::size_t l = 0; l < scene.lamps.size(); ++l)
        if ((blobs[b].centroid_px - seen.lamps[l].image_centre_px).norm() < 5)
          matches.push_back({static_cast<int>(l), static_cast<int>(b)});
    ASSERT_EQ(matches.size(), 2u);
    const auto nees_of = [&] {
      const auto refined = refine(pose, matches, blobs, scene);
      EXPECT_TRUE(refined.ok()) << refined.message;
      return test::nees(difference(refined->cam_from_world, pose), refined->covariance);
    };
    nees += nees_of();
    for (Blob& blob : blobs) {
      EXPECT_GT(blob.rim_light_response_px, 0.1);
      blob.rim_light_response_px = 0;
    }
    nees_of_shift += nees_of();
  }
  EXPECT_LT(nees, test::chi2_interval(6.0 * frames).second);
  EXPECT_GT(nees_of_shift, 1.5 * test::chi2_interval(6.0 * frames).second);
}

// Phones correct cos^4 in software.
TEST(RefineSaturated, ErrorsHoldWhereTheLightHasNoGradient) {
  Exposure exposure{0.8, 8};
  exposure.level_light = true;
  constexpr int frames = 12;
  EXPECT_LT(mean_nees(exposure, frames).position,
            test::chi2_interval(3.0 * frames).second / frames);
}

// Clipped discs of 300 px through a lens whose distortion deforms them: their rims are no ellipses.
// Without rims the clipped pixels do not respond to a gradient of the light.
TEST(RefineSaturated, LargeDiscsBehindADistortingLensAreWithinTheirSigma) {
  const std::array<Eigen::Vector2d, 4> places = {
      Eigen::Vector2d{1.213, 1.408}, {2.786, 1.391}, {1.204, 2.597}, {2.795, 2.612}};
  Scene scene;
  scene.camera =
      Camera::pinhole(4000, 3000, 3050, 3046, 2012, 1489, {0.09, -0.22, 4e-4, -3e-4, 0.12});
  scene.sensor.pixel_pitch_m = 1.4e-6;
  scene.sensor.f_number = 1.8;
  scene.sensor.exposure_s = 5e-4;
  scene.sensor.full_well_e = 5000;
  scene.sensor.gain_dn_per_e = 0.05;
  scene.sensor.read_noise_e = 3;
  scene.sensor.psf_sigma_px = 1.2;
  scene.ambient_w_m2 = 0.001;
  std::vector<Match> matches;
  for (const Eigen::Vector2d& place : places) {
    Lamp lamp;
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.shape = LampShape::disc;
    lamp.radius_m = 0.11;
    lamp.power_w = 4;
    lamp.normal = -Eigen::Vector3d::UnitZ();
    lamp.centre_m << place, 2.6;
    scene.lamps.push_back(lamp);
  }
  const Eigen::Vector3d position(2.05, 1.95, 0.5);
  const Rigid3 truth = look_at(position, {2.05, 1.95, 9}, Eigen::Vector3d::UnitY());
  const Image image = simulate(scene, truth).image;
  for (const bool rims : {true, false}) {
    DetectOptions options;
    options.sensor = scene.sensor;
    options.rims = rims;
    const std::vector<Blob> blobs = detect(image.view(), options);
    matches.clear();
    for (int lamp = 0; lamp < 4; ++lamp) {
      const Eigen::Vector2d at = *scene.camera.project(truth * scene.lamps[lamp].centre_m);
      for (int blob = 0; blob < static_cast<int>(blobs.size()); ++blob)
        if ((blobs[blob].centroid_px - at).norm() < 20) matches.push_back({lamp, blob});
    }
    ASSERT_EQ(matches.size(), 4u);
    for (const Blob& blob : blobs) EXPECT_EQ(blob.rim.empty(), !rims);
    const Result<Refined> refined = refine(truth, matches, blobs, scene);
    ASSERT_TRUE(refined.ok()) << refined.message;
    const Eigen::Vector3d off = refined->cam_from_world.origin_in_source() - position;
    EXPECT_LT(off.norm(), rims ? 3e-5 : 2e-4) << rims;
  }
}

// The growth of the rims and errors of few lamps can explain each other: the estimates ran away by
// metres, and the status was not_converged.
TEST(RefineSaturated, FewLampsWithStatedErrorsFallBackToCentres) {
  Scene scene;
  scene.camera = Camera::pinhole(1600, 1200, 1056, 1056, 799.5, 599.5);
  const Eigen::Vector3d places[] = {{0.9, 1, 3}, {3.1, 1.2, 3}, {1.2, 3.2, 3}, {2.8, 2.7, 3}};
  for (const Eigen::Vector3d& place : places)
    scene.lamps.push_back(test::disc_lamp(static_cast<int>(scene.lamps.size()), place));
  for (Lamp& lamp : scene.lamps) lamp.power_w = 12;
  const Rigid3 truth = look_at({1.9, 2.1, 0.3}, {1.95, 2.15, 3}, Eigen::Vector3d::UnitY());
  DetectOptions options;
  options.sensor = scene.sensor;
  const std::vector<Blob> blobs = detect(simulate(scene, truth).image.view(), options);
  ASSERT_EQ(blobs.size(), 4u);
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Scene map = scene;
    map.map_sigma_m = PerAxis(Eigen::Vector3d::Constant(0.01));
    std::vector<Match> matches;
    for (int lamp = 0; lamp < 4; ++lamp) {
      const Eigen::Vector2d at = *scene.camera.project(truth * scene.lamps[lamp].centre_m);
      for (int blob = 0; blob < 4; ++blob)
        if ((blobs[blob].centroid_px - at).norm() < 20) matches.push_back({lamp, blob});
      map.lamps[lamp].centre_m += 0.01 * test::random_vector(random);
    }
    ASSERT_EQ(matches.size(), 4u);
    for (const Blob& blob : blobs) ASSERT_TRUE(blob.saturated);
    const Result<Refined> refined = refine(truth, matches, blobs, map);
    ASSERT_TRUE(refined.ok()) << trial << ": " << refined.message;
    const Vector6 error = difference(refined->cam_from_world, truth);
    EXPECT_LT(error.dot(refined->covariance.inverse() * error), 40) << trial;
  }
}

}  // namespace
}  // namespace occ
