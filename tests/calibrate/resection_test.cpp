// SPDX-License-Identifier: Apache-2.0
// Start values: resection with gross errors for any camera model, both poses of a tag, the focal
// length from planes.
#include "libocc/calibrate/resection.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/camera/rotating_line.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

struct Case {
  const char* name;
  Camera camera;
};

std::vector<Case> cases() {
  return {{"pinhole", Camera::pinhole(640, 480, 520, 523, 322.3, 236.1, {-0.22, 0.08, 0, 0})},
          {"fisheye", Camera::fisheye(1000, 1000, 330, 331, 500.4, 497.9, {0.03, -0.005})},
          {"double_sphere", Camera::double_sphere(752, 480, 350, 352, 366, 249, -0.2, 0.6)},
          {"line", Camera::rotating_line(small_line())}};
}

class Resecting : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Cameras, Resecting, ::testing::ValuesIn(cases()),
                         [](const auto& info) { return info.param.name; });

// Points 2 to 6 m along the rays of random pixels.
struct Seen {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd px;
};
Seen random_points(const Camera& camera, const Rigid3& pose, int count, Random& random,
                   double nearest_m = 2) {
  Seen seen{Eigen::Matrix3Xd(3, count), Eigen::Matrix2Xd(2, count)};
  for (int i = 0; i < count;) {
    const Eigen::Vector2d px(random.uniform(0, camera.width() - 1),
                             random.uniform(0, camera.height() - 1));
    const auto ray = camera.ray(px);
    if (!ray) continue;
    seen.points.col(i) =
        pose.inverse() *
        Eigen::Vector3d(ray->origin + random.uniform(1, 3) * nearest_m * ray->direction);
    seen.px.col(i++) = px;
  }
  return seen;
}

TEST_P(Resecting, ExactPointsGiveThePoseExactly) {
  Random random(3);
  for (int t = 0; t < 10; ++t) {
    const Rigid3 pose = random_pose(random);
    const Seen seen = random_points(GetParam().camera, pose, 12, random);
    const Result<Resection> found = resect(seen.points, seen.px, GetParam().camera);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_LT(difference(found->cam_from_world, pose).norm(), 1e-7);
  }
}

TEST_P(Resecting, AThirdOfGrossErrorsDoesNotBendIt) {
  Random random(4);
  const Camera& camera = GetParam().camera;
  for (int t = 0; t < 10; ++t) {
    const Rigid3 pose = random_pose(random);
    Seen seen = random_points(camera, pose, 30, random);
    for (int i = 0; i < 30; ++i)
      seen.px.col(i) += 0.3 * Eigen::Vector2d(random.normal(), random.normal());
    for (int i = 0; i < 10; ++i)
      seen.px.col(i) += Eigen::Vector2d(random.uniform(40, 90), random.uniform(-60, 60));
    const Result<Resection> found = resect(seen.points, seen.px, camera);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_LT(difference(found->cam_from_world, pose).norm(), 0.02);
    EXPECT_LT(found->sigma_px, 1);
    for (std::size_t i = 0; i < 10; ++i) EXPECT_FALSE(found->inliers[i]) << i;
    EXPECT_GT(std::count(found->inliers.begin(), found->inliers.end(), true), 17);
  }
}

// Eccentricity of half a metre, and gross errors in 40 % of the points.
TEST(Resection, EccentricityMayBeLarge) {
  RotatingLine line = small_line();
  line.eccentricity_m = {0.4, -0.3, 0.1};
  const Camera camera = Camera::rotating_line(line);
  Random random(9);
  for (int t = 0; t < 20; ++t) {
    const Rigid3 pose = random_pose(random);
    Seen seen = random_points(camera, pose, 30, random, 0.7);
    for (int i = 0; i < 12; ++i)
      seen.px.col(i) = Eigen::Vector2d(random.uniform(0, 2900), random.uniform(0, 900));
    const Result<Resection> found = resect(seen.points, seen.px, camera);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_LT(difference(found->cam_from_world, pose).norm(), 1e-6);
  }
}

