// SPDX-License-Identifier: Apache-2.0
// Parser of EULUMDAT.
#include <gtest/gtest.h>

#include <sstream>

#include "libocc/core/math.hpp"
#include "libocc/radiometry/photometric_file.hpp"
#include "tests/support/photometry.hpp"

namespace {

using namespace occ;

constexpr double deg = pi / 180;

struct Ldt {
  int symmetry = 0, planes = 24;
  std::string area = "600\n300";  // length and width of the luminous area [mm]
  std::string factor = "1";
  int sets = 1;
  test::Intensity intensity = [](double g, double c) { return 10 + g + 2 * std::sin(c); };
};

std::vector<double> gamma_deg() { return test::steps_deg(15, 90); }

// The listed planes follow the format's Mc1 and Mc2: C 270 to 90 for the symmetry 3.
std::string text_of(const Ldt& ldt) {
  std::ostringstream out;
  const std::vector<double> gamma = gamma_deg();
  out << "company\n1\n"
      << ldt.symmetry << "\n"
      << ldt.planes << "\n"
      << 360.0 / ldt.planes << "\n"
      << gamma.size() << "\n15\nreport\nluminaire\nnumber\nfile.ldt\ndate\n1000\n500\n100\n"
      << ldt.area << "\n0\n0\n0\n0\n100\n80,5\n"
      << ldt.factor << "\n0\n"
      << ldt.sets << "\n";
  for (int i = 0; i < ldt.sets; ++i)
    out << "1\ntype\n" << 2000 + i << "\nwhite\n80\n" << 30 + i << "\n";
  for (int i = 0; i < 10; ++i) out << "0,5\n";
  const double step = 360.0 / ldt.planes;
  for (int i = 0; i < ldt.planes; ++i) out << i * step << "\n";
  out << test::joined_numbers(gamma, "\n") << "\n";
  const double first = ldt.symmetry == 3 ? 270 : 0;
  const double width = ldt.symmetry == 0   ? 360 - step
                       : ldt.symmetry == 1 ? 0
                       : ldt.symmetry == 4 ? 90
                                           : 180;
  for (double c = 0; c <= width; c += step)
    for (const double g : gamma) {
      std::ostringstream number;
      number.precision(10);
      number << ldt.intensity(g * deg, (first + c) * deg);
      std::string word = number.str();
      if (const auto dot = word.find('.'); dot != std::string::npos) word[dot] = ',';
      out << word << "\n";
    }
  return out.str();
}

std::string error_of(const std::string& text) {
  try {
    parse_photometry(text, "room.ldt");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

// Replaces line `number`, counted from 1.
std::string with_line(const std::string& text, int number, const std::string& line) {
  std::istringstream in(text);
  std::string out, current;
  for (int i = 1; std::getline(in, current); ++i) out += (i == number ? line : current) + "\n";
  return out;
}

TEST(EulumdatFile, ExpandsAllSymmetries) {
  const std::vector<std::pair<int, test::Intensity>> cases{
      {0, [](double g, double c) { return 10 + g + std::cos(c) + 2 * std::sin(c); }},
      {1, [](double g, double) { return 10 + g; }},
      {2, [](double g, double c) { return 10 + g + std::cos(c); }},
      {3, [](double g, double c) { return 10 + g + std::sin(c); }},
      {4, [](double g, double c) { return 10 + g + std::cos(2 * c); }}};
  for (const auto& [symmetry, intensity] : cases) {
    Ldt ldt;
    ldt.symmetry = symmetry;
    ldt.intensity = intensity;
    const PhotometricDistribution read = parse_photometry(text_of(ldt), "room.ldt");
    EXPECT_EQ(read.source_format, "EULUMDAT");
    ASSERT_EQ(read.horizontal_rad.size(), symmetry == 1 ? 1u : 24u);
    for (std::size_t j = 0; j < read.horizontal_rad.size(); ++j)
      for (std::size_t i = 0; i < read.vertical_rad.size(); ++i)
        EXPECT_NEAR(read.intensities_cd(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                    2 * intensity(read.vertical_rad[i], read.horizontal_rad[j]), 1e-6)
            << symmetry;  // per 1000 lm of 2000 lm
  }
}

TEST(EulumdatFile, ReadsAreaFactorsAndLampSets) {
  Ldt ldt;
  ldt.factor = "1,5";
  ldt.sets = 3;
  const PhotometricDistribution read = parse_photometry(text_of(ldt), "room.ldt");
  EXPECT_EQ(read.opening, OpeningShape::rectangle);
  EXPECT_TRUE(read.size_m.isApprox(Eigen::Vector2d(0.3, 0.6)));  // length along C = 90 degrees
  EXPECT_NEAR(*read.output_ratio, 0.805, 1e-12);
  EXPECT_NEAR(*read.downward_ratio, 1, 1e-12);
  EXPECT_EQ(*read.lamp_lm, 2000);  // the first set
  EXPECT_EQ(*read.input_w, 30);
  EXPECT_NEAR(read.intensities_cd(0, 0), 30, 1e-9);
  ldt.area = "170\n0";
  const PhotometricDistribution round = parse_photometry(text_of(ldt), "lamp");
  EXPECT_EQ(round.opening, OpeningShape::ellipse);
  EXPECT_TRUE(round.size_m.isApprox(Eigen::Vector2d(0.17, 0.17)));
  ldt.area = "0\n0";
  EXPECT_EQ(parse_photometry(text_of(ldt), "room.ldt").opening, OpeningShape::point);
}

TEST(EulumdatFile, ItemsWithoutInfluenceMayBeEmpty) {
  const PhotometricDistribution full = parse_photometry(text_of({}), "room.ldt");
  std::string text = text_of({});
  for (const int line : {5, 13, 14, 15, 18, 22, 23, 25, 32, 33, 42})
    text = with_line(text, line, "");
  const PhotometricDistribution read = parse_photometry(text, "room.ldt");
  EXPECT_EQ(read.intensities_cd, full.intensities_cd);
  EXPECT_FALSE(read.output_ratio.has_value());
  EXPECT_FALSE(read.input_w.has_value());
  EXPECT_EQ(error_of(with_line(text, 29, "")),
            "room.ldt:29: total luminous flux of lamp set 1 must be a finite number, got ``");
}

TEST(EulumdatFile, ErrorsNameFileLineAndItem) {
  const std::string good = text_of({});
  const std::vector<std::pair<std::string, std::string>> cases{
      {with_line(good, 3, "5"),
       "room.ldt:3: symmetry (Isym) must be a whole number in [0, 4], got 5"},
      {with_line(good, 4, "0"),
       "room.ldt:4: number of C planes (Mc) must be a whole number in [1, 10000], got 0"},
      {with_line(good, 24, "-1"),
       "room.ldt:24: conversion factor of the intensities must be positive, got -1"},
      {with_line(good, 29, "many"),
       "room.ldt:29: total luminous flux of lamp set 1 must be a finite number, got `many`"},
      {with_line(good, 44, "0"),
       "room.ldt:44: angle C 2 must be greater than the one before, 0, got 0"},
      {with_line(good, 76, "-3,5"),
       "room.ldt:76: intensity 3 of plane C 1 must not be negative, got -3.5"},
      {good + "1\n", "room.ldt:242: unexpected `1` after the last intensity"}};
  for (const auto& [text, message] : cases) EXPECT_EQ(error_of(text), message);
  Ldt odd;
  odd.symmetry = 4;
  odd.planes = 6;
  EXPECT_EQ(
      error_of(text_of(odd)),
      "room.ldt:48: the number of C planes must be a multiple of 4 for the symmetry 4, got 6");
}

TEST(EulumdatFile, NeitherTruncationsNorRandomBytesCrash) {
  Ldt small;
  small.symmetry = 4;
  small.planes = 8;
  const std::string good = text_of(small);
  ASSERT_EQ(error_of(good), "none");
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
    EXPECT_TRUE(error == "none" || error.find("room.ldt:") == 0) << error;
  }
}

}  // namespace
