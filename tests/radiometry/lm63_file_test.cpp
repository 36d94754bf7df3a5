// SPDX-License-Identifier: Apache-2.0
// Parser of IES LM-63.
#include <gtest/gtest.h>

#include <sstream>

#include "libocc/core/math.hpp"
#include "libocc/radiometry/photometric_file.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace occ;

constexpr double deg = pi / 180;

// A body with 3 vertical angles and one plane, without the lines above TILT.
const char* const body = "1 1000 2 3 1 1 2 0.2 0.4 0\n0.5 1 20\n0 45 90\n0\n100 80 10\n";

PhotometricDistribution of(const std::string& text) { return parse_photometry(text, "room.ies"); }

std::string error_of(const std::string& text, const char* name = "room.ies") {
  try {
    parse_photometry(text, name);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Lm63File, ReadsAllVersions) {
  const std::vector<std::pair<std::string, std::string>> openings{
      {"", "LM-63-1986"},
      {"Luminaire of 1986\nsecond label\n", "LM-63-1986"},
      {"IESNA91\n[TEST] a\n", "LM-63-1991"},
      {"IESNA:LM-63-1991\n", "LM-63-1991"},
      {"IESNA:LM-63-1995\n[TEST] a\n", "LM-63-1995"},
      {"IESNA:LM-63-2002\r\n[TEST] a\r\n[MANUFAC] b\r\n", "LM-63-2002"},
      {"IES:LM-63-2019\n[TEST] a\n", "LM-63-2019"},
      {"\xEF\xBB\xBFIES:LM-63-2019\n[TEST] a\n", "LM-63-2019"}};
  for (const auto& [opening, format] : openings) {
    const PhotometricDistribution read = of(opening + "TILT=NONE\n" + body);
    EXPECT_EQ(read.source_format, format) << opening;
    ASSERT_EQ(read.vertical_rad.size(), 3u);
    EXPECT_NEAR(read.vertical_rad[1], 45 * deg, 1e-12);
    ASSERT_EQ(read.horizontal_rad.size(), 1u);
    EXPECT_DOUBLE_EQ(read.intensities_cd(1, 0), 80);  // times 2 times 0.5
    EXPECT_EQ(read.opening, OpeningShape::rectangle);
    EXPECT_EQ(read.size_m, Eigen::Vector2d(0.4, 0.2));  // length along C = 0
    EXPECT_EQ(*read.lamp_lm, 1000);
    EXPECT_EQ(*read.input_w, 20);
  }
  EXPECT_EQ(error_of("IESNA:LM-63-2031\nTILT=NONE\n" + std::string(body)),
            "room.ies:1: the version of LM-63 must be 1986, 1991, 1995, 2002 or 2019, got `2031`");
}

TEST(Lm63File, AppliesTheBallastLampFactorOfTheFirstTwoVersionsOnly) {
  const std::string text = replaced(body, "0.5 1 20", "0.5 3 20");
  EXPECT_DOUBLE_EQ(of("label\nTILT=NONE\n" + text).intensities_cd(0, 0), 300);
  EXPECT_DOUBLE_EQ(of("IESNA91\nTILT=NONE\n" + text).intensities_cd(0, 0), 300);
  EXPECT_DOUBLE_EQ(of("IESNA:LM-63-1995\nTILT=NONE\n" + text).intensities_cd(0, 0), 100);
  EXPECT_DOUBLE_EQ(of("IES:LM-63-2019\nTILT=NONE\n" + text).intensities_cd(0, 0), 100);
}

TEST(Lm63File, KeepsKeywordsAndTheirContinuation) {
  const auto keywords = of("IESNA:LM-63-1995\n[TEST] a\n[MORE] b\n[OTHER]  30 \xB0 C\nTILT=NONE\n" +
                           std::string(body))
                            .keywords;
  ASSERT_EQ(keywords.size(), 2u);
  EXPECT_EQ(keywords[0].second, "a\nb");
  EXPECT_EQ(keywords[1].second, "30 \xC2\xB0 C");  // Latin-1 becomes UTF-8
}

TEST(Lm63File, NumbersContinueOverLinesAndAreSeparatedByBlanksOrCommas) {
  const PhotometricDistribution read =
      of("IESNA91\nTILT=NONE\n1,1000\n 1\t3, 1 1\r2 -.2 0. +0\n1 1 1e1 0\n45,,90 0 5\n\n4,3\n\x1a");
  EXPECT_DOUBLE_EQ(read.intensities_cd(2, 0), 3);
  EXPECT_EQ(*read.input_w, 10);
  EXPECT_EQ(read.opening, OpeningShape::ellipse);
}

TEST(Lm63File, ReadsTiltIncludedForAllGeometries) {
  for (int geometry = 1; geometry <= 3; ++geometry) {
    const PhotometricDistribution read = of("IESNA91\nTILT=INCLUDE\n" + std::to_string(geometry) +
                                            "\n3\n0 45\n90\n1 .9 .8\n" + body);
    ASSERT_TRUE(read.tilt.has_value());
    EXPECT_EQ(read.tilt->geometry, geometry);
    EXPECT_NEAR(read.tilt->tilt_rad.back(), pi / 2, 1e-12);
    EXPECT_EQ(read.tilt->factors, (std::vector<double>{1, 0.9, 0.8}));
    EXPECT_DOUBLE_EQ(read.intensities_cd(0, 0), 100);
  }
  EXPECT_EQ(error_of("IESNA91\nTILT=INCLUDE\n4\n3\n0 45 90\n1 .9 .8\n" + std::string(body)),
            "room.ies:3: lamp-to-luminaire geometry must be a whole number in [1, 3], got 4");
}

TEST(Lm63File, ReadsTheTiltFileBesideIt) {
  const test::Folder folder;
  const std::string path =
      folder.file("lamp.ies", "IESNA91\nTILT=C:\\DATA\\mh.tlt\n" + std::string(body));
  try {
    read_photometry(path);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find(path + ":2: the file of `TILT=C:\\DATA\\mh.tlt` is needed beside this one"),
              0u)
        << text;
  }
  folder.file("mh.tlt", "2\n2\n0 90\n1 0.7\n");
  const PhotometricDistribution read = read_photometry(path);
  EXPECT_EQ(read.tilt->geometry, 2);
  EXPECT_EQ(read.tilt->factors.back(), 0.7);
  EXPECT_EQ(read.file, path);
}

