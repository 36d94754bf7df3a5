// SPDX-License-Identifier: Apache-2.0
// Colours of blobs, and coloured lamps among white lights.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/detect_windows.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;
using test::complaint;

const Eigen::Vector3d white(1, 1, 1), green(0.05, 1, 0.6), red(1, 0.05, 0.05);

Canvas::Noise quiet() {
  Canvas::Noise noise;
  noise.black_dn = 2;
  return noise;
}

/// A picture of coloured light: one canvas for each channel, with independent noise.
class ColourCanvas {
 public:
  ColourCanvas(int width, int height, double background_e = 0)
      : channels_(3, Canvas(width, height, background_e)), width_(width), height_(height) {}

  void add_disc(const Eigen::Vector2d& px, double radius_px, double level_e,
                const Eigen::Vector3d& colour) {
    for (std::size_t k = 0; k < 3; ++k)
      channels_[k].add_disc(px, radius_px, radius_px, 0, 0.8,
                            level_e * colour[static_cast<Eigen::Index>(k)]);
  }

  /// Light that does not fall off, right of a column.
  void add_wall(int from_x, double level_e, const Eigen::Vector3d& colour) {
    for (std::size_t k = 0; k < 3; ++k)
      for (int y = 0; y < height_; ++y)
        for (int x = from_x; x < width_; ++x)
          channels_[k].at(x, y) += level_e * colour[static_cast<Eigen::Index>(k)];
  }

  Image image(const Canvas::Noise& noise, Random* random, int channels = 3) const {
    Image out;
    out.width = width_;
    out.height = height_;
    out.channels = channels;
    std::vector<Image> planes;
    for (const Canvas& canvas : channels_) planes.push_back(canvas.image(noise, random));
    out.type = planes[0].type;
    const std::size_t count = planes[0].u8.size() + planes[0].u16.size();
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k) {
        if (out.type == PixelType::u8)
          out.u8.push_back(k < 3 ? planes[k].u8[i] : std::uint8_t{7});
        else
          out.u16.push_back(k < 3 ? planes[k].u16[i] : std::uint16_t{7});
      }
    return out;
  }

 private:
  std::vector<Canvas> channels_;
  int width_, height_;
};

Image with_response(Image image, const Sensor& sensor) {
  const double range = sensor.full_scale_dn() - sensor.black_level_dn;
  for (std::uint8_t& value : image.u8) {
    const double electrons = (value - sensor.black_level_dn) / sensor.gain_dn_per_e;
    value = static_cast<std::uint8_t>(std::round(sensor.grey_level(std::max(0.0, electrons))));
  }
  EXPECT_GT(range, 0);
  return image;
}

const Blob* nearest(const std::vector<Blob>& blobs, const Eigen::Vector2d& px, double within_px) {
  const Blob* best = nullptr;
  for (const Blob& blob : blobs)
    if ((blob.centroid_px - px).norm() < within_px) {
      within_px = (blob.centroid_px - px).norm();
      best = &blob;
    }
  return best;
}

TEST(Colour, AGreyImageMeasuresNone) {
  Canvas canvas(120, 100);
  canvas.add_disc({60, 50}, 8, 8, 0, 0.8, 3000);
  DetectOptions options;
  options.colours = {green};
  const Image image = canvas.image(quiet(), nullptr);
  const std::vector<Blob> blobs = detect(image.view(), options), plain = detect(image.view());
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_FALSE(blobs[0].colour);
  EXPECT_EQ(blobs[0].flux_dn, plain[0].flux_dn);
  EXPECT_EQ(blobs[0].centroid_px, plain[0].centroid_px);
}

// The true shares are within four standard deviations, which are small.
TEST(Colour, SharesAreThoseOfTheLight) {
  Random random(1);
  for (const int channels : {3, 4})
    for (const int full_scale : {255, 4095})
      for (const Eigen::Vector3d& colour : {white, green, red, Eigen::Vector3d(1, 0.9, 0.3)}) {
        Canvas::Noise noise = quiet();
        noise.full_scale_dn = full_scale;
        noise.gain_dn_per_e = full_scale == 255 ? 0.05 : 0.8;
        ColourCanvas canvas(120, 100, 200);
        canvas.add_disc({60.3, 50.4}, 7, 3500, colour);
        DetectOptions options;
        options.sensor = Canvas::sensor(noise, 0.8);
        const std::vector<Blob> blobs =
            detect(canvas.image(noise, &random, channels).view(), options);
        ASSERT_EQ(blobs.size(), 1u);
        ASSERT_TRUE(blobs[0].colour);
        const BlobColour& found = *blobs[0].colour;
        EXPECT_NEAR(found.share.sum(), 1, 1e-12);
        for (int k = 0; k < 3; ++k) {
          EXPECT_LT(found.sigma[k], 0.02);
          EXPECT_GT(found.sigma[k], 1e-4);
          EXPECT_NEAR(found.share[k], colour[k] / colour.sum(), 4 * found.sigma[k]) << k;
          EXPECT_FALSE(found.clipped[static_cast<std::size_t>(k)]);
        }
      }
}

