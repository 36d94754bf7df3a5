// SPDX-License-Identifier: Apache-2.0
// AprilTags: corners of rendered tags are accurate to hundredths of a pixel in the convention of
// the library, and give the pose from which the tags were rendered.
#include "libocc/landmarks/april_tags.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/camera/camera.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/locate/tags.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/scene/tag.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

struct Hung {
  Tag tag;
  bool standard = false;
};

// Small images, for fast rendering.
Camera small_camera() { return Camera::pinhole(220, 180, 220, 220, 109.5, 89.5); }

Image rendered(const std::vector<Hung>& tags, const Rigid3& cam_from_world, const Camera& camera,
               double noise_dn, Random& random) {
  TargetField field;
  for (const Hung& hung : tags) field.tags.push_back(hung.tag);
  TargetImageOptions options;
  options.noise_dn = noise_dn;
  options.seed = random.bits();
  return render_targets(field, camera, cam_from_world, options);
}

Hung wall_tag(int id, const Eigen::Vector3d& centre_m, double size_m, bool standard = false) {
  Hung hung;
  hung.standard = standard;
  hung.tag.id = id;
  hung.tag.family = standard ? "tagStandard41h12" : "tag36h11";
  hung.tag.size_m = size_m;
  hung.tag.centre_m = centre_m;
  hung.tag.normal = -Eigen::Vector3d::UnitY();
  hung.tag.validate();
  return hung;
}

Rigid3 towards_wall(const Eigen::Vector3d& position) {
  return look_at(position, {0.05, 3, 1.5}, Eigen::Vector3d::UnitZ());
}

std::array<Eigen::Vector2d, 4> true_corners(const Tag& tag, const Rigid3& pose,
                                            const Camera& camera) {
  std::array<Eigen::Vector2d, 4> px;
  const Rigid3 cam_from_tag = pose * tag.world_from_tag();
  for (int k = 0; k < 4; ++k)
    px[k] = *camera.project(cam_from_tag * Eigen::Vector3d(tag_corners(tag.size_m).col(k)));
  return px;
}

struct Errors {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double rms = 0, normalised = 0;
  int corners = 0;
};

Errors corner_errors(const AprilTagOptions& options, double noise_dn, bool standard = false) {
  Errors e;
  Random random(17);
  for (int t = 0; t < 6; ++t) {
    const Hung hung = wall_tag(t, {0.05, 3, 1.5}, standard ? 0.2 : 0.35, standard);
    const Rigid3 pose =
        towards_wall({random.uniform(-1.2, 1.2), random.uniform(1.8, 2.2), random.uniform(1, 2)});
    const Image image = rendered({hung}, pose, small_camera(), noise_dn, random);
    const std::vector<AprilTag> tags = detect_april_tags(image.view(), options);
    EXPECT_EQ(tags.size(), 1u);
    if (tags.size() != 1) continue;
    EXPECT_EQ(tags[0].id, t);
    EXPECT_EQ(tags[0].refined, options.refine);
    const auto truth = true_corners(hung.tag, pose, small_camera());
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d error = tags[0].corners_px[k] - truth[k];
      e.mean += error;
      e.rms += error.squaredNorm();
      e.normalised += error.dot(tags[0].covariance_px2[k].inverse() * error);
      ++e.corners;
    }
  }
  e.mean /= e.corners;
  e.rms = std::sqrt(e.rms / (2 * e.corners));
  e.normalised /= 2 * e.corners;
  return e;
}

