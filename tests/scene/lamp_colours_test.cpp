// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/lamp_colours.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "libocc/scene/scene_file.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using internal::scene::colours_not_compared;
using internal::scene::ColourTest;
using internal::scene::contradicts_colour;
using internal::scene::log_colour_ratio;
using internal::scene::stated_colours;
using test::complaint;

const Eigen::Vector3d white(1, 1, 1), green(0.05, 1, 0.6);

Lamp lamp_of(const Eigen::Vector3d& colour) {
  Lamp lamp;
  lamp.colour = colour;
  return lamp;
}

Blob blob_of(const Eigen::Vector3d& colour, double sigma = 0.005) {
  Blob blob;
  blob.colour = BlobColour{colour / colour.sum(), Eigen::Vector3d::Constant(sigma), {}};
  return blob;
}

// Equal channels of another level, as of a neutral filter, are no statement.
TEST(LampColours, AreStatedIfTheChannelsOfOneLampDiffer) {
  EXPECT_TRUE(stated_colours({lamp_of(white), lamp_of({0.8, 0.8, 0.8})}).empty());
  const std::vector<Eigen::Vector3d> stated =
      stated_colours({lamp_of(white), lamp_of(green), lamp_of(white)});
  ASSERT_EQ(stated.size(), 2u);
  EXPECT_EQ(stated[0], white);
  EXPECT_EQ(stated[1], green);
}

// The default allows for a wrong white balance, but tells green, white, red and blue apart.
TEST(LampColours, WhiteBalanceIsAllowedFor) {
  const Lamp lamp = lamp_of(green);
  EXPECT_FALSE(contradicts_colour(lamp, blob_of(green)));
  EXPECT_FALSE(contradicts_colour(lamp, blob_of({0.1, 1, 0.45})));
  EXPECT_FALSE(contradicts_colour(lamp, blob_of({0.0, 1, 0.8})));
  EXPECT_TRUE(contradicts_colour(lamp, blob_of(white)));
  EXPECT_TRUE(contradicts_colour(lamp, blob_of({1, 0.05, 0.05})));
  EXPECT_TRUE(contradicts_colour(lamp, blob_of({0.05, 0.1, 1})));
  EXPECT_FALSE(contradicts_colour(lamp_of(white), blob_of({1, 0.8, 0.5})));
  EXPECT_TRUE(contradicts_colour(lamp_of(white), blob_of(green)));
  EXPECT_FALSE(contradicts_colour(lamp, Blob()));
}

TEST(LampColours, BothSigmasCount) {
  Lamp lamp = lamp_of({0.5, 1, 0.5});
  lamp.colour_sigma = 0.1;
  const Eigen::Vector3d seen(0.8, 1, 0.8);  // ln of the ratio: about 0.41
  EXPECT_TRUE(contradicts_colour(lamp, blob_of(seen)));
  EXPECT_FALSE(contradicts_colour(lamp, blob_of(seen, 0.05)));
  lamp.colour_sigma = 0.2;
  EXPECT_FALSE(contradicts_colour(lamp, blob_of(seen)));
}

// A green blob supports a green lamp. A white one hardly supports a white lamp, because most false
// lights are white. The ratio is bounded, because one false light in ten has the lamp's colour.
TEST(LampColours, RareColoursAreEvidence) {
  EXPECT_GT(log_colour_ratio(lamp_of(green), blob_of(green)), 2);
  EXPECT_LT(log_colour_ratio(lamp_of(green), blob_of(green)), std::log(10.0));
  EXPECT_LT(log_colour_ratio(lamp_of(green), blob_of(white)), -2);
  EXPECT_LT(log_colour_ratio(lamp_of(white), blob_of(white)), 1.5);
  EXPECT_LT(log_colour_ratio(lamp_of(green), blob_of(green, 0.2)),
            log_colour_ratio(lamp_of(green), blob_of(green)));
  Blob blob = blob_of(green);
  blob.colour->clipped[1] = true;
  EXPECT_EQ(log_colour_ratio(lamp_of(green), blob), 0);
  EXPECT_EQ(log_colour_ratio(lamp_of(green), Blob()), 0);
  EXPECT_EQ(ColourTest({lamp_of(white)}).log_ratio(0, blob_of(green)), 0);
}

// A clipped channel has more light than it shows.
TEST(LampColours, ClippedChannelsAreBounds) {
  Lamp lamp = lamp_of(green);
  lamp.colour_sigma = 0.1;
  Blob blob = blob_of({0.3, 1, 0.6});  // more red than stated
  EXPECT_TRUE(contradicts_colour(lamp, blob));
  blob.colour->clipped[1] = true;  // and even more green, but blue shows how much red
  EXPECT_TRUE(contradicts_colour(lamp, blob));
  blob.colour->clipped[2] = true;
  EXPECT_FALSE(contradicts_colour(lamp, blob));
  blob = blob_of({1, 1, 1});
  blob.colour->clipped = {true, true, true};
  EXPECT_FALSE(contradicts_colour(lamp, blob));
  blob.colour->clipped = {true, false, false};  // at least as much red as green
  EXPECT_TRUE(contradicts_colour(lamp, blob));
}

TEST(LampColours, TestOfAllLamps) {
  const ColourTest none({lamp_of(white), lamp_of(white)});
  EXPECT_FALSE(none.is_active());
  EXPECT_FALSE(none.contradicts_all(blob_of(green)));
  const ColourTest both({lamp_of(white), lamp_of(green), lamp_of(white)});
  EXPECT_TRUE(both.is_active());
  EXPECT_TRUE(both.contradicts(0, blob_of(green)));
  EXPECT_FALSE(both.contradicts(1, blob_of(green)));
  EXPECT_FALSE(both.contradicts_all(blob_of(green)));
  EXPECT_FALSE(both.contradicts_all(blob_of(white)));
  EXPECT_TRUE(both.contradicts_all(blob_of({1, 0, 0})));
  EXPECT_FALSE(both.contradicts_all(Blob()));
}

TEST(LampColours, AGreyImageIsReported) {
  const std::vector<Lamp> lamps{lamp_of(white), lamp_of(green)};
  EXPECT_NE(colours_not_compared(lamps, {Blob()}).find("colours"), std::string::npos);
  EXPECT_EQ(colours_not_compared(lamps, {Blob(), blob_of(white)}), "");
  EXPECT_EQ(colours_not_compared({lamp_of(white)}, {Blob()}), "");
}

TEST(LampColours, InvalidColoursNameLampAndField) {
  for (const Eigen::Vector3d& colour :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(-0.1, 1, 1), Eigen::Vector3d(NAN, 1, 1)}) {
    Scene scene = test::irregular_room();
    scene.lamps[2].colour = colour;
    const std::string text = complaint([&] { scene.validate(); });
    EXPECT_NE(text.find("lamp 2"), std::string::npos) << text;
    EXPECT_NE(text.find("colour"), std::string::npos) << text;
  }
  Scene scene = test::irregular_room();
  scene.lamps[1].colour_sigma = 0;
  EXPECT_NE(complaint([&] { scene.validate(); }).find("colour_sigma"), std::string::npos);
}

TEST(LampColours, FilesKeepTheSigma) {
  Scene scene = test::irregular_room();
  scene.lamps[3].colour = green;
  scene.lamps[3].colour_sigma = 0.12;
  const Scene read = parse_scene(format_scene(scene));
  EXPECT_EQ(read.lamps[3].colour, green);
  EXPECT_EQ(read.lamps[3].colour_sigma, 0.12);
  EXPECT_EQ(read.lamps[0].colour_sigma, 0.3);
}

}  // namespace
}  // namespace occ
