// SPDX-License-Identifier: Apache-2.0
// The direct rung: pixels against the lamp's rendered image, on simulated frames and rooms that an
// independent path tracer rendered.
#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/problem.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/pixel_blobs.hpp"
#include "tests/support/rendered_rooms.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ {
using namespace internal::refine;
namespace {

using test::Frame;
using test::make_frame;

Rigid3 truth() { return look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0}); }

Rigid3 start() {
  Vector6 off;
  off << 0.002, -0.002, 0.002, 0.003, -0.003, 0.003;
  return perturb(truth(), off);
}

RefineOptions by(Rung rung) {
  RefineOptions options;
  options.rung = rung;
  return options;
}

double error_m(const Refined& refined, const Rigid3& pose) {
  return (refined.cam_from_world.origin_in_source() - pose.origin_in_source()).norm();
}

Result<Refined> refine_directly(const Frame& frame, const Scene& scene,
                                RefineOptions options = by(Rung::direct)) {
  return refine(start(), frame.matches, frame.blobs, scene, options, frame.image.view());
}

Scene finely_quantised(Scene scene) {
  scene.sensor.bit_depth = 16;
  scene.sensor.gain_dn_per_e = 6;
  return scene;
}

TEST(RefineDirect, IsExactWithoutNoise) {
  Scene discs = finely_quantised(test::irregular_room());
  Scene mixed = discs;
  mixed.camera = Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, {-0.22, 0.06, 1e-3, -8e-4});
  for (const std::size_t i : {0, 1}) {
    mixed.lamps[i].shape = LampShape::rectangle;
    mixed.lamps[i].size_m = {0.2, 0.12};
  }
  mixed.lamps[2].shape = LampShape::point;
  mixed.lamps[2].power_w = 0.02;
  mixed.lamps[3].half_power_rad = 0.7;
  for (const Scene& scene : {discs, mixed}) {
    const Frame frame = make_frame(scene, truth(), 1, false);
    ASSERT_GE(frame.matches.size(), 5u);
    const auto refined = refine_directly(frame, scene);
    ASSERT_TRUE(refined.ok()) << refined.message;
    EXPECT_LT(error_m(*refined, truth()), 3e-6);
    for (const LampResidual& lamp : refined->lamps) EXPECT_EQ(lamp.rung, Rung::direct);
    EXPECT_NEAR(refined->psf_sigma_px.value(), scene.sensor.psf_sigma_px, 1e-9);
  }
}

/// With a variance that hardly depends on the signal, chi-square is an ordinary sum of squares and
/// its differences give the gradient.
TEST(RefineDirect, GradientAgreesWithDifferencesOfItsCost) {
  Scene scene = finely_quantised(test::irregular_room());
  const Frame frame = make_frame(scene, truth(), 1, false);
  scene.sensor.read_noise_e = 3000;
  RefineOptions options = by(Rung::direct);
  options.huber_sigma = std::numeric_limits<double>::infinity();
  const ImageView view = frame.image.view();
  for (const FluxModel flux : {FluxModel::ignore, FluxModel::common_factor}) {
    options.flux = flux;
    const Observations observations = observe(frame.matches, frame.blobs, scene, options, &view);
    RefineProblem problem(observations, scene, options, Rung::direct);
    Vector6 off;
    off << 3e-4, -2e-4, 4e-4, 8e-4, -6e-4, 9e-4;
    const State state{perturb(truth(), off), 0, 0.05};
    const Eigen::Vector3d pivot = problem.pivot(state);
    const auto settled = [&](const State& at, const Eigen::Vector3d& about) {
      PoseNormalEquations normal;
      for (int i = 0; i < 4; ++i) EXPECT_TRUE(problem.linearise(at, about, normal));
      return normal;
    };
    const auto half_chi2 = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      const State at = moved(state, pivot, step);
      return Eigen::VectorXd::Constant(1, settled(at, pivot + step.segment<3>(3)).chi2 / 2);
    };
    const PoseNormalEquations normal = settled(state, pivot);
    const Eigen::MatrixXd numeric =
        test::numerical_jacobian(half_chi2, Eigen::VectorXd::Zero(8), 2e-4);
    const Vector8 sigmas = normal.information.diagonal().cwiseMax(1e-12).cwiseSqrt();
    const Eigen::MatrixXd expected = numeric * sigmas.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd analytic =
        normal.gradient.transpose() * sigmas.cwiseInverse().asDiagonal();
    EXPECT_TRUE(test::jacobian_agrees(analytic, expected, 0.02));
    EXPECT_FALSE(test::jacobian_agrees(1.05 * analytic, expected, 0.02));
  }
}

