// SPDX-License-Identifier: Apache-2.0
// Status, images, and random numbers; image files are in image_file_test.cpp.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/status.hpp"

namespace occ {
namespace {

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing thrown";
}

TEST(Products, HaveTheBlocksOfOneProcessorOnAll) {
  const std::array<std::ptrdiff_t, 3> expected{32768, 1048576, 8388608};
  EXPECT_EQ(internal::core::cache_bytes_of_products(), expected);
}

TEST(Status, EveryNameIsItsOwn) {
  std::set<std::string> names;
  for (const Status status :
       {Status::ok, Status::ambiguous, Status::no_lamps, Status::too_few_lamps, Status::no_pose,
        Status::degenerate, Status::not_converged, Status::budget_not_met}) {
    names.insert(to_string(status));
  }
  EXPECT_EQ(names.size(), 8u);
  EXPECT_EQ(names.count("unknown"), 0u);
  EXPECT_STREQ(to_string(Status::too_few_lamps), "too_few_lamps");
}

TEST(Require, NamesArgumentValueAndRule) {
  EXPECT_NO_THROW(require(true, "radius_m", 1.0, "positive"));
  EXPECT_EQ(message_of([] { require(false, "radius_m", -0.5, "positive"); }),
            "radius_m must be positive, got -0.5");
}

TEST(ImageView, RefusesWhatCannotBeAnImage) {
  const std::uint16_t pixels[8] = {};
  const ImageView good{pixels, 2, 1, 4, PixelType::u16, 16};
  EXPECT_NO_THROW(good.validate());
  const auto refuses = [&](const std::string& word, auto change) {
    ImageView bad = good;
    change(bad);
    const std::string message = message_of([&] { bad.validate("frame"); });
    EXPECT_NE(message.find("frame." + word), std::string::npos) << message;
  };
  refuses("data", [](ImageView& v) { v.data = nullptr; });
  refuses("width", [](ImageView& v) { v.width = 0; });
  refuses("height", [](ImageView& v) { v.height = -1; });
  refuses("channels", [](ImageView& v) { v.channels = 2; });
  refuses("row_bytes", [](ImageView& v) { v.row_bytes = 15; });
  refuses("data and row_bytes", [](ImageView& v) { v.row_bytes = 17; });
  refuses("data and row_bytes",
          [](ImageView& v) { v.data = static_cast<const char*>(v.data) + 1; });
}

TEST(Image, ViewShowsItsPixelsAndRefusesAWrongSize) {
  Image image;
  EXPECT_THROW(image.view().validate(), std::invalid_argument);
  image.width = 3;
  image.height = 2;
  image.u8 = {1, 2, 3, 4, 5, 6};
  const ImageView view = image.view();
  view.validate();
  EXPECT_EQ(view.row_bytes, 3u);
  EXPECT_EQ(view.data, image.u8.data());
  image.height = 3;
  EXPECT_THROW(image.view(), std::invalid_argument);
  image.type = PixelType::u16;
  EXPECT_THROW(image.view(), std::invalid_argument);
}

TEST(ToGrey, WeighsChannelsAlikeForBothOrdersAndIgnoresAlpha) {
  const std::uint8_t rgb[] = {10, 20, 31, 255, 255, 255, 0, 0, 0, /* padding */ 99, 99};
  const Image grey = to_grey({rgb, 3, 1, 3, PixelType::u8, 11});
  EXPECT_EQ(grey.u8, (std::vector<std::uint8_t>{20, 255, 0}));  // 81 / 4 rounds to 20
  const std::uint8_t bgr[] = {31, 20, 10};
  EXPECT_EQ(to_grey({bgr, 1, 1, 3, PixelType::u8, 3}).u8.at(0), 20);
  const std::uint8_t rounds_up[] = {10, 20, 32};
  EXPECT_EQ(to_grey({rounds_up, 1, 1, 3, PixelType::u8, 3}).u8.at(0), 21);
  const std::uint16_t deep[] = {65535, 65535, 65535, 1, 4, 8, 12, 60000};
  const Image deep_grey = to_grey({deep, 2, 1, 4, PixelType::u16, 16});
  EXPECT_EQ(deep_grey.type, PixelType::u16);
  EXPECT_EQ(deep_grey.u16, (std::vector<std::uint16_t>{65535, 8}));
}

TEST(ToGrey, CopiesAGreyViewWithoutItsPadding) {
  const std::uint16_t pixels[] = {1, 2, 77, 3, 4, 77};
  const Image grey = to_grey({pixels, 2, 2, 1, PixelType::u16, 6});
  EXPECT_EQ(grey.u16, (std::vector<std::uint16_t>{1, 2, 3, 4}));
  EXPECT_EQ(grey.view().row_bytes, 4u);
  EXPECT_THROW(to_grey({nullptr, 2, 2, 1, PixelType::u8, 2}), std::invalid_argument);
}

// Known answers published with the algorithm's reference implementation (Random123, kat_vectors).
TEST(Philox, KnownAnswers) {
  using Block = std::array<std::uint32_t, 4>;
  constexpr std::uint32_t ones = 0xffffffffu;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}),
            (Block{0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}));
  EXPECT_EQ(philox({ones, ones, ones, ones}, {ones, ones}),
            (Block{0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}));
  EXPECT_EQ(
      philox({0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u}, {0xa4093822u, 0x299f31d0u}),
      (Block{0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}));
}