TEST(Colour, TheResponseIsInverted) {
  Canvas::Noise noise = quiet();
  Sensor sensor = Canvas::sensor(noise, 0.8);
  sensor.response = Response::srgb;
  ColourCanvas canvas(120, 100, 0);
  canvas.add_disc({60, 50}, 8, 4000, {1, 0.5, 0.25});
  DetectOptions options;
  options.sensor = sensor;
  const Image image = with_response(canvas.image(noise, nullptr), sensor);
  const std::vector<Blob> blobs = detect(image.view(), options);
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_NEAR(blobs[0].colour->share[0], 1 / 1.75, 0.005);
  EXPECT_NEAR(blobs[0].colour->share[2], 0.25 / 1.75, 0.005);
}

// The centre is clipped in green; the few pixels of the rim that are not clipped have the colour.
TEST(Colour, ClippedChannelsAreBounds) {
  ColourCanvas canvas(120, 100, 0);
  for (int y = 46; y < 54; ++y)
    for (int x = 56; x < 64; ++x) canvas.add_disc({double(x), double(y)}, 0.5, 12000, green);
  Image image = canvas.image(quiet(), nullptr);
  for (int i = 0; i < image.width * image.height; ++i) {  // no rim: black or in the middle
    std::uint8_t* p = image.u8.data() + 3 * static_cast<std::size_t>(i);
    const bool inside = i % 120 >= 56 && i % 120 < 64 && i / 120 >= 46 && i / 120 < 54;
    p[0] = inside ? 40 : 2;
    p[1] = inside ? 255 : 2;
    p[2] = inside ? 180 : 2;
  }
  const auto linear = [](int value) { return std::pow((value / 255.0 + 0.055) / 1.055, 2.4); };
  const double dark = 2 / 255.0 / 12.92;
  const std::vector<Blob> blobs = detect(image.view());
  ASSERT_EQ(blobs.size(), 1u);
  ASSERT_TRUE(blobs[0].colour);
  EXPECT_EQ(blobs[0].colour->clipped, (std::array<bool, 3>{false, true, false}));
  EXPECT_NEAR(blobs[0].colour->share[1],
              (1 - dark) / (linear(40) + linear(255) + linear(180) - 3 * dark), 1e-6);
}

/// Green lamps touch a white lamp and a white wall. In grey they are one blob.
ColourCanvas crowded() {
  ColourCanvas canvas(320, 240, 20);
  canvas.add_wall(200, 2000, white);
  canvas.add_disc({100, 100}, 20, 4500, white);
  canvas.add_disc({128, 100}, 8, 3000, green);
  canvas.add_disc({200, 60}, 8, 2500, green);
  canvas.add_disc({260, 180}, 8, 2500, green);
  canvas.add_disc({60, 200}, 8, 3000, green);
  return canvas;
}

TEST(Colour, LampsAreFoundAmongWhiteLights) {
  Random random(2);
  const ColourCanvas canvas = crowded();
  const Image image = canvas.image(quiet(), &random);
  DetectOptions options;
  options.sensor = Canvas::sensor(quiet(), 0.8);
  EXPECT_EQ(nearest(detect(image.view(), options), {128, 100}, 1), nullptr);
  options.colours = {green};
  const std::vector<Blob> blobs = detect(image.view(), options);
  ASSERT_EQ(blobs.size(), 4u);
  for (const Eigen::Vector2d& px : {Eigen::Vector2d(128, 100), Eigen::Vector2d(200, 60),
                                    Eigen::Vector2d(260, 180), Eigen::Vector2d(60, 200)}) {
    const Blob* blob = nearest(blobs, px, 0.3);
    ASSERT_NE(blob, nullptr) << px.transpose();
    EXPECT_FALSE(blob->rim.empty());
    EXPECT_NEAR(blob->ellipse.semi_major_px, 8, 0.3);
    EXPECT_FALSE(blob->saturated);
  }
  // The level is that of the lamp in grey: 3000 e of green, without background.
  const double grey = (0.05 + 2 + 0.6) / 4 * 3000 * 0.05 * 3.14159 * 64;
  EXPECT_NEAR(nearest(blobs, {60, 200}, 1)->flux_dn, grey, 0.03 * grey);
}