struct Statistics {
  double pose_nees = 0, position_nees = 0;  // means, 6 and 3 expected
  double over_bound = 0;                    // whitened error over the observations' bound
  double over_scene_bound = 0;              // stated sigma over the scene's bound
  int frames = 0;
};

Statistics over_frames(const Scene& scene, Rung rung, int frames, FluxModel flux,
                       const Scene& believed) {
  Statistics mean;
  Random random(4);
  for (std::uint64_t seed = 1; mean.frames < frames; ++seed) {
    const Rigid3 pose = test::random_room_pose(random);
    const Frame frame = make_frame(scene, pose, seed);
    if (frame.cut || frame.matches.size() < 4) continue;
    RefineOptions options = by(rung);
    options.flux = flux;
    const ImageView view = frame.image.view();
    const auto refined = refine(pose, frame.matches, frame.blobs, believed, options, view);
    const auto bound = pose_bound(frame.matches, frame.blobs, believed, pose, options, view);
    EXPECT_TRUE(refined.ok() && bound.ok()) << refined.message << bound.message;
    const Vector6 error = difference(refined->cam_from_world, pose);
    const Eigen::Vector3d slip = error.tail<3>();
    const Matrix6& covariance = refined->covariance;
    ++mean.frames;
    mean.pose_nees += test::nees(error, covariance);
    mean.position_nees += test::nees(slip, Eigen::Matrix3d(covariance.bottomRightCorner<3, 3>()));
    mean.over_bound += test::nees(error, bound->covariance) / 6;
    Scene seen = scene;
    seen.lamps.clear();
    for (const Match& match : frame.matches) seen.lamps.push_back(scene.lamps[match.lamp]);
    const auto scene_bound = pose_bound(seen, pose, rung, flux);
    EXPECT_TRUE(scene_bound.ok()) << scene_bound.message;
    mean.over_scene_bound += std::sqrt(position_covariance(pose, covariance).trace() /
                                       scene_bound->position_covariance_m2.trace());
  }
  mean.pose_nees /= frames;
  mean.position_nees /= frames;
  mean.over_bound = std::sqrt(mean.over_bound / frames);
  mean.over_scene_bound /= frames;
  return mean;
}

void expect_true(const Statistics& s) {
  const auto pose = test::chi2_interval(6.0 * s.frames);
  EXPECT_GT(s.pose_nees * s.frames, pose.first);
  EXPECT_LT(s.pose_nees * s.frames, pose.second);
  const auto position = test::chi2_interval(3.0 * s.frames);
  EXPECT_GT(s.position_nees * s.frames, position.first);
  EXPECT_LT(s.position_nees * s.frames, position.second);
}

Scene twelve_bits(Scene scene) {
  scene.sensor.bit_depth = 12;
  scene.sensor.gain_dn_per_e = 0.4;
  return scene;
}

TEST(RefineDirect, SitsOnTheBoundOfThePixels) {
  const Scene scene = test::irregular_room();
  for (const Scene& s : {scene, twelve_bits(scene)}) {
    const Statistics direct = over_frames(s, Rung::direct, 60, FluxModel::ignore, s);
    expect_true(direct);
    EXPECT_LT(direct.over_scene_bound, 1.02);
    EXPECT_GT(direct.over_scene_bound, 0.99);
  }
}

/// Larger lamps of another emission, with the brightness of the room's lamps.
Scene with_half_power(Scene scene, double degrees) {
  for (Lamp& lamp : scene.lamps) {
    lamp.half_power_rad = degrees * pi / 180;
    lamp.radius_m = 0.1;
    lamp.power_w = 4 / (lamp.order() + 1);
  }
  return scene;
}

/// The order of emission determines how the light varies over a lamp's image. A wrong variation
/// has the effect of a shift of the rim. A difference of 4 degrees is hardly detectable here.
TEST(RefineDirect, AdaptsToAnEmissionThatTheSceneMisstates) {
  const Scene room = test::irregular_room();
  for (const auto& [actual, assumed] :
       {std::pair{60, 56}, {60, 45}, {45, 60}, {30, 60}, {60, 30}}) {
    const Statistics s = over_frames(with_half_power(room, actual), Rung::direct, 30,
                                     FluxModel::ignore, with_half_power(room, assumed));
    EXPECT_LT(s.position_nees, 6) << actual << " degrees, assumed " << assumed;
    EXPECT_LT(s.pose_nees, 9) << actual << " degrees, assumed " << assumed;
    EXPECT_LT(s.over_scene_bound, 1.15) << actual << " degrees, assumed " << assumed;
  }
}