// A shift by half a pixel (the other convention) would fail.
TEST(AprilTags, CornersAgreeWithTheRenderedOnes) {
  const Errors e = corner_errors({}, 2);
  EXPECT_LT(e.mean.cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT(e.rms, 0.05);
  EXPECT_GT(e.normalised, 0.3);
  EXPECT_LT(e.normalised, 2);
}

TEST(AprilTags, UnrefinedCornersAreUnbiased) {
  AprilTagOptions options;
  options.refine = false;
  options.family = "tag36h11";
  const Errors e = corner_errors(options, 2);
  EXPECT_LT(e.mean.cwiseAbs().maxCoeff(), 0.05);
  EXPECT_LT(e.rms, 0.3);
}

TEST(AprilTags, OtherFamiliesAndSmallerImagesAreRead) {
  AprilTagOptions options;
  options.family = "tagStandard41h12";
  EXPECT_LT(corner_errors(options, 2, true).rms, 0.08);
  options = {};
  options.decimate = 2;
  EXPECT_LT(corner_errors(options, 2).rms, 0.05);
}

Scene wall_of_tags() {
  Scene scene;
  scene.camera = small_camera();
  scene.tags = {wall_tag(3, {-0.25, 3, 1.5}, 0.3).tag, wall_tag(4, {0.35, 3, 1.6}, 0.3).tag};
  scene.lamps = {disc_lamp(0, {-0.4, 3, 2}), disc_lamp(1, {0.5, 3, 2})};
  scene.validate();
  return scene;
}

std::vector<AprilTag> seen_tags(const Scene& scene, const Rigid3& pose, Random& random) {
  std::vector<Hung> hung;
  for (const Tag& tag : scene.tags) hung.push_back({tag, false});
  return detect_april_tags(rendered(hung, pose, scene.camera, 2, random).view());
}

double mahalanobis2(const Fix& fix, const Rigid3& truth) {
  const Vector6 error = difference(fix.cam_from_world, truth);
  return test::nees(error, fix.covariance);
}

constexpr double chi2_6_999 = 22.5;

TEST(AprilTags, TwoOfAMapGiveThePose) {
  const Scene scene = wall_of_tags();
  const Rigid3 truth = towards_wall({0.6, 1.6, 1.2});
  Random random(18);
  const std::vector<AprilTag> tags = seen_tags(scene, truth, random);
  ASSERT_EQ(tags.size(), 2u);
  const Result<Fix> fix = locate_by_tags(tags, scene);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT((fix->position_m - truth.origin_in_source()).norm(), 0.02);
  EXPECT_LT(mahalanobis2(*fix, truth), chi2_6_999);
}

TEST(AprilTags, LampsBesideThemImproveThePose) {
  const Scene scene = wall_of_tags();
  const Rigid3 truth = towards_wall({0.6, 1.6, 1.2});
  Random random(19);
  std::vector<AprilTag> tags = seen_tags(scene, truth, random);
  tags.resize(1);
  std::map<int, Blob> lamps;
  for (const Lamp& lamp : scene.lamps) {
    lamps[lamp.id].centroid_px = project_lamp_centre(lamp, truth, scene.camera).value();
    lamps[lamp.id].covariance_px2 = 4e-4 * Eigen::Matrix2d::Identity();
  }
  const Result<Fix> alone = locate_by_tags(tags, scene), both = locate_by_tags(tags, scene, lamps);
  ASSERT_TRUE(both.ok()) << both.message;
  EXPECT_LT(mahalanobis2(*both, truth), chi2_6_999);
  EXPECT_LT(both->position_covariance_m2.trace(), 0.5 * alone->position_covariance_m2.trace());
  EXPECT_EQ(both->lamps.size(), 2u);
  lamps[9] = Blob();
  EXPECT_NE(complaint([&] { locate_by_tags(tags, scene, lamps); }).find("9"), std::string::npos);
}

TEST(AprilTags, DuplicatesAreIgnored) {
  const Scene scene = wall_of_tags();
  const Rigid3 truth = towards_wall({0.6, 1.6, 1.2});
  Random random(18);
  std::vector<AprilTag> tags = seen_tags(scene, truth, random);
  tags.push_back(tags[0]);
  for (Eigen::Vector2d& corner : tags[2].corners_px) corner.x() += 150;
  const Result<Fix> fix = locate_by_tags(tags, scene);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(mahalanobis2(*fix, truth), chi2_6_999);
  EXPECT_EQ(locate_by_tags({tags[0], tags[2]}, scene).status, Status::too_few_lamps);
}

TEST(AprilTags, TagsInTheDarkAreDetected) {
  // 10 grey levels between print and paper; a decision margin of 20 is out of reach.
  TargetField field;
  for (int id = 0; id < 4; ++id)
    field.tags.push_back(wall_tag(id, {0.3 * (id % 2) - 0.1, 3, 1.3 + 0.3 * (id / 2)}, 0.2).tag);
  TargetImageOptions options;
  options.black_dn = 4;
  options.white_dn = 14;
  options.ground_dn = 9;
  options.noise_dn = 0.7;
  const Image image =
      render_targets(field, small_camera(), towards_wall({0.05, 1.9, 1.5}), options);
  EXPECT_EQ(detect_april_tags(image.view()).size(), 4U);
  // A family with few bits keeps its limit: random bits are often read as its tags.
  for (Tag& tag : field.tags) tag.family = "tag16h5";
  AprilTagOptions few;
  few.family = "tag16h5";
  const Image other =
      render_targets(field, small_camera(), towards_wall({0.05, 1.9, 1.5}), options);
  EXPECT_TRUE(detect_april_tags(other.view(), few).empty());
}

TEST(AprilTags, UnknownTagsGiveNoPose) {
  Scene scene = wall_of_tags();
  Random random(20);
  const std::vector<AprilTag> tags = seen_tags(scene, towards_wall({0.3, 1.6, 1.4}), random);
  scene.tags[0].family = "tag25h9";
  scene.tags[1].id = 77;
  const Result<Fix> fix = locate_by_tags(tags, scene);
  EXPECT_EQ(fix.status, Status::too_few_lamps);
  EXPECT_NE(fix.message.find("none of the 2 tags"), std::string::npos) << fix.message;
}

// With exact corners, both the true pose and its mirror image (opposite tilt) are minima.
TEST(AprilTags, BothPosesOfATagAreKept) {
  Random random(21);
  for (int t = 0; t < 50; ++t) {
    const Rigid3 cam_from_tag =
        Rigid3{so3_exp({3.14159, 0, 0}), {0.1, 0.05, random.uniform(1, 2)}} *
        Rigid3{so3_exp({random.uniform(0.3, 0.7), random.uniform(-0.4, 0.4), 0}), {0, 0, 0}};
    AprilTag tag;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d corner = tag_corners(0.1).col(static_cast<Eigen::Index>(k));
      tag.corners_px[k] = *small_camera().project(cam_from_tag * corner);
      tag.covariance_px2[k] = 0.01 * Eigen::Matrix2d::Identity();
    }
    const std::vector<Candidate> poses = tag_poses(tag, 0.1, small_camera());
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_LT(difference(poses[0].cam_from_world, cam_from_tag).norm(), 1e-6);
    EXPECT_LT(poses[0].chi2, 1e-6);
    EXPECT_GT(poses[1].chi2, poses[0].chi2);
    EXPECT_LT(poses[1].rms_px, 3);
    EXPECT_GT(difference(poses[1].cam_from_world, cam_from_tag).head<3>().norm(), 0.2);
  }
}

