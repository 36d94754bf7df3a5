// SPDX-License-Identifier: Apache-2.0
// Brightness and size as evidence: reflections and lamps of different powers are simulated by the
// image formation's own formula; fluxes without information must not matter.
#include <Eigen/Eigenvalues>
#include <array>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "tests/identify/identify_support.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/rim_support.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::View;

/// Deviations of the lights from the data of their lamps.
struct Errors {
  double sigma_px = 0.1;
  double power = 0.1;  ///< relative
  double gain = 1;     ///< unknown exposure, relative to the sensor's data
};

void add_light(const Lamp& lamp, int name, const Scene& scene, const Errors& errors, double share,
               Random& random, View& view) {
  constexpr double border_px = 18;
  const auto px = project_lamp_centre(lamp, view.cam_from_world, scene.camera);
  if (!px || px->minCoeff() < border_px || px->x() > scene.camera.width() - border_px ||
      px->y() > scene.camera.height() - border_px)
    return;
  const double electrons = lamp_electrons(lamp, view.cam_from_world, scene.camera, scene.sensor);
  if (!(electrons > 0)) return;
  const Vector2d noise(random.normal(), random.normal());
  Blob blob =
      test::spot(*px + errors.sigma_px * noise, errors.sigma_px,
                 errors.gain * share * electrons * std::exp(errors.power * random.normal()));
  blob.flux_sigma_dn = 0.02 * blob.flux_dn;
  view.blobs.push_back(blob);
  view.lamp.push_back(name);
}

View see(const Scene& scene, const Rigid3& pose, const Errors& errors, Random& random) {
  View view{pose, {}, {}};
  for (std::size_t i = 0; i < scene.lamps.size(); ++i)
    add_light(scene.lamps[i], static_cast<int>(i), scene, errors, 1, random, view);
  return view;
}

/// Adds the reflections of the lamps in a mirror at x = wall_m.
void add_mirrored(View& view, const Scene& scene, double wall_m, double reflectance,
                  const Errors& errors, Random& random) {
  for (Lamp lamp : scene.lamps) {
    lamp.centre_m.x() = 2 * wall_m - lamp.centre_m.x();
    lamp.normal.x() = -lamp.normal.x();
    add_light(lamp, -1, scene, errors, reflectance, random, view);
  }
}

Scene square(const std::vector<double>& powers_w) {
  Scene scene = test::square_room();
  for (std::size_t i = 0; i < 4; ++i) scene.lamps[i].power_w = powers_w[i];
  return scene;
}

IdentifyOptions without_brightness() {
  IdentifyOptions options;
  options.use_brightness = false;
  return options;
}

View view_of_all(const Scene& scene, const Errors& errors, Random& random) {
  for (;;) {
    View view = see(scene, test::random_room_pose(random), errors, random);
    if (view.blobs.size() == scene.lamps.size()) return view;
  }
}

TEST(IdentifyBrightness, ASquareOfUnequalLampsHasOnePose) {
  const Scene scene = square({1, 2, 4, 8});
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    Errors errors;
    errors.gain = std::exp(random.uniform(-5, 5));  // the exposure is unknown
    const View view = view_of_all(scene, errors, random);
    const Result<Identification> found = identify(view.blobs, scene);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_TRUE(test::assignment_is_right(found->hypotheses.front(), view));
    EXPECT_EQ(identify(view.blobs, scene, without_brightness())->hypotheses.size(), 4u);
  }
}

TEST(IdentifyBrightness, ASquareOfEqualLampsHasFourPoses) {
  const Scene scene = square({1, 1, 1, 1});
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const View view = view_of_all(scene, {}, random);
    EXPECT_EQ(identify(view.blobs, scene)->hypotheses.size(), 4u);
  }
}