TEST(RefineDirect, AdaptsToTwoLampsOfAnotherEmission) {
  const Scene room = with_half_power(test::irregular_room(), 60);
  Scene actual = room;
  for (const std::size_t i : {3, 4}) actual.lamps[i] = with_half_power(room, 30).lamps[i];
  const Statistics s = over_frames(actual, Rung::direct, 30, FluxModel::ignore, room);
  EXPECT_LT(s.position_nees, 4.5);
  EXPECT_LT(s.pose_nees, 9);
}

TEST(SlowRefineDirect, ErrorsOverTheBoundAreAsSmallAsTheyCanBe) {
  const Scene scene = test::irregular_room();
  for (const Scene& s : {scene, twelve_bits(scene)}) {
    for (const Rung rung : {Rung::rims, Rung::direct}) {
      const Statistics statistics = over_frames(s, rung, 2000, FluxModel::ignore, s);
      std::printf(
          "rung %d, %d bits: error over bound %.4f, NEES %.3f / 6, %.3f / 3, stated over "
          "the scene's bound %.4f\n",
          static_cast<int>(rung), s.sensor.bit_depth, statistics.over_bound, statistics.pose_nees,
          statistics.position_nees, statistics.over_scene_bound);
      EXPECT_LT(statistics.over_bound, rung == Rung::rims ? 1.05 : 1.02);
      expect_true(statistics);
    }
  }
}

TEST(RefineDirect, KnownPowersTellMore) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.power_sigma = 0.0005;
  const auto covariance = [&](FluxModel flux) {
    const Frame frame = make_frame(scene, truth(), 3);
    RefineOptions options = by(Rung::direct);
    options.flux = flux;
    const auto refined = refine_directly(frame, scene, options);
    EXPECT_TRUE(refined.ok());
    EXPECT_LT(error_m(*refined, truth()), 1e-3);
    EXPECT_EQ(refined->flux_factor.has_value(), flux == FluxModel::common_factor);
    EXPECT_NEAR(refined->flux_factor.value_or(1), 1, 0.002);
    return refined->covariance.trace();
  };
  EXPECT_LT(covariance(FluxModel::known_power), covariance(FluxModel::ignore));
  EXPECT_LT(covariance(FluxModel::common_factor), covariance(FluxModel::ignore));
}

TEST(RefineDirect, LearnsAPsfThatTheSceneMisstates) {
  const Scene scene = test::irregular_room();
  const double exact = refine_directly(make_frame(scene, truth(), 5), scene)->covariance.trace();
  for (const double factor : {0.5, 0.8, 1.25, 2.0}) {
    Scene believed = scene;
    believed.sensor.psf_sigma_px *= factor;
    const auto refined = refine_directly(make_frame(scene, truth(), 5), believed);
    ASSERT_TRUE(refined.ok()) << refined.message;
    EXPECT_NEAR(refined->psf_sigma_px.value(), 0.8, 0.12) << factor;
    EXPECT_LT(error_m(*refined, truth()), 4e-4) << factor;
    EXPECT_LT(refined->covariance.trace(), 1.4 * exact) << factor;
  }
}

/// A frame blurred by a Gaussian that is sampled at whole pixels, as software does: not the image
/// of any lens. Aliasing then moves the rim's grey levels by some parts in a thousand.
Frame blurred_by_software(const Scene& scene, const Rigid3& pose, std::uint64_t seed) {
  const double sigma_px = scene.sensor.psf_sigma_px;
  Scene sharp = scene;
  sharp.sensor.psf_sigma_px = 0.1;
  const Eigen::MatrixXd light = test::mean_electrons(sharp, pose, 12000);
  Eigen::MatrixXd once = light, twice = light;
  const auto blur = [sigma_px](const Eigen::MatrixXd& in, Eigen::MatrixXd& out, int dx, int dy) {
    out.setZero();
    double sum = 0;
    for (int k = -4; k <= 4; ++k) sum += std::exp(-0.5 * k * k / (sigma_px * sigma_px));
    for (int k = -4; k <= 4; ++k) {
      const double weight = std::exp(-0.5 * k * k / (sigma_px * sigma_px)) / sum;
      out.block(4, 4, in.rows() - 8, in.cols() - 8) +=
          weight * in.block(4 + k * dx, 4 + k * dy, in.rows() - 8, in.cols() - 8);
    }
  };
  blur(light, once, 1, 0);
  blur(once, twice, 0, 1);
  Frame frame = make_frame(scene, pose, seed);
  Random random(seed);
  const Sensor& sensor = scene.sensor;
  for (int y = 0; y < frame.image.height; ++y)
    for (int x = 0; x < frame.image.width; ++x) {
      const double e = random.poisson(twice(x, y)) + sensor.read_noise_e * random.normal();
      const double dn = std::round(sensor.black_level_dn + sensor.gain_dn_per_e * e);
      frame.image.u8[y * frame.image.width + x] =
          static_cast<std::uint8_t>(std::clamp(dn, 0.0, 255.0));
    }
  return frame;
}