TEST(Lm63File, ConvertsFeet) {
  const std::string text = replaced(body, "1 2 0.2 0.4 0", "1 1 1 2 0.5");
  const PhotometricDistribution read = of("IESNA91\nTILT=NONE\n" + text);
  EXPECT_NEAR(read.size_m.x(), 0.6096, 1e-12);
  EXPECT_NEAR(read.height_m, 0.1524, 1e-12);
}

TEST(Lm63File, ReadsTheCodesOfTheLuminousOpening) {
  struct Case {
    const char *version, *opening;
    OpeningShape shape;
    Eigen::Vector2d size_m;
  };
  const OpeningShape point = OpeningShape::point, rectangle = OpeningShape::rectangle,
                     ellipse = OpeningShape::ellipse, sideways = OpeningShape::sideways;
  const std::vector<Case> cases{
      {"1995", "0 0 0", point, {0, 0}},
      {"1995", "0.2 0.4 0.1", rectangle, {0.4, 0.2}},
      {"1995", "-0.2 0 0", ellipse, {0.2, 0.2}},       // circle
      {"1995", "-0.2 0 -0.2", ellipse, {0.2, 0.2}},    // sphere
      {"1995", "-0.2 0 0.3", ellipse, {0.2, 0.2}},     // vertical cylinder
      {"1995", "0 0.9 -0.1", rectangle, {0.9, 0.1}},   // horizontal cylinder along the length
      {"1995", "0.9 0 -0.1", rectangle, {0.1, 0.9}},   // horizontal cylinder along the width
      {"1995", "-0.2 0.4 0", ellipse, {0.4, 0.2}},     // ellipse along the length
      {"1995", "0.4 -0.2 0", ellipse, {0.2, 0.4}},     // ellipse along the width
      {"1995", "-0.2 0.4 -0.1", ellipse, {0.4, 0.2}},  // ellipsoid
      {"2002", "0 0 0", point, {0, 0}},
      {"2002", "-0.2 -0.2 0", ellipse, {0.2, 0.2}},      // circle
      {"2002", "-0.2 -0.4 0", ellipse, {0.4, 0.2}},      // ellipse
      {"2002", "-0.2 -0.2 0.3", ellipse, {0.2, 0.2}},    // vertical cylinder
      {"2002", "-0.2 -0.2 -0.2", ellipse, {0.2, 0.2}},   // sphere
      {"2002", "-0.1 0.9 -0.1", rectangle, {0.9, 0.1}},  // horizontal cylinder along C = 0
      {"2002", "0.9 -0.1 -0.1", rectangle, {0.1, 0.9}},  // horizontal cylinder across
      {"2002", "-0.2 0 -0.2", sideways, {0, 0}},         // vertical circle
      {"2019", "0.2 0 0.2", sideways, {0, 0}},           // vertical rectangle
  };
  for (const Case& c : cases) {
    const std::string opening = std::string(c.version) == "2019" ? "IES:LM-63-" : "IESNA:LM-63-";
    const PhotometricDistribution read =
        of(opening + c.version + "\nTILT=NONE\n" + replaced(body, "0.2 0.4 0", c.opening));
    EXPECT_EQ(read.opening, c.shape) << c.version << " " << c.opening;
    EXPECT_TRUE(read.size_m.isApprox(c.size_m)) << c.version << " " << c.opening;
  }
}