// Equal lamps with a measured emission to one side, turned differently: only their brightness
// distinguishes the four poses.
TEST(IdentifyBrightness, ASquareOfTurnedAsymmetricLampsHasOnePose) {
  Scene scene = square({1, 1, 1, 1});
  const auto sideways = test::profile_of(
      [](double gamma, double c) {
        return std::cos(gamma) * std::exp(3 * std::sin(gamma) * std::cos(c));
      },
      5, 15);
  for (std::size_t i = 0; i < 4; ++i) {
    Lamp& lamp = scene.lamps[i];
    lamp.photometry = sideways;
    // Lamps 0 and 3 shine into the room, lamp 1 away from its middle, lamp 2 along a wall.
    const double angle = pi / 4 * std::array<int, 4>{1, -1, 1, 5}[i];
    lamp.x_axis = {std::cos(angle), std::sin(angle), 0};
  }
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    Errors errors;
    errors.gain = std::exp(random.uniform(-5, 5));
    const View view = view_of_all(scene, errors, random);
    const Result<Identification> found = identify(view.blobs, scene);
    EXPECT_TRUE(test::assignment_is_right(found->hypotheses.front(), view));
    EXPECT_EQ(identify(view.blobs, scene, without_brightness())->hypotheses.size(), 4u);
  }
}

// The powers are uncertain by 10 %.
TEST(IdentifyBrightness, LampsThatHardlyDifferStayAmbiguous) {
  const Scene scene = square({1, 1.1, 1, 1.1});
  Random random(3);
  int unique = 0, wrong = 0;
  for (int i = 0; i < 100; ++i) {
    const View view = view_of_all(scene, {}, random);
    const Result<Identification> found = identify(view.blobs, scene);
    unique += found.ok();
    wrong += found.ok() && !test::assignment_is_right(found->hypotheses.front(), view);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(unique, 0);
}

// Half the lamps are saturated, one of them strongly, or blink with any duty cycle.
TEST(IdentifyBrightness, BoundsAreNoMeasurements) {
  Scene scene = square({1, 2, 4, 8});
  Random random(4);
  for (const bool blinks : {false, true}) {
    if (blinks)
      for (Lamp& lamp : scene.lamps) lamp.frequency_hz = 1000;
    for (int i = 0; i < 100; ++i) {
      View view = view_of_all(scene, {}, random);
      for (std::size_t k = 0; k < 4; ++k) {
        if (!blinks && k < 2) continue;
        view.blobs[k].flux_dn *= random.uniform(0.02, 1);
        view.blobs[k].saturated = !blinks;
      }
      const Result<Identification> found = identify(view.blobs, scene);
      EXPECT_TRUE(test::holds_truth(*found, view)) << found.message;
    }
  }
}

// The powers in the map are wrong.
TEST(IdentifyBrightness, WrongPowersTakeNothingAway) {
  const Scene truth = square({8, 1, 3, 1});
  const Scene map = square({1, 1, 1, 1});
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const View view = view_of_all(truth, {}, random);
    EXPECT_EQ(identify(view.blobs, map)->hypotheses.size(), 4u);
  }
}

/// A map that is symmetric under reflection, with no other symmetry.
Scene mirror_symmetric_room(Random& random) {
  Scene scene = test::irregular_room();
  scene.lamps.clear();
  for (int i = 0; i < 4; ++i) {
    const double x = 1.1 + 0.7 * i + random.uniform(-0.15, 0.15), y = random.uniform(0.25, 0.9);
    for (const double side : {-1.0, 1.0})
      scene.lamps.push_back(
          test::disc_lamp(static_cast<int>(scene.lamps.size()), {x, 2 + side * y, 3}));
  }
  return scene;
}

struct Tally {
  int unique = 0, wrong = 0, lost = 0;
};

/// A camera near a glass wall at x = 4 that sees some lamps and some reflections.
Tally before_a_glass_wall(int trials, int hidden, const IdentifyOptions& options) {
  Tally tally;
  Random random(6);
  while (trials > 0) {
    const Scene scene = mirror_symmetric_room(random);
    const Vector3d eye(random.uniform(3, 3.9), random.uniform(1.5, 2.5), random.uniform(0, 0.4));
    const Rigid3 pose = look_at(eye, {random.uniform(3.4, 4.4), random.uniform(1.5, 2.5), 3},
                                {std::cos(2 * pi * random.uniform()), 1, 0});
    const Errors errors{0.1, 0.1, std::exp(random.uniform(-5, 5))};
    View view = see(scene, pose, errors, random);
    const std::size_t direct = view.blobs.size();
    add_mirrored(view, scene, 4, random.uniform(0.04, 0.3), errors, random);
    if (direct < 5 + static_cast<std::size_t>(hidden) || view.blobs.size() < 2 * direct) continue;
    for (int i = 0; i < hidden; ++i) test::hide(view, 0);
    --trials;
    test::shuffle(view, random);
    const Result<Identification> found = identify(view.blobs, scene, options);
    tally.unique += found.ok();
    tally.wrong +=
        found.ok() && !test::pose_is_near(found->hypotheses.front().cam_from_world, pose);
    tally.lost += !test::holds_truth(*found, view);
  }
  return tally;
}