TEST(SlowRefineDirect, AnEdgeThatIsNotTheModelsIsNotTrustedInTheDark) {
  const Scene scene = test::irregular_room();
  Random random(4);
  double nees = 0;
  int frames = 0;
  for (std::uint64_t seed = 0; frames < 48; ++seed) {
    const Rigid3 pose = test::random_room_pose(random);
    const Frame frame = blurred_by_software(scene, pose, seed);
    if (frame.cut || frame.matches.size() < 4) continue;
    const auto refined =
        refine(pose, frame.matches, frame.blobs, scene, by(Rung::direct), frame.image.view());
    ASSERT_TRUE(refined.ok()) << refined.message;
    const Vector6 error = difference(refined->cam_from_world, pose);
    nees += test::nees(error, refined->covariance);
    ++frames;
  }
  EXPECT_LT(nees, test::chi2_interval(6.0 * frames).second);
}

// The clipping of a saturated image depends on the far tail of the PSF, which is unknown; the rims
// allow for that.
TEST(RefineDirect, SaturatedDiscsAreTakenByTheirRims) {
  Scene scene = test::irregular_room();
  scene.sensor.exposure_s *= 8;
  for (const double assumed_psf_px : {0.8, 1.2}) {
    double nees = 0;
    constexpr int frames = 20;
    for (int i = 0; i < frames; ++i) {
      const Frame frame = make_frame(scene, truth(), static_cast<std::uint64_t>(i));
      Scene assumed = scene;
      assumed.sensor.psf_sigma_px = assumed_psf_px;
      const auto refined = refine_directly(frame, assumed);
      ASSERT_TRUE(refined.ok());
      const auto by_rims = refine(start(), frame.matches, frame.blobs, assumed);
      EXPECT_LT(difference(refined->cam_from_world, by_rims->cam_from_world).norm(), 1e-6);
      EXPECT_TRUE(refined->rim_growth_px);
      const Vector6 error = difference(refined->cam_from_world, truth());
      nees += test::nees(error, refined->covariance);
    }
    EXPECT_LT(nees, test::chi2_interval(6.0 * frames).second) << assumed_psf_px;
  }
}

TEST(RefineDirect, ALampThatDoesNotOfferItsPixelsIsTakenByItsRim) {
  const Scene scene = test::irregular_room();
  Frame frame = make_frame(scene, truth(), 2);
  ASSERT_GE(frame.matches.size(), 5u);
  frame.blobs[frame.matches[0].blob].merged = true;
  frame.blobs[frame.matches[1].blob].striped = true;
  frame.blobs[frame.matches[2].blob].striped = true;
  frame.blobs[frame.matches[2].blob].rim.clear();
  const auto refined = refine_directly(frame, scene);
  ASSERT_TRUE(refined.ok());
  EXPECT_EQ(refined->lamps[0].rung, Rung::rims);
  EXPECT_EQ(refined->lamps[1].rung, Rung::rims);
  EXPECT_EQ(refined->lamps[2].rung, Rung::centres);
  EXPECT_EQ(refined->lamps[3].rung, Rung::direct);
  EXPECT_NEAR(refined->lamps[3].misfit, 1, 0.15);
  EXPECT_LT(error_m(*refined, truth()), 1e-3);

  const auto without_image = refine(start(), frame.matches, frame.blobs, scene, by(Rung::direct));
  const auto rims = refine(start(), frame.matches, frame.blobs, scene);
  EXPECT_EQ(without_image->cam_from_world.matrix(), rims->cam_from_world.matrix());
  EXPECT_EQ(without_image->lamps[3].rung, Rung::rims);
}

/// A lamp that looks nothing like the scene says must not pull the pose.
TEST(RefineDirect, ALampThatTheModelDoesNotExplainIsTakenByItsRim) {
  const Scene scene = test::irregular_room();
  Frame frame = make_frame(scene, truth(), 2);
  const Blob& blob = frame.blobs[frame.matches[1].blob];
  for (int y = blob.y0; y <= blob.y1; ++y)  // a dark grating before it
    for (int x = blob.x0; x <= blob.x1; x += 3) frame.image.u8[y * frame.image.width + x] = 2;
  const auto refined = refine_directly(frame, scene);
  ASSERT_TRUE(refined.ok());
  EXPECT_EQ(refined->lamps[1].rung, Rung::rims);
  EXPECT_EQ(refined->lamps[0].rung, Rung::direct);
  EXPECT_LT(error_m(*refined, truth()), 1e-3);
}

