// SPDX-License-Identifier: Apache-2.0
// Rendered targets: detectors find them at their true positions with every camera model; windows
// are parts of the whole image; seams, back sides and hidden sheets.
#include "libocc/simulate/targets.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "libocc/calibrate/resection.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

Camera bent_pinhole() {
  return Camera::pinhole(640, 480, 520, 523, 322.3, 236.1, {-0.22, 0.08, 8e-4, -5e-4});
}
Camera fisheye() { return Camera::fisheye(1000, 1000, 380, 381, 500.4, 497.9, {0.03, -0.005}); }

struct Errors {
  int found = 0, drawn = 0;
  double rms_px = 0, worst_px = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
};

// Compares the detected tags with the tags that are whole.
Errors corner_errors(const TargetField& field, const Camera& camera, const Rigid3& pose,
                     const TargetImageOptions& options = {},
                     const AprilTagOptions& detecting = {}) {
  const TargetRenderer renderer(field, camera, pose, options);
  const Image image = renderer.window({0, 0, camera.width(), camera.height()});
  const std::vector<AprilTag> tags = detect_april_tags(image.view(), detecting);
  Errors e;
  for (const TagTruth& truth : renderer.truth().tags) {
    if (!truth.whole) continue;
    ++e.drawn;
    for (const AprilTag& tag : tags) {
      if (tag.id != truth.id) continue;
      ++e.found;
      EXPECT_TRUE(tag.refined) << tag.id;
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d off = camera.difference_px(tag.corners_px[k], truth.corners_px[k]);
        e.mean_px += off;
        e.rms_px += off.squaredNorm();
        e.worst_px = std::max(e.worst_px, off.norm());
      }
    }
  }
  e.mean_px /= std::max(1, 4 * e.found);
  e.rms_px = std::sqrt(e.rms_px / std::max(1, 8 * e.found));
  return e;
}

void expect_found(const Errors& e, int least) {
  EXPECT_GE(e.drawn, least);
  EXPECT_EQ(e.found, e.drawn);
  EXPECT_LT(e.rms_px, 0.025);
  EXPECT_LT(e.worst_px, 0.12);
  EXPECT_LT(e.mean_px.norm(), 0.01);
}

TEST(Targets, TagsAreFoundAtTheirPinholeProjection) {
  expect_found(corner_errors(tags_on_a_wall(5, 3), bent_pinhole(), towards_wall({0.2, -1.9, 0.1})),
               12);
}

TEST(Targets, TagsAreFoundAtTheirFisheyeProjection) {
  expect_found(corner_errors(tags_on_a_wall(5, 3), fisheye(), towards_wall({-0.1, -0.9, 0.1})), 12);
}

TEST(Targets, TagsAreFoundAtTheirRotatingLineProjection) {
  expect_found(corner_errors(tags_in_a_room(), Camera::rotating_line(small_line()),
                             upright_line({2.6, 1.9, 1.5}, 0.4)),
               15);
}

// Corners are more accurate if the lens is known instead of estimated from them.
TEST(Targets, AKnownLensImprovesCorners) {
  const Camera camera = Camera::fisheye(1000, 1000, 480, 481, 500.4, 497.9, {0.03, -0.005});
  TargetImageOptions noisy;
  noisy.noise_dn = 5;
  AprilTagOptions known;
  known.bends_px = side_bends(camera);
  double squared = 0, squared_known = 0;
  for (const double x : {-0.3, 0.0, 0.3}) {
    const Rigid3 pose = towards_wall({x, -0.8, 0.1});
    TargetField field = tags_on_a_wall(3, 3);
    for (Tag& tag : field.tags) tag.centre_m.y() = 0;  // so that no tag hides another
    squared += std::pow(corner_errors(field, camera, pose, noisy).rms_px, 2);
    squared_known += std::pow(corner_errors(field, camera, pose, noisy, known).rms_px, 2);
    EXPECT_LT(corner_errors(field, camera, pose, {}, known).rms_px, 0.02);
  }
  EXPECT_LT(squared_known, 0.6 * squared);
}