TEST(Random, StreamIsPhiloxOverSeedAndStream) {
  Random random(0x0000000200000001u, 0x0000000400000003u);
  for (std::uint32_t block = 0; block < 3; ++block) {
    for (const std::uint32_t expected : philox({block, 0, 3, 4}, {1, 2})) {
      EXPECT_EQ(random.bits(), expected);
    }
  }
}

TEST(Random, UniformFillsItsIntervalEvenly) {
  Random random(1);
  constexpr int n = 200000;
  std::array<int, 16> bins{};
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    ASSERT_TRUE(u >= 0 && u < 1);
    ++bins[static_cast<std::size_t>(u * 16)];
  }
  double chi2 = 0;
  for (const int count : bins) chi2 += std::pow(count - n / 16.0, 2) / (n / 16.0);
  EXPECT_LT(chi2, 37.7);  // 99.9 % of 15 degrees of freedom
  for (int i = 0; i < 1000; ++i) {
    const double u = random.uniform(1, std::nextafter(1.0, 2.0));  // every sum rounds to an end
    ASSERT_EQ(u, 1);
  }
}

TEST(Random, NormalHasItsMomentsAndTails) {
  Random random(2);
  constexpr int n = 400000;
  double sum = 0, squares = 0, fourths = 0;
  int beyond = 0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
    beyond += std::abs(x) > 2.5758293035489004;
  }
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 4 * std::sqrt(2.0 / n));
  EXPECT_NEAR(fourths / n, 3, 4 * std::sqrt(96.0 / n));
  EXPECT_NEAR(beyond, 0.01 * n, 4 * std::sqrt(0.01 * n));
}

/// Chi-square of drawn counts against the Poisson law, as a normal score.
double poisson_score(double mean, int n) {
  Random random(3, static_cast<std::uint64_t>(mean * 1000));
  std::vector<int> counts;
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(random.poisson(mean));
    if (k >= counts.size()) counts.resize(k + 1);
    ++counts[k];
  }
  double chi2 = 0, tail_expected = n, tail_seen = n;
  int bins = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const auto count = static_cast<double>(k);
    const double expected = n * std::exp(count * std::log(mean) - mean - std::lgamma(count + 1));
    if (expected < 20) continue;
    chi2 += std::pow(counts[k] - expected, 2) / expected;
    tail_expected -= expected;
    tail_seen -= counts[k];
    ++bins;
  }
  if (tail_expected > 20) chi2 += std::pow(tail_seen - tail_expected, 2) / tail_expected;
  return (chi2 - bins) / std::sqrt(2.0 * bins);
}

TEST(Random, PoissonFollowsItsLawForSmallAndLargeMeans) {
  for (const double mean : {0.3, 3.0, 9.99, 10.0, 12.5, 40.0, 300.0}) {
    EXPECT_LT(std::abs(poisson_score(mean, 200000)), 4) << "mean " << mean;
  }
  Random random(4);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(random.poisson(0), 0);
  constexpr int n = 50000;
  constexpr double mean = 1e6;
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double z = (random.poisson(mean) - mean) / std::sqrt(mean);
    sum += z;
    squares += z * z;
  }
  EXPECT_NEAR(sum / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 4 * std::sqrt(2.0 / n));
}

TEST(Random, BelowIsUnbiased) {
  Random random(5);
  constexpr int range = 3 << 29;  // taking the remainder would favour the lower half two to one
  constexpr int n = 30000;
  int lower = 0;
  for (int i = 0; i < n; ++i) {
    const int value = random.below(range);
    ASSERT_TRUE(value >= 0 && value < range);
    lower += value < range / 2;
  }
  EXPECT_NEAR(lower, n / 2, 4 * std::sqrt(n / 4.0));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(random.below(1), 0);
}

TEST(Random, RefusesImpossibleArguments) {
  Random random(6);
  EXPECT_THROW(random.poisson(-1), std::invalid_argument);
  EXPECT_THROW(random.poisson(std::nan("")), std::invalid_argument);
  EXPECT_THROW(random.poisson(1e10), std::invalid_argument);
  EXPECT_THROW(random.below(0), std::invalid_argument);
}

}  // namespace
}  // namespace occ
