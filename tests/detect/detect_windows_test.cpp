// SPDX-License-Identifier: Apache-2.0
// Detection in parts of an image.
#include "libocc/detect/detect_windows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "libocc/simulate/simulate.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

// A window has few background meshes, and a lamp may cover most of them.
TEST(DetectInWindows, FindsALampInWindowsOfAnySize) {
  occ::Scene scene = occ::test::irregular_room();
  scene.lamps.resize(1);
  scene.room.reset();
  occ::Random random(1);
  for (int i = 0; i < 120; ++i) {
    const int half = i < 40 ? 50 + 3 * i : 87;  // three meshes across
    const Eigen::Vector3d position(random.uniform(0.6, 1.2), random.uniform(0.7, 1.3), 1.5);
    const occ::Rigid3 pose{Eigen::Matrix3d::Identity(), -position};
    const Eigen::Vector2d px = *scene.camera.project(pose * scene.lamps[0].centre_m);
    const occ::Rendered seen = occ::simulate(scene, pose);
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const occ::WindowBlobs found =
        occ::detect_in_windows(seen.image.view(), {{x - half, y - half, x + half, y + half}});
    ASSERT_EQ(found.blobs.size(), 1u) << "window of " << 2 * half + 1;
    EXPECT_NEAR((found.blobs[0].centroid_px - seen.lamps[0].image_centre_px).norm(), 0, 0.2);
  }
}

// Three spots in a row or in a column, and windows around the first and the last.
TEST(DetectInWindows, FindsNothingBetweenWindows) {
  for (const bool column : {false, true}) {
    occ::test::Canvas canvas(300, 300);
    occ::Random random(2);
    std::vector<occ::PixelWindow> windows;
    for (const int at : {50, 150, 250}) {
      const int x = column ? 150 : at, y = column ? at : 150;
      canvas.add_spot(Eigen::Vector2d(x, y), 1.2, 20000);
      if (at != 150) windows.push_back({x - 30, y - 30, x + 30, y + 30});
    }
    const occ::Image image = canvas.image({}, &random);
    const occ::WindowBlobs found = occ::detect_in_windows(image.view(), windows);
    ASSERT_EQ(found.blobs.size(), 2u) << column;
    for (const occ::Blob& blob : found.blobs)
      EXPECT_GT((blob.centroid_px - Eigen::Vector2d(150, 150)).norm(), 90);
    // Windows that overlap, and a third one that overlaps both, show each spot once.
    windows = {{20, 20, 160, 170}, {140, 130, 290, 280}, {100, 100, 200, 200}};
    const std::size_t count = occ::detect(image.view()).size();
    EXPECT_EQ(count, 3u);
    EXPECT_LE(occ::detect_in_windows(image.view(), windows).blobs.size(), 3u);
    EXPECT_GE(occ::detect_in_windows(image.view(), windows).blobs.size(), 1u);
  }
}

TEST(DetectInWindows, BlobsAreInPixelsOfTheWholeImage) {
  occ::test::Canvas canvas(300, 200);
  canvas.add_disc({203.4, 121.7}, 12, 10, 0.4, 0.8, 3000);
  occ::Random random(3);
  const occ::Image image = canvas.image({}, &random);
  const occ::Blob whole = occ::detect(image.view()).at(0);
  const occ::WindowBlobs found = occ::detect_in_windows(image.view(), {{120, 50, 280, 190}});
  ASSERT_EQ(found.blobs.size(), 1u);
  const occ::Blob& blob = found.blobs[0];
  EXPECT_EQ(found.cut, 0);
  EXPECT_LT((blob.centroid_px - whole.centroid_px).norm(), 0.05);
  EXPECT_LT((blob.ellipse.centre_px - whole.ellipse.centre_px).norm(), 0.05);
  EXPECT_NEAR(blob.x0, whole.x0, 1);
  EXPECT_NEAR(blob.x1, whole.x1, 1);
  EXPECT_NEAR(blob.y0, whole.y0, 1);
  EXPECT_NEAR(blob.y1, whole.y1, 1);
  ASSERT_FALSE(blob.rim.empty());
  for (const occ::RimPoint& point : blob.rim)
    EXPECT_LT(std::abs((point.px - whole.centroid_px).norm() - 11), 1.5);
}