TEST(AprilTags, NoTagsInEmptyImages) {
  Random random(22);
  Image noise;
  noise.width = noise.height = 120;
  for (int i = 0; i < 120 * 120; ++i)
    noise.u8.push_back(static_cast<std::uint8_t>(random.below(256)));
  EXPECT_TRUE(detect_april_tags(noise.view()).empty());
  Image tiny;
  tiny.width = tiny.height = 3;
  tiny.u8.assign(9, 100);
  EXPECT_TRUE(detect_april_tags(tiny.view()).empty());
}

TEST(AprilTags, SixteenBitImages) {
  const Scene scene = wall_of_tags();
  Random random(23);
  const Rigid3 truth = towards_wall({0.6, 1.6, 1.2});
  Image image = rendered({{scene.tags[0], false}}, truth, scene.camera, 2, random), deep = image;
  deep.type = PixelType::u16;
  for (const std::uint8_t value : image.u8)
    deep.u16.push_back(static_cast<std::uint16_t>(16 * value));
  deep.u8.clear();
  const auto shallow_tags = detect_april_tags(image.view()),
             deep_tags = detect_april_tags(deep.view());
  ASSERT_EQ(deep_tags.size(), 1u);
  EXPECT_LT((deep_tags[0].corners_px[2] - shallow_tags.at(0).corners_px[2]).norm(), 0.01);
}