/// The image with three equal channels.
Image as_colour(const Image& grey) {
  Image colour = grey;
  colour.channels = 3;
  colour.u8.clear();
  for (const std::uint8_t level : grey.u8) colour.u8.insert(colour.u8.end(), 3, level);
  return colour;
}

TEST(RefineDirect, ReadsColourAsTheDetectionDoes) {
  Scene scene = test::irregular_room();
  scene.sensor.response = Response::linear;
  const Frame frame = make_frame(scene, truth(), 2);
  const Image colour = as_colour(frame.image);
  const RefineOptions options = by(Rung::direct);
  const auto refined = refine(start(), frame.matches, frame.blobs, scene, options, colour.view());
  EXPECT_LT(
      difference(refined->cam_from_world, refine_directly(frame, scene)->cam_from_world).norm(),
      1e-7);
}

TEST(RefineDirect, TakesColourPicturesAsSrgb) {
  Scene scene = test::irregular_room(), stated = scene;
  stated.sensor.response = Response::srgb;
  const Frame frame = make_frame(stated, truth(), 2);
  const Image colour = as_colour(frame.image);
  const auto refined_in = [&](const Scene& room) {
    return refine(start(), frame.matches, frame.blobs, room, by(Rung::direct), colour.view());
  };
  const auto refined = refined_in(scene), as_stated = refined_in(stated);
  ASSERT_TRUE(refined.ok());
  EXPECT_EQ(refined->cam_from_world.matrix(), as_stated->cam_from_world.matrix());
  EXPECT_EQ(refined->covariance, as_stated->covariance);
}

TEST(RefineDirect, UndoesTheResponse) {
  for (const int bits : {8, 12}) {
    Scene scene = bits == 8 ? test::irregular_room() : twelve_bits(test::irregular_room());
    scene.sensor.response = Response::gamma;
    double nees = 0;
    constexpr int frames = 60;
    for (int i = 0; i < frames; ++i) {
      const Frame frame = make_frame(scene, truth(), static_cast<std::uint64_t>(i));
      const auto refined = refine_directly(frame, scene);
      ASSERT_TRUE(refined.ok()) << refined.message;
      EXPECT_EQ(refined->lamps[0].rung, Rung::direct);
      const Vector6 error = difference(refined->cam_from_world, truth());
      nees += test::nees(error, refined->covariance);
    }
    const auto interval = test::chi2_interval(6.0 * frames);
    EXPECT_GT(nees, interval.first) << bits;
    EXPECT_LT(nees, interval.second) << bits;
  }
}

TEST(RefineDirect, RefusesAnImageOfAnotherSize) {
  const Scene scene = test::irregular_room();
  Frame frame = make_frame(scene, truth(), 2);
  Scene larger = scene;
  larger.camera = Camera::pinhole(641, 480, 422.5, 422.5, 319.5, 239.5);
  EXPECT_NE(test::complaint([&] { refine_directly(frame, larger); }).find("image"),
            std::string::npos);
}

TEST(RefineDirect, IsAsGoodAsRimsOnRenderedRooms) {
  std::vector<double> errors;
  for (const char* prefix : {"irregular6", "square4", "sat_"}) {
    for (const auto& path : test::rendered_rooms(prefix)) {
      const test::RenderedRoom room = test::read_rendered_room(path);
      const auto nearest = [&](Rung rung) {
        LocateOptions options;
        options.refine.rung = rung;
        double least = std::numeric_limits<double>::infinity();
        const Result<Fix> fix = locate(room.image.view(), room.scene, options);
        for (const Candidate& c : fix->candidates)
          least = std::min(least, (c.position_m - room.position_m).norm());
        return least;
      };
      errors.push_back(nearest(Rung::direct));
      std::printf("%s: rims %.3f mm, direct %.3f mm\n", room.name.c_str(),
                  1e3 * nearest(Rung::rims), 1e3 * errors.back());
      EXPECT_LT(errors.back(), 3e-4) << room.name;
    }
  }
  if (errors.empty()) GTEST_SKIP() << "rendered rooms are not here";
  std::nth_element(errors.begin(), errors.begin() + 5, errors.end());
  EXPECT_LT(errors[5], 2.5e-4);
}

}  // namespace
}  // namespace occ
