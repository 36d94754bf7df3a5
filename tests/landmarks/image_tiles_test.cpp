// SPDX-License-Identifier: Apache-2.0
// AprilTags in large images: the tags are independent of the tiling, for images read tile by tile
// from a file or from a renderer.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/time.h>

#include <cmath>
#include <set>

#include "libocc/calibrate/resection.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

ImageReader reader_of(const TargetRenderer& renderer, const Camera& camera) {
  return {camera.width(), camera.height(), [&](int x0, int y0, int width, int height) {
            return renderer.window({x0, y0, width, height});
          }};
}

struct Panorama {
  Camera camera = Camera::rotating_line(small_line(2000, 700));
  TargetRenderer renderer;
  Image image;

  explicit Panorama(double noise_dn)
      : renderer(tags_in_a_room(), camera, upright_line({2.6, 1.9, 1.5}, 0.4), with(noise_dn)),
        image(renderer.window({0, 0, camera.width(), camera.height()})) {}

  static TargetImageOptions with(double noise_dn) {
    TargetImageOptions options;
    options.noise_dn = noise_dn;
    return options;
  }
};

void expect_same(const std::vector<AprilTag>& tags, const std::vector<AprilTag>& others) {
  ASSERT_EQ(tags.size(), others.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    EXPECT_EQ(tags[i].id, others[i].id);
    for (std::size_t k = 0; k < 4; ++k) {
      const double allowed =
          tags[i].refined ? 1e-3 : 0.3;  // unrefined corners of libapriltag depend on the tiling
      EXPECT_LT((tags[i].corners_px[k] - others[i].corners_px[k]).norm(), allowed) << tags[i].id;
      const Eigen::Vector2d corner =
          (tags[i].homography * Eigen::Vector3d(k == 1 || k == 2 ? 1 : -1, k >= 2 ? 1 : -1, 1))
              .hnormalized();
      EXPECT_LT((corner - tags[i].corners_px[k]).norm(), 1e-6);
    }
  }
}

TEST(TagTiles, TagsAreIndependentOfTheTiling) {
  const Panorama panorama(2);
  const std::vector<AprilTag> whole = detect_april_tags(panorama.image.view());
  EXPECT_GE(whole.size(), 12u);
  for (const int tile : {300, 437}) {
    AprilTagOptions options;
    options.tile_px = tile;
    options.overlap_px = 140;
    expect_same(whole, detect_april_tags(panorama.image.view(), options));
  }
}

TEST(TagTiles, BendsUseThePositionInTheWholeImage) {
  const Panorama panorama(2);
  AprilTagOptions options;
  options.bends_px = side_bends(panorama.camera);
  const std::vector<AprilTag> whole = detect_april_tags(panorama.image.view(), options);
  options.tile_px = 437;
  options.overlap_px = 140;
  expect_same(whole, detect_april_tags(panorama.image.view(), options));
}

TEST(TagTiles, AnImageReadByTilesIsNeverReadAsAWhole) {
  const Panorama panorama(2);
  AprilTagOptions options;
  options.tile_px = 600;
  options.overlap_px = 140;
  const ImageReader reader = reader_of(panorama.renderer, panorama.camera);
  ImageReader watched = reader;
  int largest = 0;
  watched.read = [&](int x0, int y0, int width, int height) {
    largest = std::max({largest, width, height});
    return reader.read(x0, y0, width, height);
  };
  std::vector<std::pair<int, int>> steps;
  options.progress = [&](int done, int of) {
    steps.emplace_back(done, of);
    return true;
  };
  expect_same(detect_april_tags(watched, options), detect_april_tags(panorama.image.view()));
  EXPECT_EQ(largest, 600);
  ASSERT_FALSE(steps.empty());
  EXPECT_EQ(steps.front().first, 1);
  EXPECT_EQ(steps.back().first, steps.back().second);
  int calls = 0;
  options.progress = [&](int, int) { return ++calls < 3; };
  EXPECT_LT(detect_april_tags(watched, options).size(), 20u);
  EXPECT_EQ(calls, 3);
}

TEST(TagTiles, SixteenBitImagesHaveOneScaleForAllTiles) {
  const Panorama panorama(2);
  ImageReader reader = reader_of(panorama.renderer, panorama.camera);
  const auto shallow = reader.read;
  reader.read = [=](int x0, int y0, int width, int height) {
    Image image = shallow(x0, y0, width, height);
    image.type = PixelType::u16;
    for (const std::uint8_t value : image.u8)
      image.u16.push_back(static_cast<std::uint16_t>(16 * value));
    image.u8.clear();
    return image;
  };
  AprilTagOptions options;
  options.tile_px = 600;
  options.overlap_px = 140;
  const std::vector<AprilTag> deep = detect_april_tags(reader, options);
  const std::vector<AprilTag> plain = detect_april_tags(panorama.image.view());
  ASSERT_EQ(deep.size(), plain.size());
  for (std::size_t i = 0; i < deep.size(); ++i) EXPECT_EQ(deep[i].id, plain[i].id);
}

TEST(TagTiles, RejectInvalidArguments) {
  AprilTagOptions options;
  options.tile_px = 500;
  options.overlap_px = 400;
  EXPECT_NE(complaint([&] { options.validate(); }).find("tile_px"), std::string::npos);
  options = {};
  options.overlap_px = -1;
  EXPECT_NE(complaint([&] { options.validate(); }).find("overlap_px"), std::string::npos);
  EXPECT_NE(complaint([] {
              detect_april_tags(ImageReader{100, 100, {}});
            }).find("read"),
            std::string::npos);
  const ImageReader wrong{100, 100, [](int, int, int, int) { return Image(); }};
  EXPECT_NE(complaint([&] { detect_april_tags(wrong); }).find("window"), std::string::npos);
}

long peak_memory_mb() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return use.ru_maxrss / 1024;
}

// 400 MB of pixels, rendered and searched tile by tile.
TEST(SlowTagTiles, APanoramaOf40000By10000PixelsInBoundedMemory) {
  const Camera camera = Camera::rotating_line(small_line(40000, 10000));
  TargetImageOptions options;
  options.noise_dn = 2;
  const TargetRenderer renderer(tags_in_a_room(0.12, 12), camera,
                                upright_line({2.6, 1.9, 1.5}, 0.4), options);
  const long before = peak_memory_mb();
  AprilTagOptions detecting;
  detecting.decimate = 2;
  const std::vector<AprilTag> tags = detect_april_tags(reader_of(renderer, camera), [&] {
    AprilTagOptions tiles = detecting;
    tiles.tile_px = 2400;
    tiles.overlap_px = 800;
    return tiles;
  }());
  EXPECT_LT(peak_memory_mb() - before, 250);
  std::set<int> whole, found;
  double squares = 0;
  for (const TagTruth& truth : renderer.truth().tags)
    if (truth.whole) whole.insert(truth.id);
  for (const AprilTag& tag : tags) {
    found.insert(tag.id);
    const TagTruth& truth = renderer.truth().tags[tag.id];
    for (std::size_t k = 0; k < 4; ++k)
      squares += camera.difference_px(tag.corners_px[k], truth.corners_px[k]).squaredNorm();
  }
  EXPECT_GE(whole.size(), 40u);
  for (const int id : whole) EXPECT_EQ(found.count(id), 1u) << id;
  EXPECT_LT(std::sqrt(squares / (8.0 * static_cast<double>(tags.size()))), 0.15);
}

}  // namespace
}  // namespace occ::test