TEST(Targets, WindowsAreTheWholeImageBitForBit) {
  TargetImageOptions options;
  options.noise_dn = 3;
  options.seed = 5;
  TargetField field = tags_in_a_room();
  const Camera camera = Camera::rotating_line(small_line());
  const TargetRenderer renderer(field, camera, upright_line({2.6, 1.9, 1.5}, 0.4), options);
  const Image whole = renderer.window({0, 0, camera.width(), camera.height()});
  const PixelRectangle windows[] = {{0, 0, 1, 1},
                                    {0, 0, 733, 97},
                                    {1301, 203, 517, 303},
                                    {camera.width() - 311, 0, 311, camera.height()}};
  for (const PixelRectangle& w : windows) {
    const Image part = renderer.window(w);
    for (int y = 0; y < w.height; ++y)
      for (int x = 0; x < w.width; ++x)
        ASSERT_EQ(part.u8[y * w.width + x], whole.u8[(y + w.y0) * whole.width + x + w.x0])
            << x << " " << y;
  }
}

int pixel(const Image& image, double x, double y) {
  return image.u8[static_cast<std::size_t>(std::lround(y)) * static_cast<std::size_t>(image.width) +
                  static_cast<std::size_t>(std::lround(x))];
}

TEST(Targets, ATagOnTheSeamIsDrawnAtBothEnds) {
  RotatingLine line = small_line();
  line.angle_per_px_rad =
      6.283185307179586 / (line.width - 40);  // 360 degrees end 40 px before the border
  const Camera camera = Camera::rotating_line(line);
  TargetField field;
  CircularTarget disc;
  disc.radius_m = 0.3;
  disc.sheet_m = 1;
  disc.centre_m = {4, 0, 0};
  disc.normal = {-1, 0, 0};
  field.circles = {disc};
  Rigid3 pose = upright_line({0, 0, 0}, 0);
  const TargetRenderer renderer(field, camera, pose);
  const CircleTruth& truth = renderer.truth().circles[0];
  ASSERT_TRUE(truth.in_view);
  const Image image = render_targets(field, camera, pose);
  const double row = truth.image_centre_px.y(), period = camera.period_px();
  EXPECT_EQ(pixel(image, 3, row), 200);
  EXPECT_EQ(pixel(image, period - 4, row), 200);
  for (int x = 0; x < 38; ++x)
    EXPECT_NEAR(pixel(image, x, row), pixel(image, x + period, row), 1) << x;
  EXPECT_EQ(pixel(image, 0.5 * period, row), 110);
}

TEST(Targets, BackSidesAreNotDrawnAndNearSheetsHideFarOnes) {
  const Camera camera = bent_pinhole();
  TargetField field;
  CircularTarget near;
  near.radius_m = 0.2;
  near.sheet_m = 1;
  near.centre_m = {0, 0, 1};
  near.normal = {0, 0, -1};
  CircularTarget far = near;
  far.centre_m.z() = 2;
  far.dark = true;
  field.circles = {near, far};
  const Image image = render_targets(field, camera, {});
  EXPECT_EQ(pixel(image, 322, 236), 200);
  EXPECT_EQ(pixel(image, 322 + 160, 236), 30);
  field.circles[0].normal *= -1;
  const TargetRenderer renderer(field, camera, {});
  EXPECT_FALSE(renderer.truth().circles[0].in_view);
  EXPECT_TRUE(renderer.truth().circles[1].whole);
  EXPECT_EQ(pixel(renderer.window({0, 0, 640, 480}), 322, 236), 30);
}

// The centroid must also agree with project_lamp_centre, which computes it independently.
TEST(Targets, DiscsOfBothTonesAreFoundAtTheCentreOfTheirImage) {
  const Camera camera = bent_pinhole();
  for (const bool dark : {false, true}) {
    TargetField field;
    CircularTarget disc;
    disc.radius_m = 0.1;
    disc.sheet_m = 0.5;
    disc.dark = dark;
    disc.centre_m = {0.15, -0.1, 1.4};
    disc.normal = Eigen::Vector3d(0.5, 0.2, -1).normalized();
    field.circles = {disc};
    TargetImageOptions options;
    options.noise_dn = 1;
    options.ground_dn = dark ? options.white_dn : options.black_dn;
    const TargetRenderer renderer(field, camera, {}, options);
    const CircleTruth& truth = renderer.truth().circles[0];
    Lamp lamp = disc_lamp(0, disc.centre_m, disc.radius_m);
    lamp.normal = disc.normal;
    lamp.x_axis = lamp.normal.unitOrthogonal();
    EXPECT_LT((*project_lamp_centre(lamp, {}, camera) - truth.image_centre_px).norm(), 1e-3);
    EXPECT_GT((truth.centre_px - truth.image_centre_px).norm(), 0.3);
    DetectOptions detecting;
    detecting.dark = dark;
    const std::vector<Blob> blobs =
        detect(renderer.window({0, 0, camera.width(), camera.height()}).view(), detecting);
    ASSERT_EQ(blobs.size(), 1u) << dark;
    EXPECT_LT((blobs[0].centroid_px - truth.image_centre_px).norm(), 0.03) << dark;
  }
}