TEST(Colour, WindowsFindTheSameLamps) {
  const Image image = crowded().image(quiet(), nullptr);
  DetectOptions options;
  options.sensor = Canvas::sensor(quiet(), 0.8);
  options.colours = {green};
  const WindowBlobs found =
      detect_in_windows(image.view(), {{30, 170, 90, 230}, {230, 150, 290, 210}}, options);
  ASSERT_EQ(found.blobs.size(), 2u);
  EXPECT_NE(nearest(found.blobs, {60, 200}, 0.1), nullptr);
  EXPECT_NE(nearest(found.blobs, {260, 180}, 0.1), nullptr);
}

// An over-exposed lamp is white in the middle and coloured at its rim.
TEST(Colour, AnOverexposedLampIsWhole) {
  ColourCanvas canvas(200, 160, 20);
  canvas.add_disc({60, 80}, 12, 60000, red);    // 3000 DN in red, 150 in the others
  canvas.add_disc({140, 80}, 12, 200000, red);  // clipped in all channels
  DetectOptions options;
  options.sensor = Canvas::sensor(quiet(), 0.8);
  options.colours = {red};
  const std::vector<Blob> blobs = detect(canvas.image(quiet(), nullptr).view(), options);
  for (const double x : {60, 140}) {
    const Blob* blob = nearest(blobs, {x, 80}, 0.3);
    ASSERT_NE(blob, nullptr) << x;
    EXPECT_TRUE(blob->saturated);
    EXPECT_FALSE(blob->merged);
    EXPECT_GT(blob->area_px, 440);
  }
}

// One pass for red, one for green, grey for white: each lamp is found once.
TEST(Colour, EveryLampIsFoundOnce) {
  ColourCanvas canvas(320, 240, 20);
  canvas.add_disc({60, 60}, 9, 3000, white);
  canvas.add_disc({160, 60}, 9, 3000, green);
  canvas.add_disc({260, 60}, 9, 3000, red);
  canvas.add_disc({60, 160}, 2, 3000, red);
  canvas.add_disc({160, 160}, 2, 3000, {0.9, 1, 0.95});
  DetectOptions options;
  options.sensor = Canvas::sensor(quiet(), 0.8);
  options.colours = {red, white, green, Eigen::Vector3d(0.06, 1, 0.61)};
  Random random(3);
  const std::vector<Blob> blobs = detect(canvas.image(quiet(), &random).view(), options);
  EXPECT_EQ(blobs.size(), 5u);
  for (const Eigen::Vector2d& px :
       {Eigen::Vector2d(60, 60), Eigen::Vector2d(160, 60), Eigen::Vector2d(260, 60),
        Eigen::Vector2d(60, 160), Eigen::Vector2d(160, 160)})
    EXPECT_NE(nearest(blobs, px, 0.2), nullptr) << px.transpose();
}

TEST(Colour, ADarkNoisyImageHasNoBlobs) {
  Random random(4);
  ColourCanvas canvas(640, 480, 30);
  canvas.add_wall(320, 1500, white);
  const Image image = canvas.image(quiet(), &random);
  DetectOptions options;
  options.colours = {green, red};
  EXPECT_LE(detect(image.view(), options).size(), 1u);
  options.sensor = Canvas::sensor(quiet(), 0.8);
  EXPECT_LE(detect(image.view(), options).size(), 1u);
}

TEST(Colour, InvalidColoursAreNamed) {
  const Image image = crowded().image(quiet(), nullptr);
  for (const Eigen::Vector3d& colour :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.1, 1, 1), Eigen::Vector3d(NAN, 1, 1)}) {
    DetectOptions options;
    options.colours = {green, colour};
    EXPECT_NE(complaint([&] { detect(image.view(), options); }).find("colours[1]"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace occ