TEST(DetectInWindows, BlobsThatAWindowCutsAreCounted) {
  occ::test::Canvas canvas(200, 200);
  canvas.add_disc({100, 100}, 10, 10, 0, 0.8, 3000);
  canvas.add_disc({100, 3}, 10, 10, 0, 0.8, 3000);  // the border of the image cuts this one
  occ::Random random(4);
  const occ::Image image = canvas.image({}, &random);
  for (const occ::PixelWindow& window :
       {occ::PixelWindow{100, 40, 180, 160}, occ::PixelWindow{20, 40, 101, 160},
        occ::PixelWindow{40, 100, 160, 180}, occ::PixelWindow{40, 40, 160, 101}}) {
    const occ::WindowBlobs found = occ::detect_in_windows(image.view(), {window});
    EXPECT_EQ(found.blobs.size(), 0u) << window.x0 << " " << window.y0;
    EXPECT_EQ(found.cut, 1) << window.x0 << " " << window.y0;
  }
  const occ::WindowBlobs top = occ::detect_in_windows(image.view(), {{40, -20, 160, 60}});
  ASSERT_EQ(top.blobs.size(), 1u);
  EXPECT_TRUE(top.blobs[0].cut_by_border);
  EXPECT_EQ(top.cut, 0);
}

// A blob that the border of the image cuts is kept, at each border.
TEST(DetectInWindows, BlobsThatTheImageCutsAreKept) {
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(100, 3), Eigen::Vector2d(100, 176),
                                    Eigen::Vector2d(3, 100), Eigen::Vector2d(196, 100)}) {
    occ::test::Canvas canvas(200, 180);
    canvas.add_disc(px, 10, 10, 0, 0.8, 3000);
    occ::Random random(5);
    const occ::Image image = canvas.image({}, &random);
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const occ::WindowBlobs found =
        occ::detect_in_windows(image.view(), {{x - 60, y - 60, x + 60, y + 60}});
    ASSERT_EQ(found.blobs.size(), 1u) << px.transpose();
    EXPECT_TRUE(found.blobs[0].cut_by_border) << px.transpose();
    EXPECT_EQ(found.cut, 0) << px.transpose();
  }
}

// The windows together show the blobs of the whole image, each once and the brightest first.
TEST(DetectInWindows, BlobsAreThoseOfTheImageInItsOrder) {
  occ::test::Canvas canvas(400, 300, 40);
  const Eigen::Vector2d places[] = {{50.3, 50.8}, {340.2, 60.7}, {200.6, 150.1}, {60.4, 240.9}};
  for (int i = 0; i < 4; ++i) canvas.add_spot(places[i], 1.2, 9000 + 4000 * ((i * 3) % 4));
  const occ::Image image = canvas.image({}, nullptr);
  const std::vector<occ::Blob> whole = occ::detect(image.view());
  ASSERT_EQ(whole.size(), 4u);
  std::vector<occ::PixelWindow> windows;
  for (const Eigen::Vector2d& px : places) {
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    windows.push_back({x - 30, y - 41, x + 33, y + 30});
    windows.push_back({x - 20, y - 20, x + 20, y + 20});  // within the other
  }
  windows.push_back({500, 10, 600, 90});  // beside the image
  const occ::WindowBlobs found = occ::detect_in_windows(image.view(), windows);
  ASSERT_EQ(found.blobs.size(), 4u);
  EXPECT_EQ(found.cut, 0);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((found.blobs[i].centroid_px - whole[i].centroid_px).norm(), 0.02) << i;
    EXPECT_NEAR(found.blobs[i].flux_dn, whole[i].flux_dn, 0.02 * whole[i].flux_dn) << i;
  }
  EXPECT_NE(occ::test::complaint([&] {
              occ::detect_in_windows(image.view(), {{10, 10, 9, 20}});
            }).find("windows"),
            std::string::npos);
}