TEST(Targets, NoiseHasItsStandardDeviationAndFollowsTheSeed) {
  TargetImageOptions options;
  options.noise_dn = 4;
  const Camera camera = bent_pinhole();
  const Image one = render_targets({}, camera, {}, options);
  EXPECT_EQ(one.u8, render_targets({}, camera, {}, options).u8);
  double sum = 0, squares = 0;
  for (const std::uint8_t value : one.u8) {
    sum += value - 110.0;
    squares += (value - 110.0) * (value - 110.0);
  }
  const auto n = static_cast<double>(one.u8.size());
  EXPECT_NEAR(sum / n, 0, 0.05);
  EXPECT_NEAR(std::sqrt(squares / n - 1 / 12.0), 4, 0.03);
  options.frame = 1;
  EXPECT_NE(one.u8, render_targets({}, camera, {}, options).u8);
}

TEST(Targets, RejectInvalidInput) {
  TargetField field = tags_on_a_wall(1, 1);
  const Camera camera = bent_pinhole();
  const auto message = [&] { return complaint([&] { render_targets(field, camera, {}); }); };
  field.tags[0].id = 587;
  EXPECT_NE(message().find("id must be below 587"), std::string::npos) << message();
  field.tags[0].family = "tag99";
  EXPECT_NE(message().find("family"), std::string::npos) << message();
  field.tags.clear();
  field.circles.emplace_back();
  EXPECT_NE(message().find("radius_m"), std::string::npos) << message();
  field.circles.clear();
  field.boards.emplace_back();
  EXPECT_NE(message().find("square_m"), std::string::npos) << message();
  const TargetRenderer renderer({}, camera, {});
  EXPECT_NE(complaint([&] {
              renderer.window({600, 0, 41, 10});
            }).find("columns"),
            std::string::npos);
  EXPECT_NE(complaint([&] { renderer.window({0, -1, 41, 10}); }).find("rows"), std::string::npos);
}

TEST(TagPattern, IsThePatternThatIsRenderedAndDetected) {
  const Camera camera = Camera::pinhole(240, 240, 240, 240, 119.5, 119.5);
  for (const std::string& family : april_tag_families()) {
    const TagPattern pattern = tag_pattern(family, 5);
    const auto n = static_cast<int>(pattern.black.rows());
    ASSERT_EQ(pattern.black.cols(), n);
    ASSERT_GT(n, pattern.square_cells);
    ASSERT_EQ((n - pattern.square_cells) % 2, 0);
    Tag tag;
    tag.id = 5;
    tag.family = family;
    tag.size_m = 16.0 * pattern.square_cells / 240;  // a cell has 16 px at a distance of 1 m
    tag.centre_m = {0, 0, 1};
    tag.normal = {0, 0, -1};
    tag.x_axis = {1, 0, 0};
    const Image image =
        TargetRenderer({{tag}, {}, {}, {}}, camera, Rigid3(), {}).window({0, 0, 240, 240});
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const int column = 120 + 16 * x - 8 * n + 8, row = 120 + 16 * y - 8 * n + 8;
        const int grey = image.u8[static_cast<std::size_t>(240 * row + column)];
        EXPECT_EQ(grey < 115, pattern.black(y, x)) << family << " " << x << " " << y;
      }
    AprilTagOptions options;
    options.family = family;
    const std::vector<AprilTag> tags = detect_april_tags(image.view(), options);
    ASSERT_EQ(tags.size(), 1u) << family;
    EXPECT_EQ(tags[0].id, 5);
    EXPECT_NEAR((tags[0].corners_px[1] - tags[0].corners_px[0]).norm(), 16 * pattern.square_cells,
                0.1);
  }
}

TEST(TagPattern, RejectsWrongFamiliesAndIds) {
  EXPECT_NE(complaint([] { tag_pattern("tag36h12", 0); }).find("tag36h12"), std::string::npos);
  EXPECT_NE(complaint([] { tag_pattern("tag36h11", 587); }).find("below 587"), std::string::npos);
  EXPECT_NE(complaint([] { tag_pattern("tag36h11", -1); }).find("-1"), std::string::npos);
}

}  // namespace
}  // namespace occ::test
