// SPDX-License-Identifier: Apache-2.0
// Errors of the map and of the camera that the scene states: poses from wrong maps and cameras are
// as far off as their covariance states.
#include "libocc/refine/internal/scene_errors.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/error_gradient.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

using internal::refine::LampErrors;

constexpr double focal_error = 0.01, k1_error = 0.05, sigma_rad = 0.05;

Rigid3 seen_from() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

/// A scene as it is, and as its author states it.
struct World {
  Scene real, stated;
};

double pose_nees(const Refined& refined, const Rigid3& from = seen_from()) {
  const Vector6 error = difference(refined.cam_from_world, from);
  return test::nees(error, refined.covariance);
}

/// The sum over `count` worlds is chi-square with 6 degrees of freedom each.
template <class Draw>
void expect_true_covariance(const Draw& draw, const test::Measurement& measurement,
                            RefineOptions options = {}, int count = 150,
                            const Rigid3& from = seen_from()) {
  Random random(3);
  double sum = 0;
  int left_out = 0, missed = 0;
  for (int i = 0; i < count; ++i) {
    const World world = draw(random);
    const auto exact = test::exact_blobs(world.real, from, measurement);
    const auto blobs = test::noisy(exact, world.real, measurement, random);
    const auto refined = refine(from, test::in_order(world.stated), blobs, world.stated, options);
    if (!refined.ok()) {  // an honest answer, but rare
      EXPECT_EQ(refined.status, Status::not_converged) << refined.message;
      ++missed;
      continue;
    }
    for (const LampResidual& lamp : refined->lamps) left_out += lamp.contradicts ? 1 : 0;
    sum += pose_nees(*refined, from);
  }
  EXPECT_LE(missed, count / 50);
  const auto [low, high] = test::chi2_interval(6.0 * (count - missed));
  EXPECT_GT(sum, low);
  EXPECT_LT(sum, high);
  EXPECT_LE(left_out, 5);  // one lamp in a thousand, by chance
}

World with_wrong_positions(const Scene& map, const Eigen::Vector3d& sigma_m, Random& random) {
  World world{map, map};
  world.stated.map_sigma_m = sigma_m;
  for (Lamp& lamp : world.real.lamps)
    for (int axis = 0; axis < 3; ++axis) lamp.centre_m[axis] += sigma_m[axis] * random.normal();
  world.real.validate();
  world.stated.validate();
  return world;
}

constexpr test::Measurement with_rims{80, 0.05, 0.03}, without_rims{0, 0, 0.03};

TEST(SceneErrors, CovarianceContainsWrongPositions) {
  for (const double sigma_m : {0.0005, 0.002, 0.01, 0.03})
    for (const test::Measurement& measurement : {with_rims, without_rims}) {
      SCOPED_TRACE(sigma_m);
      SCOPED_TRACE(measurement.rim_points);
      const auto draw = [&](Random& random) {
        return with_wrong_positions(test::irregular_room(), Eigen::Vector3d::Constant(sigma_m),
                                    random);
      };
      expect_true_covariance(draw, measurement);
    }
}

TEST(SceneErrors, ModelSigmaCoversWrongPositions) {
  for (const double sigma_px : {0.1, 0.5, 1.5}) {
    SCOPED_TRACE(sigma_px);
    const auto draw = [&](Random& random) {
      World world{test::irregular_room(), test::irregular_room()};
      for (Lamp& lamp : world.real.lamps) {
        Eigen::Matrix<double, 2, 3> px_per_m;
        world.real.camera.project(seen_from() * lamp.centre_m, &px_per_m);
        lamp.centre_m += std::sqrt(2.0) * sigma_px / px_per_m.norm() * test::random_vector(random);
      }
      return world;
    };
    RefineOptions options;
    options.model_sigma_px = sigma_px;
    expect_true_covariance(draw, with_rims, options);
  }
}

TEST(SceneErrors, PositionsMayBeWrongAlongOneAxis) {
  const auto draw = [](Random& random) {
    return with_wrong_positions(test::irregular_room(), {0, 0, 0.02}, random);
  };
  expect_true_covariance(draw, with_rims);
}

