// SPDX-License-Identifier: Apache-2.0
// Start values of networks from exact corners of tags, boards and lamps: accurate enough for the
// adjustment to reach the truth. Faulty data are reported by name.
#include "libocc/calibrate/start_network.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/calibrate/board_network.hpp"
#include "libocc/calibrate/lamp_network.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/network/adjust.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

AprilTag seen_as(const TagTruth& truth, double sigma_px, Random& random) {
  AprilTag tag;
  tag.id = truth.id;
  tag.corners_px = truth.corners_px;
  for (Eigen::Vector2d& corner : tag.corners_px)
    corner += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  tag.covariance_px2.fill(std::max(1e-4, sigma_px * sigma_px) * Eigen::Matrix2d::Identity());
  tag.centre_px =
      0.25 * (tag.corners_px[0] + tag.corners_px[1] + tag.corners_px[2] + tag.corners_px[3]);
  return tag;
}

// Exact corners, without an image.
std::vector<TagImage> seen_from(const TargetField& field, const Camera& camera,
                                const std::vector<Rigid3>& poses, double sigma_px) {
  std::vector<TagImage> images;
  Random random(11);
  for (const Rigid3& pose : poses) {
    TagImage image;
    image.name = "image " + std::to_string(images.size());
    const TargetRenderer renderer(field, camera, pose);
    for (const TagTruth& tag : renderer.truth().tags)
      if (tag.whole) image.tags.push_back(seen_as(tag, sigma_px, random));
    images.push_back(image);
  }
  return images;
}

std::vector<Rigid3> around_wall(int count) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * pi * i / count;
    poses.push_back(towards_wall(
        {1.1 * std::cos(angle), -1.5 - 0.3 * (i % 3), 0.8 * std::sin(angle)}, 0.5 * pi * (i % 4)));
  }
  return poses;
}

const Camera& pinhole() {
  static const Camera camera =
      Camera::pinhole(1000, 800, 900, 900, 503, 396, {-0.12, 0.05, 4e-4, -3e-4});
  return camera;
}

StartOptions tag_size(double size_m) {
  StartOptions options;
  options.tag_size_m = size_m;
  return options;
}

// Largest difference of the distances between corners, which is independent of the world frame.
double worst_distance_m(const Network& network, const TargetField& field) {
  std::vector<Eigen::Vector3d> truth, found;
  for (const NetworkBody& body : network.bodies)
    for (const Tag& tag : field.tags)
      if (body.name == "tag " + std::to_string(tag.id)) {
        truth.push_back(tag.centre_m);
        found.push_back(body.world_from_body.translation);
      }
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      worst =
          std::max(worst, std::abs((truth[i] - truth[j]).norm() - (found[i] - found[j]).norm()));
  return worst;
}

TEST(StartNetwork, ExactCornersGiveTheFieldExactly) {
  const TargetField field = tags_on_a_wall(4, 3);
  const std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(8), 0);
  const Result<NetworkStart> start =
      start_network({{"camera", pinhole(), {}}}, images, tag_size(0.16));
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_EQ(start->network.images.size(), 8u);
  EXPECT_EQ(start->network.bodies.size(), 12u);
  EXPECT_EQ(start->blocks.size(), 1u);
  EXPECT_TRUE(start->wrong_sizes.empty());
  EXPECT_LT(worst_distance_m(start->network, field), 1e-5);
}

TEST(StartNetwork, APanoramaOfARoom) {
  const TargetField field = tags_in_a_room();
  const Camera camera = Camera::rotating_line(small_line());
  std::vector<Rigid3> poses;
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(2, 2, 1.4), {4.2, 1.8, 1.2}, {3.8, 3.4, 1.6}, {1.9, 3.3, 1.5}})
    poses.push_back(upright_line(at, at.x(), 0.01 * at.y()));
  const Result<NetworkStart> start =
      start_network({{"camera", camera, {}}}, seen_from(field, camera, poses, 0.05), tag_size(0.3));
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_GE(start->network.bodies.size(), 20u);
  EXPECT_LT(worst_distance_m(start->network, field), 0.03);
}

