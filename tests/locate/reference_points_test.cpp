// SPDX-License-Identifier: Apache-2.0
// Results of poses from point correspondences, of headlights and of tags, compared with those of an
// earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/locate/headlights.hpp"
#include "libocc/locate/internal/agreement.hpp"
#include "libocc/locate/internal/best_candidate.hpp"
#include "libocc/locate/internal/curved_covariance.hpp"
#include "libocc/locate/internal/point_problem.hpp"
#include "libocc/locate/robust_pose.hpp"
#include "libocc/locate/tags.hpp"
#include "tests/locate/reference_support.hpp"
#include "tests/locate/solve_pose_support.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

using namespace internal::locate;

/// Random points, planes, squares, rows with a point beside them, and long grids.
SeenScene varied_points(Random& random, int i) {
  const Camera camera = i % 3 == 1 ? bent_camera() : plain_camera();
  if (i % 7 == 2) return square_scene(random, 0.4, 0.05, 0.6);
  SeenScene scene = random_scene(random, i % 11 == 5 ? 40 : 3 + i % 9, i % 2 == 0, camera, 2.5,
                                 i % 5 == 3 ? 60 : 6);
  if (i % 13 == 6) {
    const double height =
        std::array<double, 4>{0.3, 0.03, 0.003, 0}[static_cast<std::size_t>(i / 13 % 4)];
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      scene.points.col(k) = Eigen::Vector3d(0.3 * static_cast<double>(k), k == 1 ? height : 0, 0.1);
    see(scene);
  }
  return scene;
}

bool are_in_domain(const Eigen::Matrix2Xd& pixels, const Camera& camera) {
  for (Eigen::Index k = 0; k < pixels.cols(); ++k)
    if (!camera.unproject(pixels.col(k))) return false;
  return true;
}