TEST(SceneErrors, HeightsMayBeKnownMuchBetterThanPlaces) {
  constexpr test::Measurement precise_rims{80, 0.01, 0.01};
  const Rigid3 far = look_at({2.2, 1.7, 0.58}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  for (const double height_sigma_m : {0.001, 0.003}) {
    SCOPED_TRACE(height_sigma_m);
    const auto draw = [&](Random& random) {
      return with_wrong_positions(test::irregular_room(), {0.02, 0.02, height_sigma_m}, random);
    };
    expect_true_covariance(draw, precise_rims);
    Random random(5);
    for (int i = 0; i < 20; ++i) {  // converges from a start that is 15 cm off
      const World world = draw(random);
      const auto blobs = test::exact_blobs(world.real, seen_from(), precise_rims);
      const auto refined = refine(far, test::in_order(world.stated), blobs, world.stated);
      EXPECT_TRUE(refined.ok()) << refined.message;
      EXPECT_LT(refined->covariance.diagonal().tail<3>().sum(), 0.05 * 0.05);
    }
  }
}

TEST(SceneErrors, CovarianceContainsWrongSizes) {
  const auto draw = [](Random& random) {
    World world{test::irregular_room(), test::irregular_room()};
    for (Lamp& lamp : world.stated.lamps) lamp.size_sigma = 0.03;
    for (Lamp& lamp : world.real.lamps) lamp.radius_m *= 1 + 0.03 * random.normal();
    return world;
  };
  expect_true_covariance(draw, with_rims);
}

TEST(SceneErrors, CovarianceContainsTiltedLamps) {
  const auto draw = [](Random& random) {
    World world{test::irregular_room(), test::irregular_room()};
    for (Lamp& lamp : world.stated.lamps) lamp.tilt_sigma_rad = sigma_rad;
    for (Lamp& lamp : world.real.lamps) {
      const double x = sigma_rad * random.normal(), y = sigma_rad * random.normal();
      lamp.normal = so3_exp(Eigen::Vector3d(x, y, 0)) * lamp.normal;
    }
    world.real.validate();
    return world;
  };
  expect_true_covariance(draw, with_rims);
}

World with_wrong_camera(Random& random) {
  World world{test::irregular_room(), test::irregular_room()};
  const Camera& camera = world.real.camera;
  const double f = camera.fx_px();
  world.stated.camera = camera.with_parameter_sigmas(
      {{"fx_px", focal_error * f}, {"fy_px", focal_error * f}, {"k1", k1_error}});
  const double x = random.normal(), y = random.normal();
  world.real.camera = Camera::pinhole(camera.width(), camera.height(), f * (1 + focal_error * x),
                                      f * (1 + focal_error * y), camera.cx_px(), camera.cy_px(),
                                      {k1_error * random.normal(), 0, 0, 0});
  return world;
}

TEST(SceneErrors, CovarianceContainsAWrongCamera) {
  expect_true_covariance(with_wrong_camera, with_rims);
  expect_true_covariance(with_wrong_camera, without_rims);
}

// The images of level lamps do not depend on focal length and distance alone, but on their ratio:
// the prior determines the focal length, however many points a rim has.
TEST(SceneErrors, CovarianceContainsTheFocalLengthOfACameraThatLooksStraightAtTheCeiling) {
  const Rigid3 straight = look_at({1.9, 2, 0.5}, {1.9, 2, 3.0}, {0, 1, 0});
  Scene level = test::irregular_room();
  for (Lamp& lamp : level.lamps) lamp.centre_m.z() = 3;
  const double f = level.camera.fx_px();
  for (const double sigma : {0.002, 0.02, 0.05})
    for (const int rim_points : {80, 1000}) {
      SCOPED_TRACE(testing::Message() << sigma << ", " << rim_points);
      const auto draw = [&](Random& random) {
        World world{level, level};
        world.stated.camera = level.camera.with_parameter_sigmas({{"f_px", sigma * f}});
        const Camera& camera = level.camera;
        const double real = f * (1 + sigma * random.normal());
        world.real.camera = Camera::pinhole(camera.width(), camera.height(), real, real,
                                            camera.cx_px(), camera.cy_px());
        return world;
      };
      expect_true_covariance(draw, {rim_points, 0.05, 0.03}, {}, 60, straight);
    }
}

// The focal length follows from the differences of the lamps' distances, which their errors hide: a
// bias of its derivative would appear.
TEST(SceneErrors, CovarianceContainsMapAndCameraTogether) {
  for (const double sigma_m : {0.0005, 0.002, 0.005}) {
    SCOPED_TRACE(sigma_m);
    const auto draw = [&](Random& random) {
      World world = with_wrong_camera(random);
      const World map =
          with_wrong_positions(world.real, Eigen::Vector3d::Constant(sigma_m), random);
      world.real.lamps = map.real.lamps;
      world.stated.map_sigma_m = map.stated.map_sigma_m;
      return world;
    };
    expect_true_covariance(draw, with_rims);
  }
}

/// Errors of the map: its scale, and its height, which grows along x. Lamps have errors of their
/// own as well.
World with_shared_errors(const World& from, Random& random) {
  constexpr double own_m = 0.001, scale = 0.004, slope = 0.006;
  World world = from;
  world.stated.map_sigma_m = PerAxis(own_m);
  const double scale_error = random.normal(), slope_error = random.normal();
  for (std::size_t i = 0; i < world.real.lamps.size(); ++i) {
    const Eigen::Vector3d& at = world.stated.lamps[i].centre_m;
    const Eigen::Vector3d by_scale = scale * (at - Eigen::Vector3d(2, 2, 0));
    const Eigen::Vector3d by_slope(0, 0, slope * at.x());
    world.stated.lamps[i].shared_errors_m = {by_scale, by_slope};
    world.real.lamps[i].centre_m +=
        scale_error * by_scale + slope_error * by_slope + own_m * test::random_vector(random);
  }
  world.real.validate();
  world.stated.validate();
  return world;
}

TEST(SceneErrors, CovarianceContainsErrorsThatLampsShare) {
  for (const test::Measurement& measurement : {with_rims, without_rims}) {
    SCOPED_TRACE(measurement.rim_points);
    const auto draw = [](Random& random) {
      return with_shared_errors({test::irregular_room(), test::irregular_room()}, random);
    };
    expect_true_covariance(draw, measurement);
    const auto with_camera = [](Random& random) {
      return with_shared_errors(with_wrong_camera(random), random);
    };
    expect_true_covariance(with_camera, measurement);
  }
}

// No picture shows that the whole map is displaced.
TEST(SceneErrors, AShiftOfTheWholeMapIsAnErrorOfThePose) {
  const Scene exact = test::irregular_room();
  const Eigen::Vector3d shift_m(0.02, 0.01, -0.03);
  World world{exact, exact};
  for (Lamp& lamp : world.stated.lamps) lamp.shared_errors_m = {shift_m};
  for (Lamp& lamp : world.real.lamps) lamp.centre_m += 2 * shift_m;
  for (const test::Measurement& measurement : {with_rims, without_rims}) {
    const auto blobs = test::exact_blobs(exact, seen_from(), measurement);
    const auto plain = refine(seen_from(), test::in_order(exact), blobs, exact);
    const auto refined = refine(seen_from(), test::in_order(exact), blobs, world.stated);
    ASSERT_TRUE(plain.ok() && refined.ok());
    EXPECT_LT(difference(plain->cam_from_world, refined->cam_from_world).norm(), 1e-6);
    Vector6 moved = Vector6::Zero();
    moved.tail<3>() = seen_from().rotation * shift_m;
    const Matrix6 expected = plain->covariance + moved * moved.transpose();
    EXPECT_LT((refined->covariance - expected).norm(), 1e-3 * expected.norm());
    const Rigid3 in_map = seen_from() * Rigid3{Eigen::Matrix3d::Identity(), 2 * shift_m};
    const auto of_moved = test::exact_blobs(world.real, seen_from(), measurement);
    const auto displaced = refine(seen_from(), test::in_order(exact), of_moved, world.stated);
    ASSERT_TRUE(displaced.ok());
    EXPECT_LT(difference(displaced->cam_from_world, in_map).norm(), 1e-6);
  }
}

// No picture shows the scale of a map that was made from pictures: it is wrong for positions and
// sizes alike. The noise of the sizes of one picture must not move the pose then.
TEST(SceneErrors, AnErrorOfTheScaleMovesTheCameraAwayFromTheMiddleOfTheMap) {
  const Scene exact = test::irregular_room();
  Scene stated = exact;
  stated.map_scale_sigma = 0.01;
  Random random(8);
  const Eigen::Vector3d middle_m = stated.mean_lamp_position_m();
  Vector6 moved = Vector6::Zero();
  moved.tail<3>() = stated.map_scale_sigma * (seen_from() * middle_m);
  for (const test::Measurement& measurement : {with_rims, without_rims}) {
    const auto blobs =
        test::noisy(test::exact_blobs(exact, seen_from(), measurement), exact, measurement, random);
    const auto plain = refine(seen_from(), test::in_order(exact), blobs, exact);
    const auto refined = refine(seen_from(), test::in_order(exact), blobs, stated);
    ASSERT_TRUE(plain.ok() && refined.ok());
    EXPECT_LT(
        test::nees(difference(plain->cam_from_world, refined->cam_from_world), plain->covariance),
        1e-3);
    const Matrix6 expected = plain->covariance + moved * moved.transpose();
    EXPECT_LT((refined->covariance - expected).norm(), 0.01 * expected.norm());
  }
  for (const Rung rung : {Rung::centres, Rung::rims}) {
    const Matrix6 bound = pose_bound(exact, seen_from(), rung)->covariance;
    const Matrix6 expected = bound + moved * moved.transpose();
    EXPECT_LT((pose_bound(stated, seen_from(), rung)->covariance - expected).norm(),
              1e-3 * expected.norm());
  }
  EXPECT_FALSE(internal::refine::has_exact_map(stated));
}

// A prior of the position shows the scale, since the pictures show the distance over the scale.
TEST(SceneErrors, CovarianceContainsAWrongScale) {
  const auto draw = [](Random& random) {
    World world{test::irregular_room(), test::irregular_room()};
    world.stated.map_scale_sigma = 0.01;
    const double factor = 1 + world.stated.map_scale_sigma * random.normal();
    const Eigen::Vector3d middle_m = world.stated.mean_lamp_position_m();
    for (Lamp& lamp : world.real.lamps) {
      lamp.centre_m = middle_m + factor * (lamp.centre_m - middle_m);
      lamp.radius_m *= factor;
    }
    world.real.validate();
    return world;
  };
  for (const test::Measurement& measurement : {with_rims, without_rims})
    expect_true_covariance(draw, measurement);
}

// Errors of one lamp each, as shared errors.
TEST(SceneErrors, IndependentErrorsAreASpecialCaseOfSharedOnes) {
  constexpr double sigma_m = 0.005;
  const Scene exact = test::irregular_room();
  Scene own = exact, shared = exact;
  own.map_sigma_m = PerAxis(sigma_m);
  const std::size_t count = 3 * exact.lamps.size();
  for (std::size_t i = 0; i < exact.lamps.size(); ++i) {
    shared.lamps[i].shared_errors_m.assign(count, Eigen::Vector3d::Zero());
    for (int axis = 0; axis < 3; ++axis)
      shared.lamps[i].shared_errors_m[3 * i + static_cast<std::size_t>(axis)][axis] = sigma_m;
  }
  Random random(6);
  for (const test::Measurement& measurement : {with_rims, without_rims}) {
    const auto blobs =
        test::noisy(test::exact_blobs(exact, seen_from(), measurement), exact, measurement, random);
    const auto a = refine(seen_from(), test::in_order(exact), blobs, own);
    const auto b = refine(seen_from(), test::in_order(exact), blobs, shared);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_LT(test::nees(difference(a->cam_from_world, b->cam_from_world), a->covariance), 1e-4);
    EXPECT_LT((a->covariance - b->covariance).norm(), 0.01 * a->covariance.norm());
    EXPECT_NEAR(a->chi2, b->chi2, 0.01 * a->chi2);
    const auto bound_a = pose_bound(own, seen_from(), Rung::rims);
    const auto bound_b = pose_bound(shared, seen_from(), Rung::rims);
    EXPECT_LT((bound_a->covariance - bound_b->covariance).norm(),
              1e-6 * bound_a->covariance.norm());
  }
}

// In filters, a shared error moves the poses of all images alike, whatever their misfit is.
TEST(SceneErrors, TheGradientByASharedErrorIsThatByTheMotionOfTheCamera) {
  Scene stated = test::irregular_room();
  stated.map_sigma_m = PerAxis(0.002);
  const Eigen::Vector3d shift_m(0.003, 0, 0.001);
  for (Lamp& lamp : stated.lamps) lamp.shared_errors_m = {shift_m};
  for (const test::Measurement& measurement : {with_rims, without_rims})
    for (const double off_m : {0.0, 0.02}) {
      Scene real = stated;
      for (std::size_t i = 0; i < real.lamps.size(); ++i)
        real.lamps[i].centre_m.x() += i % 2 == 0 ? off_m : -off_m;
      const auto blobs = test::exact_blobs(real, seen_from(), measurement);
      const auto refined = refine(seen_from(), test::in_order(stated), blobs, stated);
      ASSERT_TRUE(refined.ok());
      EXPECT_EQ(refined->variance_factor > 2, off_m > 0);
      const auto gradient = internal::refine::error_gradient(*refined, blobs, stated, {});
      ASSERT_FALSE(gradient.sources.empty());
      EXPECT_EQ(gradient.sources.back().kind, internal::refine::ErrorGradient::Source::map);
      Vector6 moved = Vector6::Zero();
      moved.tail<3>() = refined->cam_from_world.rotation * shift_m;
      const Vector6 expected = refined->covariance.inverse() * moved;
      EXPECT_LT((gradient.gradient_by_errors.rightCols<1>() - expected).norm(),
                0.01 * expected.norm());
    }
}

// A fixed and a correlated error of both focal lengths: a square pixel.
TEST(SceneErrors, AFullCovarianceOfTheCamera) {
  const auto draw = [](Random& random) {
    World world{test::irregular_room(), test::irregular_room()};
    const Camera& camera = world.real.camera;
    const double sigma = focal_error * camera.fx_px(), scale = 1 + focal_error * random.normal();
    const auto count = static_cast<Eigen::Index>(camera.parameters().size());
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
    covariance.topLeftCorner<2, 2>().setConstant(sigma * sigma);
    world.stated.camera = camera.with_parameter_covariance(covariance);
    world.real.camera = Camera::pinhole(camera.width(), camera.height(), camera.fx_px() * scale,
                                        camera.fy_px() * scale, camera.cx_px(), camera.cy_px());
    return world;
  };
  expect_true_covariance(draw, with_rims);
}

// Errors that are stated much smaller than the noise have no effect.
TEST(SceneErrors, SmallErrorsChangeNothing) {
  const Scene exact = test::irregular_room();
  Scene stated = exact;
  stated.map_sigma_m = PerAxis(1e-9);
  stated.camera = stated.camera.with_parameter_sigmas({{"fx_px", 1e-6}});
  Random random(1);
  auto blobs =
      test::noisy(test::exact_blobs(exact, seen_from(), with_rims), exact, with_rims, random);
  for (Blob& blob : blobs) {  // errors common to a rim, correlated
    const RimErrorCovariance root =
        1e-2 * (RimErrorCovariance::Identity() + 0.3 * RimErrorCovariance::Ones());
    blob.rim_covariance_px2 = root * root.transpose();
    blob.rim_covariance_px2.row(3).setZero();  // no stretch along x
    blob.rim_covariance_px2.col(3).setZero();
  }
  const auto plain = refine(seen_from(), test::in_order(exact), blobs, exact);
  const auto with_errors = refine(seen_from(), test::in_order(stated), blobs, stated);
  ASSERT_TRUE(plain.ok() && with_errors.ok());
  // Derivatives by the pose then belong to the predicted points of the rims.
  EXPECT_LT(difference(plain->cam_from_world, with_errors->cam_from_world).norm(),
            1e-3 * std::sqrt(plain->covariance.trace()));
  EXPECT_LT((plain->covariance - with_errors->covariance).norm(), 1e-4 * plain->covariance.norm());
  EXPECT_NEAR(plain->chi2, with_errors->chi2, 1e-3 * plain->chi2);
}

// A lamp that is off by much more than its neighbours is estimated.
TEST(SceneErrors, TheErrorOfALampIsReported) {
  World world{test::irregular_room(), test::irregular_room()};
  world.stated.map_sigma_m = PerAxis(0.001);
  world.stated.lamps[2].position_sigma_m = PerAxis(0.02);
  const Eigen::Vector3d off(0.015, -0.01, 0.012);
  world.real.lamps[2].centre_m += off;
  const auto blobs = test::exact_blobs(world.real, seen_from(), with_rims);
  const auto refined = refine(seen_from(), test::in_order(world.stated), blobs, world.stated);
  ASSERT_TRUE(refined.ok());
  EXPECT_LT((refined->lamps[2].position_error_m - off).norm(), 1e-3);
  for (const std::size_t i : {0, 1, 3}) EXPECT_LT(refined->lamps[i].position_error_m.norm(), 1e-3);
}

TEST(SceneErrors, BoundsContainThem) {
  Random random(2);
  World world = with_wrong_camera(random);
  world.stated.map_sigma_m = PerAxis(0.005);
  const auto blobs = test::exact_blobs(world.stated, seen_from(), with_rims);
  const auto refined = refine(seen_from(), test::in_order(world.stated), blobs, world.stated);
  const auto bound = pose_bound(test::in_order(world.stated), blobs, world.stated, seen_from());
  ASSERT_TRUE(refined.ok() && bound.ok());
  EXPECT_LT((bound->covariance - refined->covariance).norm(), 0.02 * refined->covariance.norm());
  // The errors dominate, whatever the noise of the rims is.
  const auto of_scene = pose_bound(world.stated, seen_from(), Rung::rims);
  ASSERT_TRUE(of_scene.ok());
  EXPECT_NEAR(std::sqrt(of_scene->position_covariance_m2.trace()),
              std::sqrt(bound->position_covariance_m2.trace()),
              0.15 * std::sqrt(bound->position_covariance_m2.trace()));
}

// A lamp that is larger by e has the image of one that is nearer: the rims agree.
TEST(SceneErrors, AnErrorOfTheSizeIsAShiftAlongTheLineOfSight) {
  constexpr double e = 1e-3;
  const Lamp lamp = test::irregular_room().lamps[0];
  LampErrors errors;
  errors.size = e;
  const auto in_cam = lamp_in_cam(lamp, seen_from());
  const Eigen::Vector3d shift =
      internal::refine::unit_motion(errors, in_cam, 0, seen_from()).bottomRightCorner<3, 1>();
  Lamp larger = lamp, nearer = lamp;
  larger.radius_m *= 1 + e;
  nearer.centre_m += seen_from().rotation.transpose() * shift;
  const Camera camera = test::irregular_room().camera;
  const auto a = project_rim(larger, seen_from(), camera, 16);
  const auto b = project_rim(nearer, seen_from(), camera, 16);
  ASSERT_TRUE(a && b);
  for (std::size_t i = 0; i < 16; ++i) EXPECT_LT(((*a)[i] - (*b)[i]).norm(), 1e-3 * e * 640);
}

}  // namespace
}  // namespace occ