// The focal length is estimated from the tags, distortion starts at zero; then all is adjusted.
TEST(StartNetwork, AnUncalibratedCameraSufficesAsStart) {
  const TargetField field = tags_on_a_wall(4, 3);
  const std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(8), 0);
  std::vector<PlaneView> views;
  for (const TagImage& image : images)
    for (const AprilTag& tag : image.tags) views.push_back(plane_view(tag));
  const Result<Camera> about = start_pinhole(views, 1000, 800);
  ASSERT_TRUE(about.ok()) << about.message;
  EXPECT_NEAR(about->fx_px(), 900, 120);
  Camera camera =
      Camera::pinhole(1000, 800, about->fx_px(), about->fx_px(), 499.5, 399.5, {0, 0, 0, 0});
  const Result<NetworkStart> start = start_network(
      {{"camera", camera, {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"}}}, images,
      tag_size(0.16));
  ASSERT_TRUE(start.ok()) << start.message;
  const Result<Adjustment> adjusted = adjust(start->network);
  ASSERT_TRUE(adjusted.ok()) << adjusted.message;
  const Camera& found = adjusted->network.cameras[0].camera;
  const std::vector<CameraParameter> truth = pinhole().parameters();
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(found.parameters()[i].value, truth[i].value, 1e-3) << truth[i].name;
  EXPECT_LT(worst_distance_m(adjusted->network, field), 1e-6);
  EXPECT_TRUE(adjusted->rejected.empty());
}

TEST(StartNetwork, TagsMayAllBeInAPlane) {
  TargetField field;
  for (int i = 0; i < 12; ++i)
    field.tags.push_back(
        field_tag(i, {0.36 * (i % 4 - 1.5), 0, 0.36 * (i / 4 - 1)}, {0, -1, 0}, 0.16));
  const std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(8), 0.05);
  const Camera about = Camera::pinhole(1000, 800, 850, 850, 499.5, 399.5, {0, 0, 0, 0});
  const Result<NetworkStart> start = start_network(
      {{"camera", about, {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"}}}, images,
      tag_size(0.16));
  ASSERT_TRUE(start.ok()) << start.message;
  const Result<Adjustment> adjusted = adjust(start->network);
  ASSERT_TRUE(adjusted.ok()) << adjusted.message;
  EXPECT_NEAR(adjusted->network.cameras[0].camera.fx_px(), 900, 1);
  EXPECT_LT(worst_distance_m(adjusted->network, field), 1e-3);
}

TEST(StartNetwork, GrossErrorsAndADuplicateId) {
  const TargetField field = tags_on_a_wall(4, 3);
  std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(8), 0.05);
  Random random(3);
  for (TagImage& image : images) {  // one tag in ten has the wrong id
    const auto i = static_cast<std::size_t>(random.below(static_cast<int>(image.tags.size())));
    const Eigen::Vector2d by(random.uniform(50, 90), random.uniform(-90, 90));
    for (Eigen::Vector2d& corner : image.tags[i].corners_px) corner += by;
  }
  images[2].tags.push_back(images[2].tags[4]);
  for (Eigen::Vector2d& corner : images[2].tags.back().corners_px) corner.x() += 100;
  images[2].tags.back().centre_px.x() += 100;
  const Result<NetworkStart> start =
      start_network({{"camera", pinhole(), {}}}, images, tag_size(0.16));
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_EQ(start->network.images.size(), 8u);
  EXPECT_LT(worst_distance_m(start->network, field), 0.02);
  const std::string name = "tag " + std::to_string(images[2].tags.back().id) + " in image 2";
  EXPECT_TRUE(std::any_of(
      start->warnings.begin(), start->warnings.end(),
      [&](const std::string& w) { return w.find(name + " left out") != std::string::npos; }));
}

TEST(StartNetwork, ATagOfAnotherSizeIsNamed) {
  TargetField field = tags_on_a_wall(4, 3);
  field.tags[5].size_m = 0.2;
  const Result<NetworkStart> start =
      start_network({{"camera", pinhole(), {}}}, seen_from(field, pinhole(), around_wall(8), 0.05),
                    tag_size(0.16));
  ASSERT_TRUE(start.ok()) << start.message;
  ASSERT_EQ(start->wrong_sizes.size(), 1u);
  EXPECT_EQ(start->wrong_sizes[0].tag, field.tags[5].id);
  EXPECT_NEAR(start->wrong_sizes[0].size_m, 0.2, 0.005);
  for (const NetworkBody& body : start->network.bodies)
    EXPECT_EQ(body.scale_free, body.name == "tag " + std::to_string(field.tags[5].id));
  StartOptions options = tag_size(0.16);
  options.other_sizes_m[field.tags[5].id] = 0.2;
  const Result<NetworkStart> corrected = start_network(
      {{"camera", pinhole(), {}}}, seen_from(field, pinhole(), around_wall(8), 0.05), options);
  EXPECT_TRUE(corrected->wrong_sizes.empty());
}

TEST(StartNetwork, ReportsBlocksWithoutCommonTags) {
  const TargetField field = tags_on_a_wall(4, 3);
  std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(5), 0.05);
  for (std::size_t i = 3; i < 5; ++i)
    for (AprilTag& tag : images[i].tags) tag.id += 100;
  const Result<NetworkStart> start =
      start_network({{"camera", pinhole(), {}}}, images, tag_size(0.16));
  EXPECT_EQ(start.status, Status::degenerate);
  ASSERT_EQ(start->blocks.size(), 2u);
  EXPECT_EQ(start->blocks[1], (std::vector<std::string>{"image 3", "image 4"}));
  EXPECT_NE(start.message.find("image 3, image 4"), std::string::npos) << start.message;
  EXPECT_EQ(start->network.images.size(), 3u);
}

TEST(StartNetwork, TooFewImagesAndTagsObservedOnce) {
  const TargetField field = tags_on_a_wall(4, 3);
  std::vector<TagImage> images = seen_from(field, pinhole(), around_wall(3), 0.05);
  const std::vector<NetworkCamera> cameras{{"camera", pinhole(), {}}};
  EXPECT_EQ(start_network(cameras, {}, tag_size(0.16)).status, Status::too_few_lamps);
  EXPECT_EQ(start_network(cameras, {images[0]}, tag_size(0.16)).status, Status::too_few_lamps);
  for (AprilTag& tag : images[1].tags) tag.id += 100;
  const Result<NetworkStart> apart = start_network(cameras, {images[0], images[1]}, tag_size(0.16));
  EXPECT_EQ(apart.status, Status::too_few_lamps);
  EXPECT_NE(apart.message.find("no two images share a tag"), std::string::npos);
  images = seen_from(field, pinhole(), around_wall(3), 0.05);
  images[1].tags[0].id = 55;
  const Result<NetworkStart> once = start_network(cameras, images, tag_size(0.16));
  ASSERT_TRUE(once.ok()) << once.message;
  ASSERT_FALSE(once->warnings.empty());
  EXPECT_NE(once->warnings.back().find("55"), std::string::npos);
  EXPECT_NE(complaint([&] { start_network(cameras, images, {}); }).find("tag_size_m"),
            std::string::npos);
  images[0].camera = 1;
  EXPECT_NE(complaint([&] { start_network(cameras, images, tag_size(1)); }).find("image 0: camera"),
            std::string::npos);
}

TEST(BoardNetwork, EachImageHasItsPose) {
  const Eigen::Matrix3Xd board = chessboard_points(9, 6, 0.03);
  std::vector<BoardImage> images;
  std::vector<Rigid3> truth;
  Random random(5);
  for (int i = 0; i < 5; ++i) {
    const Rigid3 pose{so3_exp({random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0.3 * i}),
                      {-0.1, -0.05, 0.6}};
    BoardImage image;
    image.name = "board " + std::to_string(i);
    image.px.resize(2, board.cols());
    for (Eigen::Index k = 0; k < board.cols(); ++k)
      image.px.col(k) = *pinhole().project(pose * Eigen::Vector3d(board.col(k)));
    truth.push_back(pose);
    images.push_back(image);
  }
  const Result<Camera> about = start_pinhole(board, images, 1000, 800);
  ASSERT_TRUE(about.ok()) << about.message;
  EXPECT_NEAR(about->fx_px(), 900, 60);
  const Result<NetworkStart> start = board_network({{"camera", pinhole(), {}}}, board, images);
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_TRUE(start->network.bodies[0].fixed);
  for (int i = 0; i < 5; ++i)
    EXPECT_LT(difference(start->network.cam_from_world(i), truth[i]).norm(), 1e-6);
  EXPECT_EQ(board_network({{"camera", pinhole(), {}}}, board, {images[0]}).status,
            Status::too_few_lamps);
  images[1].px.conservativeResize(2, 7);
  EXPECT_NE(complaint([&] {
              board_network({{"camera", pinhole(), {}}}, board, images);
            }).find("image board 1: px"),
            std::string::npos);
}

TEST(LampNetwork, LampsAreIntersected) {
  Scene scene = irregular_room();
  scene.camera = Camera::pinhole(640, 480, 240, 240, 319.5, 239.5);
  const Camera& camera = scene.camera;
  Random random(7);
  std::vector<SurveyImage> images;
  for (int i = 0; i < 6; ++i) {
    const Rigid3 pose = random_room_pose(random);
    SurveyImage image;
    image.name = "frame " + std::to_string(i);
    for (const Lamp& lamp : scene.lamps)
      if (const auto px = project_lamp_centre(lamp, pose, camera); px && camera.contains(*px))
        image.lamps.push_back({lamp.id, *px, 1e-4 * Eigen::Matrix2d::Identity()});
    if (i == 0) image.lamps.push_back(image.lamps[0]);
    images.push_back(image);
  }
  const std::vector<NetworkCamera> cameras{{"camera", camera, {}}};
  const Result<NetworkStart> start = lamp_network(cameras, scene, images);
  ASSERT_TRUE(start.ok()) << start.message;
  EXPECT_EQ(start->network.points.size(), scene.lamps.size());
  const Result<Adjustment> adjusted = adjust(start->network);
  ASSERT_TRUE(adjusted.ok()) << adjusted.message;
  for (const Eigen::Vector2d& off : image_residuals_px(adjusted->network))
    EXPECT_LT(off.norm(), 2e-3);
  std::map<int, Eigen::Vector3d> known;
  for (const Lamp& lamp : scene.lamps)
    if (lamp.id != 4) known[lamp.id] = lamp.centre_m;
  const Result<NetworkStart> found = lamp_network(cameras, known, images);
  ASSERT_TRUE(found.ok()) << found.message;
  for (const NetworkPoint& point : found->network.points) {
    if (point.name != "lamp 4") continue;
    EXPECT_LT((point.position_m - scene.lamps[4].centre_m).norm(), 0.02);
  }
  EXPECT_EQ(lamp_network(cameras, std::map<int, Eigen::Vector3d>(), images).status,
            Status::too_few_lamps);
}

}  // namespace
}  // namespace occ::test