// Between stored values, the edges of dark squares are shifted by a third of a pixel.
TEST(AprilTags, CornersInColourPicturesAreFittedInLinearLight) {
  Random random(5);
  const Hung hung = wall_tag(3, {0.05, 3, 1.5}, 0.35);
  const Rigid3 pose = towards_wall({0.2, 2.1, 1.4});
  const Image grey = rendered({hung}, pose, small_camera(), 0, random);
  Sensor coded;
  coded.black_level_dn = 0;
  coded.full_well_e = 1e6;
  coded.response = Response::srgb;
  Image colour = grey;
  colour.channels = 3;
  colour.u8.clear();
  for (const std::uint8_t value : grey.u8) {
    const auto stored =
        static_cast<std::uint8_t>(std::lround(coded.grey_level(value / coded.gain_dn_per_e)));
    colour.u8.insert(colour.u8.end(), 3, stored);
  }
  const auto corners = true_corners(hung.tag, pose, small_camera());
  AprilTagOptions options;
  for (const int tile_px : {0, 240}) {
    options.tile_px = tile_px;
    options.overlap_px = 120;
    const std::vector<AprilTag> tags = detect_april_tags(colour.view(), options);
    ASSERT_EQ(tags.size(), 1u);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_LT((tags[0].corners_px[k] - corners[k]).norm(), 0.03) << k;
  }
}

TEST(AprilTags, MapsWithTagsSurviveARoundTrip) {
  const Scene scene = wall_of_tags();
  const Scene read = parse_scene(format_scene(scene));
  ASSERT_EQ(read.tags.size(), 2u);
  EXPECT_EQ(format_scene(read), format_scene(scene));
  EXPECT_EQ(read.tags[1].world_from_tag().matrix(), scene.tags[1].world_from_tag().matrix());
  const std::string head =
      "schema: libocc-scene/1\ncamera: {width_px: 64, height_px: 48, fx_px: 40}\nlamps: "
      "[]\ntags:\n";
  const auto said = [&](const std::string& tags) {
    return complaint<std::runtime_error>([&] { parse_scene(head + tags, "map"); });
  };
  EXPECT_NE(said("  - {id: 1, size_m: -1, centre_m: [0, 0, 0]}")
                .find("tags[0].size_m`: must be positive, got -1"),
            std::string::npos);
  EXPECT_NE(said("  - {id: 1, centre_m: [0, 0, 0]}").find("tags[0].size_m"), std::string::npos);
  const std::string one = "  - {id: 1, size_m: 1, centre_m: [0, 0, 0]}\n";
  EXPECT_EQ(said(one), "");
  EXPECT_NE(said(one + one).find("unique in its family"), std::string::npos);
  EXPECT_NE(said("  - {id: 1, size_m: 1, centre_m: [0, 0, 0], x_axis: [0, 0, 1]}").find("x_axis"),
            std::string::npos);
}

TEST(AprilTags, RejectInvalidArguments) {
  const Image image = [] {
    Image i;
    i.width = i.height = 20;
    i.u8.assign(400, 0);
    return i;
  }();
  AprilTagOptions options;
  options.family = "tag99";
  EXPECT_NE(complaint([&] { detect_april_tags(image.view(), options); }).find("tag36h11"),
            std::string::npos);
  options = {};
  options.max_hamming = 3;
  EXPECT_NE(complaint([&] { detect_april_tags(image.view(), options); }).find("max_hamming"),
            std::string::npos);
  EXPECT_NE(complaint([&] { tag_poses(AprilTag(), -1, small_camera()); }).find("size_m"),
            std::string::npos);
}

}  // namespace
}  // namespace occ::test