// A badly calibrated camera: a focal length error of 10 %, and distortion neglected.
TEST(Resection, TheCameraNeedsNoCalibration) {
  Random random(5);
  const Camera truth = Camera::pinhole(640, 480, 520, 523, 322.3, 236.1, {-0.22, 0.08, 0, 0});
  const Camera about = Camera::pinhole(640, 480, 570, 570, 319.5, 239.5);
  const Rigid3 pose = random_pose(random);
  const Seen seen = random_points(truth, pose, 40, random);
  const Result<Resection> found = resect(seen.points, seen.px, about);
  ASSERT_TRUE(found.ok()) << found.message;
  const Vector6 off = difference(found->cam_from_world, pose);
  EXPECT_LT(off.head<3>().norm(), 0.05);
  EXPECT_LT(off.tail<3>().norm(), 0.6);
}

TEST(Resection, FourPointsInAPlaneHaveTwoPosesFromFar) {
  const Camera camera = Camera::pinhole(640, 480, 520, 520, 319.5, 239.5);
  const Rigid3 cam_from_tag = Rigid3{so3_exp({3.14159, 0, 0}), {0.1, 0.05, 2.5}} *
                              Rigid3{so3_exp({0.5, 0.3, 0}), {0, 0, 0}};
  AprilTag tag;
  for (std::size_t k = 0; k < 4; ++k)
    tag.corners_px[k] = *camera.project(
        cam_from_tag * Eigen::Vector3d(tag_corners(0.1).col(static_cast<Eigen::Index>(k))));
  const std::vector<TagPoseHypothesis> hypotheses = tag_pose_hypotheses(tag, 0.1, camera);
  ASSERT_EQ(hypotheses.size(), 2u);
  EXPECT_LT(difference(hypotheses[0].cam_from_tag, cam_from_tag).norm(), 1e-6);
  EXPECT_LT(hypotheses[0].rms_px, 1e-6);
  EXPECT_GT(hypotheses[1].rms_px, 0.01);
  EXPECT_LT(hypotheses[1].rms_px, 2);
}

TEST(Resection, RotationsAreOrthonormal) {
  // Wrong positions: triples that no pose fits, whose solutions are ill-conditioned.
  const Camera camera = cases()[0].camera;
  Random random(12);
  for (int t = 0; t < 3000; ++t) {
    const Rigid3 pose = random_pose(random);
    Seen seen = random_points(camera, pose, 4 + t % 3, random);
    for (Eigen::Index k = 0; k < seen.points.size(); ++k)
      seen.points.data()[k] += random.uniform(-0.4, 0.4);
    const auto found = resect(seen.points, seen.px, camera);
    if (!found.ok()) continue;
    const Eigen::Matrix3d& r = found->cam_from_world.rotation;
    ASSERT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12) << t;
    for (const Rigid3& other : found->alternatives)
      ASSERT_NEAR(other.rotation.determinant(), 1, 1e-12) << t;
  }
}

TEST(Resection, ReportsMissingData) {
  const Camera camera = vga_camera();
  Random random(6);
  Seen seen = random_points(camera, {}, 3, random);
  EXPECT_EQ(resect(seen.points, seen.px, camera).status, Status::too_few_lamps);
  seen = random_points(camera, {}, 8, random);
  const Eigen::Vector3d along(0.1, 0.05, 0.02), from(0, 0, 3);
  for (int i = 0; i < 8; ++i) {
    seen.points.col(i) = from + i * along;
    seen.px.col(i) = *camera.project(seen.points.col(i));
  }
  EXPECT_EQ(resect(seen.points, seen.px, camera).status, Status::degenerate);
  seen = random_points(camera, {}, 30, random);
  for (int i = 0; i < 30; ++i)
    seen.px.col(i) = Eigen::Vector2d(random.uniform(0, 639), random.uniform(0, 479));
  const Result<Resection> none = resect(seen.points, seen.px, camera);
  EXPECT_FALSE(none.ok() && none->sigma_px < 30) << none->sigma_px;
  seen.px.conservativeResize(2, 29);
  EXPECT_NE(complaint([&] { resect(seen.points, seen.px, camera); }).find("points_px"),
            std::string::npos);
}