TEST(References, PosesOfPoints) {
  References references("locate/points");
  for (int i = 0; i < 450; ++i) {
    Random random(601, static_cast<std::uint64_t>(i));
    const SeenScene scene = varied_points(random, i);
    const double sigma_px =
        std::array<double, 5>{1e-3, 0.1, 1, 4, 20}[static_cast<std::size_t>(i / 2 % 5)];
    Eigen::Matrix2Xd pixels = noisy_pixels(scene, sigma_px, random);
    if (i % 9 == 4) pixels.col(0).x() += 12 * sigma_px;
    if (!are_in_domain(pixels, scene.camera)) continue;
    SolvePoseOptions options;
    options.sigma_px = i % 8 == 3 ? 0.5 * sigma_px : sigma_px;
    if (i % 10 == 7)
      for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
        options.sigmas_px.push_back(sigma_px * random.uniform(0.5, 2));
    if (i % 6 == 1) options.max_risk = 0.05;
    if (i % 12 == 9) options.max_misfit = 2;
    if (i % 14 == 8) options.start = scene.truth;
    if (i % 15 == 11) options.max_iterations = 2;
    if (i % 16 == 13) options.solver = "dlt";
    const Result<Fix> found = solve_pose(scene.points, pixels, scene.camera, options);
    CaseResults results;
    add_status(results, found);
    add_fix(results, found.value, found.status != Status::degenerate);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PosesAmongWrongCorrespondences) {
  References references("locate/wrong_correspondences");
  for (int i = 0; i < 300; ++i) {
    Random random(602, static_cast<std::uint64_t>(i));
    const int count = std::array<int, 6>{4, 7, 12, 20, 40, 90}[static_cast<std::size_t>(i % 6)];
    SeenScene scene = random_scene(random, count, i % 4 == 0, plain_camera());
    const double sigma_px = i % 3 ? 0.5 : 2;
    Eigen::Matrix2Xd pixels = noisy_pixels(scene, sigma_px, random);
    const double ratio =
        std::array<double, 5>{0, 0.2, 0.4, 0.5, 1}[static_cast<std::size_t>(i / 6 % 5)];
    const int wrong = static_cast<int>(ratio * count);
    if (i % 7 == 3) {  // a part of the points moved
      SeenScene moved = scene;
      moved.truth.translation += Eigen::Vector3d(0.3, -0.2, 0.4);
      see(moved);
      pixels.leftCols(wrong) = moved.pixels.leftCols(wrong);
    } else {
      for (int k = 0; k < wrong; ++k)
        pixels.col(k) << random.uniform(0, 1279), random.uniform(0, 959);
    }
    if (i % 11 == 6)
      for (int k = wrong; k + 2 < count; ++k) scene.points.col(k) = Eigen::Vector3d(0.05 * k, 0, 0);
    RobustPoseOptions options;
    options.sigma_px = sigma_px;
    options.seed = static_cast<std::uint64_t>(i);
    options.max_iterations = i % 5 == 4 ? 20 : 2000;
    if (i % 4 == 1) options.up_in_cam = scene.truth.rotation.col(2);
    if (i % 16 == 5)
      options.up_in_cam = (so3_exp({0.08, 0, 0}) * scene.truth.rotation.col(2)).normalized();
    if (i % 8 == 2) options.gate_sigmas = 2.5;
    if (i % 9 == 7) options.max_false_alarms = 10;
    if (i % 10 == 3) options.confidence = 0.5;
    const Result<RobustPose> found = robust_pose(scene.points, pixels, scene.camera, options);
    CaseResults results;
    add_status(results, found);
    results.add("ratio", found->inlier_ratio);
    results.add("iterations", found->iterations);
    results.add("log10_nfa", found->log10_false_alarms);
    const bool is_whole = found.status != Status::degenerate && found.status != Status::no_pose;
    add_fix(results, found->fix, is_whole);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, DistancesOfHeadlights) {
  References references("locate/headlights");
  const Camera camera = Camera::pinhole(1280, 960, 1200, 1200, 639.5, 479.5);
  for (int i = 0; i < 300; ++i) {
    Random random(603, static_cast<std::uint64_t>(i));
    const double distance =
        std::array<double, 5>{4, 12, 40, 120, 700}[static_cast<std::size_t>(i % 5)];
    const double yaw = random.uniform(-0.6, 0.6), side = random.uniform(-0.3, 0.3) * distance;
    const Eigen::Vector3d middle(side, i % 3 ? 0.55 : 0, distance);
    const Eigen::Vector3d half(0.7 * std::cos(yaw), 0, -0.7 * std::sin(yaw));
    Eigen::Matrix2d pixels;
    for (int k = 0; k < 2; ++k)
      pixels.col(k) = *camera.project(middle + (k ? half : Eigen::Vector3d(-half))) +
                      0.5 * Eigen::Vector2d(random.normal(), random.normal());
    HeadlightOptions options;
    options.sigma_px = i % 4 == 2 ? 0.1 : 0.5;
    options.yaw_max_rad =
        std::array<double, 4>{0.5, 1e-4, 0.1, 1.2}[static_cast<std::size_t>(i % 4)];
    if (i % 6 == 1) options.yaw_concentration = 8;
    if (i % 7 == 3) options.separation_m = 1.2, options.separation_sigma_m = 0.02;
    if (i % 2) {
      options.heights.emplace();
      if (i % 8 == 5) options.heights->camera_m = 0.66;
      if (i % 10 == 9) options.heights->lamps_m = 1.6, options.heights->up_sigma_rad = 1e-3;
      if (i % 12 == 7)
        options.heights->up_in_cam = so3_exp({0.02, 0, 0.05}) * -Eigen::Vector3d::UnitY();
    }
    const auto found = headlight_distance(pixels, camera, options);
    CaseResults results;
    add_status(results, found);
    for (const double value :
         {found->distance_m, found->sigma_m, found->low_m, found->high_m, found->bearing_rad,
          found->separation_rad, found->separation_sigma_rad})
      results.add("is", value);
    results.summarise("yaw", found->yaw_rad);
    results.summarise("distances", found->distance_of_yaw_m);
    results.summarise("density", found->yaw_density);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, PosesOfVehicles) {
  References references("locate/vehicles");
  const Camera camera = Camera::pinhole(1280, 960, 1200, 1200, 639.5, 479.5);
  for (int i = 0; i < 200; ++i) {
    Random random(604, static_cast<std::uint64_t>(i));
    Eigen::Matrix3Xd lamps(3, 3 + i % 4);
    for (Eigen::Index k = 0; k < lamps.cols(); ++k)
      lamps.col(k) << random.uniform(-0.3, 2), (k % 2 ? 0.7 : -0.7), random.uniform(0.4, 1.5);
    // The vehicle's x axis points to the camera, its z axis up (the camera's -y).
    Eigen::Matrix3d base;
    base << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    const Rigid3 pose{base * so3_exp({0, i % 5 == 4 ? 0.5 : 0.02, random.uniform(-1.5, 1.5)}),
                      {random.uniform(-2, 2), 0.5, std::exp(random.uniform(1.5, 4))}};
    Eigen::Matrix2Xd pixels(2, lamps.cols());
    for (Eigen::Index k = 0; k < lamps.cols(); ++k)
      pixels.col(k) = *camera.project(pose * Eigen::Vector3d(lamps.col(k))) +
                      0.3 * Eigen::Vector2d(random.normal(), random.normal());
    const auto found = vehicle_poses(lamps, pixels, camera, 0.3, -Eigen::Vector3d::UnitY(),
                                     i % 3 == 1 ? 0.1 : 0.3);
    CaseResults results;
    add_status(results, found);
    for (const VehiclePose& vehicle : *found) {
      for (const double value :
           {vehicle.distance_m, vehicle.sigma_m, vehicle.yaw_rad, vehicle.yaw_sigma_rad})
        results.add("is", value);
      std::vector<double> numbers;
      append(numbers, vehicle.pose.cam_from_world);
      append(numbers, vehicle.pose.covariance);
      results.summarise("pose", numbers);
    }
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

AprilTag seen_tag(const Tag& tag, const Camera& camera, const Rigid3& pose, double sigma_px,
                  Random& random) {
  AprilTag seen;
  seen.id = tag.id;
  seen.family = tag.family;
  const Eigen::Vector3d x = 0.5 * tag.size_m * tag.x_axis;
  const Eigen::Vector3d y = 0.5 * tag.size_m * tag.normal.cross(tag.x_axis);
  const std::array<Eigen::Vector3d, 4> corners{-x - y, x - y, x + y, -x + y};
  for (std::size_t k = 0; k < 4; ++k) {
    seen.corners_px[k] =
        camera.project(pose * (tag.centre_m + corners[k])).value_or(Eigen::Vector2d(20, 30)) +
        sigma_px * Eigen::Vector2d(random.normal(), random.normal());
    seen.covariance_px2[k] = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  }
  return seen;
}

TEST(References, PosesOfTags) {
  References references("locate/tags");
  for (int i = 0; i < 240; ++i) {
    Random random(605, static_cast<std::uint64_t>(i));
    Scene scene = irregular_room();
    const TargetField field = tags_on_a_wall(3, 2);
    scene.camera = Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5);
    scene.lamps.clear();
    for (int k = 0; k < 5; ++k) {
      Lamp lamp = disc_lamp(50 + k, {-0.6 + 0.3 * k, k % 2 ? 0.0 : -0.1, k % 3 ? 0.5 : -0.5}, 0.06);
      lamp.normal = {0, -1, 0};
      lamp.x_axis = {1, 0, 0};
      scene.lamps.push_back(lamp);
    }
    scene.tags = field.tags;
    const double away = std::array<double, 4>{0.9, 1.5, 4, 15}[static_cast<std::size_t>(i % 4)];
    const Rigid3 pose = towards_wall({random.uniform(-0.3, 0.3), -away, random.uniform(-0.3, 0.3)},
                                     random.uniform(-1, 1));
    const double sigma_px = i % 3 ? 0.2 : 1;
    std::vector<AprilTag> tags;
    for (int k = 0; k < i % 6; ++k)
      tags.push_back(
          seen_tag(field.tags[static_cast<std::size_t>(k)], scene.camera, pose, sigma_px, random));
    if (i % 9 == 8 && !tags.empty()) tags.push_back(tags.front());
    if (i % 10 == 6 && !tags.empty()) tags.back().id = 77;
    Measurement measurement;
    measurement.rim_points = i % 4 == 1 ? 12 : 0;
    std::map<int, Blob> lamps;
    const std::vector<Blob> blobs =
        noisy(exact_blobs(scene, pose, measurement), scene, measurement, random);
    for (int k = 0; k < (i % 3 == 2 ? 5 : i % 2); ++k) {
      lamps[50 + k] = blobs[static_cast<std::size_t>(k)];
      lamps[50 + k].cut_by_border = k == 2 && i % 5 == 0;
    }
    const Result<Fix> found = locate_by_tags(tags, scene, lamps);
    CaseResults results;
    add_status(results, found);
    add_fix(results, found.value);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// The fits start from the poses of IPPE, if OpenCV is in the build.
TEST(References, PosesOfOneTag) {
  if (!in_build("ippe")) GTEST_SKIP() << "the build has no IPPE";
  References references("locate/one_tag");
  for (int i = 0; i < 60; ++i) {
    Random random(608, static_cast<std::uint64_t>(i));
    const Camera camera = Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5);
    const Tag tag = tags_on_a_wall(1, 1).tags.front();
    const double away = std::array<double, 4>{0.5, 1.5, 5, 20}[static_cast<std::size_t>(i % 4)];
    const Rigid3 pose =
        towards_wall({random.uniform(-0.5, 0.5), -away, random.uniform(-0.3, 0.3)}, 0.02 * i);
    const AprilTag seen = seen_tag(tag, camera, pose, i % 3 ? 0.2 : 1, random);
    std::vector<double> numbers, fits;
    for (const Candidate& c : tag_poses(seen, tag.size_m, camera)) {
      append(numbers, c.cam_from_world);
      for (const double value : {c.rms_px, c.chi2, 1.0 * c.dof}) fits.push_back(value);
    }
    CaseResults results;
    results.summarise("poses", numbers);
    results.summarise("fits", fits);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, SignificanceOfInliers) {
  References references("locate/significance");
  for (int i = 0; i < 200; ++i) {
    Random random(606, static_cast<std::uint64_t>(i));
    const int count = 6 + 3 * (i % 15);
    Eigen::Matrix2Xd pixels(2, count);
    Eigen::Matrix3Xd points(3, count);
    std::vector<Agreement> inliers;
    std::vector<int> on_line;
    for (int k = 0; k < count; ++k) {
      const double spread = i % 4 == 1 ? 30 : 600;
      pixels.col(k) << random.uniform(0, spread), random.uniform(0, i % 5 == 2 ? 3 : spread);
      if (k % 3) inliers.push_back({k, random.uniform(0, k % 4 ? 2 : 9)});
      if (k % 2) on_line.push_back(k);
      points.col(k) = Eigen::Vector3d(random.normal(), 0, 0) +
                      (k % 7 < i % 4 ? 0.3 : 1e-4) * random_vector(random);
    }
    const int sample = i % 2 ? 3 : 2;
    const Significance found = significance(pixels, inliers, 0.7, sample, 4);
    const auto chance = chance_anywhere(pixels, 3, sample, 4);
    CaseResults results;
    results.add("log_nfa", found.log_false_alarms);
    results.add("radius", found.radius_px);
    results.add("probability", chance.probability);
    results.add("line", rests_on_a_line(points, on_line, i % 3 ? 300 : 50, chance, 1e-3));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, CovariancesOfCurvedFits) {
  References references("locate/curved");
  for (int i = 0; i < 300; ++i) {
    Random random(607, static_cast<std::uint64_t>(i));
    const bool is_near = i % 6 == 5;
    SeenScene scene = random_scene(random, 3 + i % 4, i % 3 != 2, plain_camera(), is_near ? 1.2 : 3,
                                   is_near ? 1.6 : 30);
    if (i % 5 == 4) {
      for (Eigen::Index k = 0; k < scene.points.cols(); ++k) scene.points.col(k).tail<2>() *= 0.05;
      see(scene);
    }
    const double sigma_px = std::array<double, 4>{0.1, 1, 3, 10}[static_cast<std::size_t>(i % 4)];
    const PointProblem problem =
        make_point_problem(scene.points, noisy_pixels(scene, 0.3 * sigma_px, random), scene.camera,
                           Eigen::VectorXd::Constant(1, sigma_px));
    const auto fit =
        internal::pose::fit_points(problem.seen, problem.frame.normalised(scene.truth), 200, 1e-6);
    if (!fit.converged) continue;
    CaseResults results;
    const Matrix6 covariance = left_covariance(problem.seen, fit, i % 2 ? 1 : 2.5);
    const double turn = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
    if (turn < 2) {
      std::vector<double> numbers;
      append(numbers, covariance);
      results.summarise("covariance", numbers);
    }
    for (const double variance : {0.001, 0.01, 0.1})
      results.add("curved", is_curved(fit, variance));
    results.add("flat", is_flat(problem.seen, fit, i % 2 ? 1 : 2.5));
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