TEST(IdentifyBrightness, ReflectionsInAGlassWallAreNotTheLamps) {
  const Tally seen = before_a_glass_wall(40, 0, {});
  EXPECT_EQ(seen.wrong, 0);
  EXPECT_EQ(seen.lost, 0);
  EXPECT_GE(seen.unique, 38);
  // Without brightness the reflections match as many lamps.
  EXPECT_LT(before_a_glass_wall(40, 0, without_brightness()).unique, 20);
}

TEST(IdentifyBrightness, EvenWhereMoreReflectionsThanLampsAreVisible) {
  const Tally seen = before_a_glass_wall(40, 1, {});
  EXPECT_EQ(seen.wrong, 0);
  EXPECT_EQ(seen.lost, 0);
  EXPECT_GE(seen.unique, 38);
  EXPECT_GT(before_a_glass_wall(40, 1, without_brightness()).wrong, 20);
}

/// Counts unique answers for false lights of any brightness.
Tally chance_of_false_lights(int trials, const IdentifyOptions& options) {
  Tally tally;
  Random random(7);
  for (int i = 0; i < trials; ++i) {
    Scene scene = test::random_room(random, 6);
    for (Lamp& lamp : scene.lamps) lamp.power_w = std::exp(random.uniform(-1, 1));
    View view;
    test::add_false_lights(view, scene, random, 6);
    for (Blob& blob : view.blobs) {
      blob.flux_dn = std::exp(random.uniform(4, 9));
      blob.flux_sigma_dn = 0.02 * blob.flux_dn;
    }
    tally.wrong += identify(view.blobs, scene, options).ok();
  }
  return tally;
}

TEST(SlowIdentifyBrightness, AddsNoFalseMatches) {
  const Tally with = chance_of_false_lights(2000, {});
  const Tally without = chance_of_false_lights(2000, without_brightness());
  EXPECT_LE(with.wrong, without.wrong);
  RecordProperty("with", with.wrong);
  RecordProperty("without", without.wrong);
}

/// Ellipse from the second moments of evenly spaced points on it.
Ellipse ellipse_of(const std::vector<RimPoint>& rim) {
  Eigen::Matrix2Xd px(2, static_cast<Eigen::Index>(rim.size()));
  for (std::size_t i = 0; i < rim.size(); ++i) px.col(static_cast<Eigen::Index>(i)) = rim[i].px;
  Ellipse e;
  e.centre_px = px.rowwise().mean();
  px.colwise() -= e.centre_px;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(px * px.transpose() /
                                                            static_cast<double>(rim.size()));
  e.semi_minor_px = std::sqrt(2 * axes.eigenvalues()[0]);
  e.semi_major_px = std::sqrt(2 * axes.eigenvalues()[1]);
  e.angle_rad = std::atan(axes.eigenvectors()(1, 1) / axes.eigenvectors()(0, 1));
  return e;
}

TEST(IdentifyBrightness, SizesDistinguishLamps) {
  Scene scene = test::square_room();
  Random random(8);
  for (const bool differ : {true, false}) {
    for (std::size_t i = 0; i < 4; ++i)
      scene.lamps[i].radius_m = differ ? 0.1 * std::pow(1.2, static_cast<double>(i)) : 0.15;
    for (int trial = 0; trial < 20; ++trial) {
      View view = view_of_all(scene, {}, random);
      for (std::size_t i = 0; i < 4; ++i) {
        view.blobs[i].rim =
            test::exact_rim(scene.lamps[i], view.cam_from_world, scene.camera, 32, 0.05);
        view.blobs[i].ellipse = ellipse_of(view.blobs[i].rim);
        view.blobs[i].flux_sigma_dn = 0;  // fluxes are unknown
      }
      const Result<Identification> found = identify(view.blobs, scene);
      EXPECT_EQ(found->hypotheses.size(), differ ? 1u : 4u) << trial;
      EXPECT_TRUE(test::holds_truth(*found, view));
    }
  }
}

}  // namespace
}  // namespace occ