TEST(StartPinhole, FocalLengthFromTags) {
  const Camera truth = Camera::pinhole(640, 480, 560, 560, 325, 236, {-0.15, 0.05, 0, 0});
  std::vector<PlaneView> views;
  Random random(8);
  for (int i = 0; i < 8; ++i) {
    const TargetRenderer renderer(
        tags_on_a_wall(4, 3), truth,
        towards_wall(
            {random.uniform(-1.2, 1.2), random.uniform(-1.6, -1.1), random.uniform(-0.8, 0.8)}));
    for (const TagTruth& tag : renderer.truth().tags) {
      if (!tag.whole) continue;
      AprilTag seen;
      seen.corners_px = tag.corners_px;
      for (Eigen::Vector2d& corner : seen.corners_px)
        corner += 0.05 * Eigen::Vector2d(random.normal(), random.normal());
      views.push_back(plane_view(seen));
    }
  }
  EXPECT_GT(views.size(), 50u);
  const Result<Camera> start = start_pinhole(views, 640, 480);
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_NEAR(start->fx_px(), 560, 80);
  EXPECT_EQ(start->cx_px(), 319.5);
}

// Tags seen from several sides, some with the wrong id.
std::vector<PlaneView> tag_views(const Camera& camera, double distance_m, double sigma_px) {
  std::vector<PlaneView> views;
  Random random(8);
  for (int i = 0; i < 8; ++i) {
    const TargetRenderer renderer(
        tags_on_a_wall(4, 3), camera,
        towards_wall({random.uniform(-0.9, 0.9), -distance_m, random.uniform(-0.8, 0.8)}));
    for (const TagTruth& tag : renderer.truth().tags) {
      if (!tag.whole) continue;
      AprilTag seen;
      seen.corners_px = tag.corners_px;
      for (Eigen::Vector2d& corner : seen.corners_px)
        corner += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
      if (views.size() % 10 == 9) seen.corners_px[2].x() += 20;
      views.push_back(plane_view(seen));
    }
  }
  return views;
}

TEST(StartFocalLength, OfAFisheyeAndAPinhole) {
  const Camera fisheye = Camera::fisheye(1000, 1000, 380, 381, 506, 495, {0.03, -0.005});
  const auto views = tag_views(fisheye, 0.9, 0.05);
  EXPECT_GT(views.size(), 50u);
  for (const double guess : {200.0, 300.0, 600.0}) {
    const Result<Camera> start =
        start_focal_length(views, Camera::fisheye(1000, 1000, guess, guess, 499.5, 499.5));
    ASSERT_TRUE(start.ok()) << start.message;
    EXPECT_NEAR(start->fx_px(), 380, 40) << guess;
  }
  const Camera pinhole = Camera::pinhole(640, 480, 560, 560, 325, 236, {-0.15, 0.05, 0, 0});
  const Result<Camera> start = start_focal_length(
      tag_views(pinhole, 1.3, 0.05), Camera::pinhole(640, 480, 1000, 1000, 319.5, 239.5));
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_NEAR(start->fx_px(), 560, 80);
  EXPECT_EQ(start_focal_length({}, pinhole).status, Status::too_few_lamps);
  EXPECT_NE(complaint([] {
              start_focal_length({}, Camera::rotating_line(small_line()));
            }).find("focal lengths"),
            std::string::npos);
}

TEST(StartPinhole, PlanesParallelToTheImageAreDegenerate) {
  PlaneView view;
  view.plane = tag_corners(1).topRows<2>();
  view.px = 100 * view.plane;
  view.px.colwise() += Eigen::Vector2d(300, 200);
  const Result<Camera> start = start_pinhole({view, view}, 640, 480);
  EXPECT_EQ(start.status, Status::degenerate);
  EXPECT_GT(start->fx_px(), 300);
  EXPECT_EQ(start_pinhole({}, 640, 480).status, Status::too_few_lamps);
  EXPECT_EQ(start_focal_length({view, view}, *start).status, Status::degenerate);
}

}  // namespace
}  // namespace occ::test