TEST(Lm63File, ExpandsTheSymmetryOfTheHorizontalAngles) {
  const std::vector<double> gamma = test::steps_deg(10, 90);
  // Depends on C through functions with the symmetry of each range.
  const auto full = [](double g, double c) { return 10 + g + std::cos(c) + 2 * std::sin(c); };
  const auto about_0 = [](double g, double c) { return 10 + g + std::cos(c); };
  const auto about_90 = [](double g, double c) { return 10 + g + std::sin(c); };
  const auto quarter = [](double g, double c) { return 10 + g + std::cos(2 * c); };
  const auto expect = [&](const test::Intensity& intensity, const std::vector<double>& c_deg) {
    const PhotometricDistribution read = of(test::lm63_text(intensity, gamma, c_deg));
    ASSERT_EQ(read.horizontal_rad.size(), 24u);
    for (std::size_t j = 0; j < 24; ++j) {
      EXPECT_NEAR(read.horizontal_rad[j], static_cast<double>(j) * 15 * deg, 1e-9);
      for (std::size_t i = 0; i < gamma.size(); ++i)
        EXPECT_NEAR(read.intensities_cd(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                    intensity(gamma[i] * deg, read.horizontal_rad[j]), 1e-9);
    }
  };
  expect(full, test::steps_deg(15, 360));
  expect(full, test::steps_deg(15, 345));  // written without the repetition of C = 0
  expect(about_0, test::steps_deg(15, 180));
  expect(quarter, test::steps_deg(15, 90));
  std::vector<double> side;
  for (double c = 90; c <= 270; c += 15) side.push_back(c);
  expect(about_90, side);
}

// A type B file of 1 + sin(vertical) cos(horizontal) is 1 + sin(gamma) cos(C), and its horizontal
// angles lie clockwise, at C = 270 degrees.
TEST(Lm63File, ConvertsTypesAAndB) {
  for (const bool type_b : {true, false}) {
    const std::vector<double> angles = test::steps_deg(5, 180);
    std::vector<double> both;
    for (const double a : angles) both.push_back(a - 90);
    std::ostringstream text;
    text << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 37 37 " << (type_b ? 2 : 3) << " 2 0 0 0\n1 1 1\n"
         << test::joined_numbers(both, " ") << "\n"
         << test::joined_numbers(both, " ") << "\n";
    for (const double h : both) {
      for (const double v : both) {
        const double up = type_b ? std::sin(v * deg) * std::cos(h * deg) : std::sin(v * deg);
        const double right = type_b ? std::sin(h * deg) : std::cos(v * deg) * std::sin(h * deg);
        text << 100 * (2 + up + 0.5 * right) << " ";
      }
      text << "\n";
    }
    const PhotometricDistribution read = of(text.str());
    EXPECT_FALSE(read.lamp_lm.has_value());
    for (std::size_t i = 0; i < read.vertical_rad.size(); i += 7)
      for (std::size_t j = 0; j < read.horizontal_rad.size(); j += 5) {
        const double gamma = read.vertical_rad[i], c = read.horizontal_rad[j];
        const double expected =
            100 * (2 + std::sin(gamma) * std::cos(c) - 0.5 * std::sin(gamma) * std::sin(c));
        EXPECT_NEAR(read.intensities_cd(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                    expected, 0.05);
      }
  }
}

TEST(Lm63File, ErrorsNameFileLineAndItem) {
  const std::string good = "IESNA91\nTILT=NONE\n" + std::string(body);
  const std::vector<std::pair<std::string, std::string>> cases{
      {replaced(good, "100 80 10", "100 80 -5"),
       "room.ies:7: candela value 3 of plane 1 must not be negative, got -5"},
      {replaced(good, "100 80 10", "100 80"),
       "room.ies:7: the file ends before candela value 3 of plane 1"},
      {replaced(good, "100 80 10", "100 nan 10"),
       "room.ies:7: candela value 2 of plane 1 must be a finite number, got `nan`"},
      {replaced(good, "100 80 10", "100 80 10 7"),
       "room.ies:7: unexpected `7` after the last candela value"},
      {replaced(good, "0 45 90", "0 45 45"),
       "room.ies:5: vertical angle 3 must be greater than the one before, 45, got 45"},
      {replaced(good, "0 45 90", "0 45 80"),
       "room.ies:5: the vertical angles must be 0 to 90, 0 to 180 or 90 to 180, got 0 to 80"},
      {replaced(good, "2 3 1 1 2", "2 0 1 1 2"),
       "room.ies:3: number of vertical angles must be a whole number in [2, 10000], got 0"},
      {replaced(good, "2 3 1 1 2", "2 3 9000000000 1 2"),
       "room.ies:3: number of horizontal angles must be a whole number in [1, 10000], got "
       "9e+09"},
      {replaced(good, "2 3 1 1 2", "2 9999 9999 1 2"),
       "room.ies:3: the file must have at most 4000000 candela values, got 9999 x 9999"},
      {replaced(good, "2 3 1 1 2", "0 3 1 1 2"),
       "room.ies:3: candela multiplier must be positive, got 0"},
      {replaced(good, "2 3 1 1 2", "2 3 1 4 2"),
       "room.ies:3: photometric type must be a whole number in [1, 3], got 4"},
      {replaced(good, "2 3 1 1 2", "2 3 1 1 3"),
       "room.ies:3: units type must be a whole number in [1, 2], got 3"},
      {replaced(good, "0.5 1 20", "0.5 x 20"),
       "room.ies:4: ballast-lamp photometric factor must be a finite number, got `x`"},
      {replaced(good, "TILT=NONE", "TILT"), "room.ies:7: the file ends before the line `TILT=`"},
      {replaced(good, "\n0\n", "\n30\n"),
       "room.ies:6: the horizontal angles must be only 0, or 0 to 90, 0 to 180, 90 to 270, or 0 to "
       "at most 360, got 30 to 30"},
      {replaced(good, "100 80 10", "0 0 0"),
       "room.ies: intensities_cd must be above zero in some direction, got 0"},
      {"", "room.ies:1: is empty"},
      {" \n\n", "room.ies:1: is empty"},
      {std::string("\x7f"
                   "ELF\x02\x01\x00\x00",
                   8),
       "room.ies:1: is no photometric file: it contains the byte 2"}};
  for (const auto& [text, message] : cases) EXPECT_EQ(error_of(text), message);
  EXPECT_EQ(error_of("lamps:\n  - id: 1\n", "room.yaml").find("room.yaml:1: is neither"), 0u);
}

TEST(Lm63File, NeitherTruncationsNorRandomBytesCrash) {
  const std::string good =
      test::lm63_text(test::batwing, test::steps_deg(15, 90), test::steps_deg(45, 360));
  int accepted = 0;
  for (std::size_t size = 0; size < good.size(); ++size)
    accepted += error_of(good.substr(0, size)) == "none" ? 1 : 0;
  EXPECT_LE(accepted, 16);  // only the last number may be cut, or the line's end
  std::uint32_t state = 1;
  const auto next = [&state] { return (state = state * 1664525u + 1013904223u) >> 8; };
  for (int round = 0; round < 3000; ++round) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[next() % text.size()] = static_cast<char>(next() % 256);
    const std::string error = error_of(text);
    EXPECT_TRUE(error == "none" || error.find("room.ies:") == 0) << error;
    if (error != "none") continue;
    try {
      const EmissionProfile profile(of(text));
      EXPECT_TRUE(std::isfinite(profile.density({0, 0, 1})));
      EXPECT_GE(profile.density({0.6, 0, 0.8}), 0);
    } catch (const std::invalid_argument&) {
      // The changed number removed the light.
    }
  }
}

TEST(PhotometricDistribution, FluxOfACosineIsPi) {
  const PhotometricDistribution read =
      of(test::lm63_text(test::cosine_power(1), test::steps_deg(1, 90), {0}));
  EXPECT_NEAR(read.flux_lm(), 1000 * pi, 0.3);
}

}  // namespace
