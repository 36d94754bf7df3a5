// SPDX-License-Identifier: Apache-2.0
// Response curves from rendered exposure series, against the sensors that rendered them.
#include "libocc/photometry/response.hpp"

#include <functional>

#include "libocc/radiometry/response_basis.hpp"
#include "tests/photometry/response_support.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

/// Largest difference between a recovered table and the sensor's curve, above a linear value.
double table_error(const ChannelResponse& channel, const Sensor& sensor, double from) {
  const std::vector<double> table = channel.table();
  const double range_dn = sensor.full_scale_dn() - sensor.black_level_dn;
  double worst = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double linear = static_cast<double>(i) / static_cast<double>(table.size() - 1);
    if (linear < from) continue;
    const double stored =
        (sensor.grey_level(linear * range_dn / sensor.gain_dn_per_e) - sensor.black_level_dn) /
        range_dn;
    worst = std::max(worst, std::abs(stored - table[i]));
  }
  return worst;
}

/// Sum over levels of the squared normalised errors of g.
double squared_errors(const ChannelResponse& channel, const Sensor& sensor,
                      const std::vector<double>& levels) {
  const auto at = [&](double level) {
    return std::lower_bound(channel.level_dn.begin(), channel.level_dn.end(), level) -
           channel.level_dn.begin();
  };
  const auto truth = [&](Eigen::Index k) {
    return std::log(sensor.linear_dn(channel.level_dn[k]));
  };
  Eigen::Index middle = 0;
  channel.log_exposure.cwiseAbs().minCoeff(&middle);
  double sum = 0;
  for (const double level : levels) {
    const Eigen::Index k = at(level);
    const double error = channel.log_exposure[k] - (truth(k) - truth(middle));
    sum += error * error / channel.covariance(k, k);
  }
  return sum;
}

struct Trial {
  double nees = 0;  ///< mean over runs and levels
  double chi2 = 0, dof = 0;
};

Trial trial(const Scene& scene, const ResponseOptions& options, int images, double factor, int runs,
            const std::vector<double>& levels) {
  Trial sum;
  for (int run = 0; run < runs; ++run) {
    const auto series =
        test::exposure_series(scene, images, factor, static_cast<std::uint64_t>(run) + 1);
    const auto found = recover_response(series.views(), series.exposures_s, options);
    EXPECT_TRUE(found.ok()) << found.message;
    if (!found.ok()) return sum;
    const ChannelResponse& channel = found->channels[0];
    sum.nees +=
        squared_errors(channel, scene.sensor, levels) / static_cast<double>(levels.size()) / runs;
    sum.chi2 += channel.chi2;
    sum.dof += channel.dof;
  }
  return sum;
}

TEST(Response, RecoversCurves) {
  for (const Response kind : {Response::linear, Response::gamma, Response::srgb}) {
    SCOPED_TRACE(static_cast<int>(kind));
    const Scene scene = test::wall_of_lamps(kind);
    const auto series = test::exposure_series(scene, 5);
    const auto found = recover_response(series.views(), series.exposures_s);
    ASSERT_TRUE(found.ok()) << found.message;
    ASSERT_EQ(found->channels.size(), 1U);
    const ChannelResponse& channel = found->channels[0];
    EXPECT_EQ(channel.variance_factor, 1);
    EXPECT_LT(table_error(channel, scene.sensor, 0.02), 0.02);
    EXPECT_EQ(channel.log_exposure.cwiseAbs().minCoeff(), 0) << "at the middle level";
    const Sensor sensor = with_response(scene.sensor, found.value);
    EXPECT_NO_THROW(sensor.validate());
    EXPECT_EQ(sensor.response, Response::table);
  }
}

// Power laws and the sRGB curve are smoother than the prior assumes, so their errors are smaller
// than their sigmas, which include the prior.
TEST(Response, SigmasOfLevelsBoundTheErrors) {
  const std::vector<double> levels{60, 90, 170, 230};
  for (const Response kind : {Response::linear, Response::gamma, Response::srgb}) {
    const Trial t = trial(test::wall_of_lamps(kind), {}, 5, 1.7, 2, levels);
    EXPECT_LT(t.nees, 1.5);
    EXPECT_GT(t.nees, 0.01);
    EXPECT_NEAR(t.chi2 / t.dof, 1, 0.06);
  }
}

/// Table whose exponent is a random walk over the light, drawn from the prior with lambda = 1.
std::vector<double> random_curve(Random& random) {
  constexpr int points = 4000;
  for (;;) {
    std::vector<double> log_x{std::log(1.0 / 256)}, slopes;
    double slope = random.uniform(0.8, 2), lowest = slope, highest = slope, g = 0;
    std::vector<double> stored, log_linear;
    for (int i = 0; i <= points; ++i) {
      const double z = std::exp((i - points) * std::log(256.0) / points);
      const double hat = std::max(0.02, 1 - std::abs(2 * z - 1));
      const double step = std::log(256.0) / points;
      stored.push_back(z);
      log_linear.push_back(g);
      if (z > 0.15) slope += random.normal() * std::sqrt(step) / hat;
      g += slope * step;
      lowest = std::min(lowest, slope);
      highest = std::max(highest, slope);
    }
    if (lowest < 0.3 || highest > 6) continue;
    std::vector<double> table(16384, 0.0);
    std::size_t k = 1;
    for (std::size_t i = 1; i < table.size(); ++i) {
      const double at = std::log(static_cast<double>(i) / 16383.0) + log_linear.back();
      if (at <= log_linear.front()) {
        table[i] = stored[0] * std::exp((at - log_linear.front()) / 1.5);
        continue;
      }
      while (k + 1 < log_linear.size() && log_linear[k] < at) ++k;
      const double part = (at - log_linear[k - 1]) / (log_linear[k] - log_linear[k - 1]);
      table[i] = stored[k - 1] + part * (stored[k] - stored[k - 1]);
    }
    table.back() = 1;
    return table;
  }
}

// Curves drawn from the prior, except those with a nearly zero slope: normalised chi-square near 1.
TEST(SlowResponse, SigmasOfLevelsMatchTheErrorsOfCurvesOfThePrior) {
  Random random(3);
  const std::vector<double> levels{60, 90, 170, 210};
  constexpr int curves = 40;
  double nees = 0;
  for (int i = 0; i < curves; ++i) {
    Scene scene = test::wall_of_lamps(Response::table);
    scene.sensor.response_table = random_curve(random);
    nees += trial(scene, {}, 5, 1.7, 1, levels).nees / curves;
  }
  EXPECT_GT(nees, 0.4);
  EXPECT_LT(nees, 1.7);
}

TEST(Response, TwoExposuresSufficeForTheBasis) {
  ResponseOptions options;
  options.method = ResponseMethod::basis;
  const std::vector<double> coefficients{0.1, -0.03, 0.02};
  Scene scene = test::wall_of_lamps(Response::table);
  scene.sensor.response_table = response_curve(coefficients, 16384);
  constexpr int runs = 10;
  double nees = 0;
  for (std::uint64_t run = 1; run <= runs; ++run) {
    const auto series = test::exposure_series(scene, 2, 4, run);
    const auto found = recover_response(series.views(), series.exposures_s, options);
    ASSERT_TRUE(found.ok()) << found.message;
    const ChannelResponse& channel = found->channels[0];
    EXPECT_EQ(channel.variance_factor, 1);
    const Eigen::Vector3d error = Eigen::Map<const Eigen::Vector3d>(channel.coefficients.data()) -
                                  Eigen::Map<const Eigen::Vector3d>(coefficients.data());
    nees += test::nees(error, channel.coefficient_covariance);
    EXPECT_LT(table_error(channel, scene.sensor, 0), 0.01);
  }
  const auto interval = test::chi2_interval(3 * runs, 3.3);
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
}

TEST(Response, ReportsWrongExposureTimes) {
  const auto series = test::exposure_series(test::wall_of_lamps(Response::gamma), 5, 1.7);
  std::vector<double> exposures_s = series.exposures_s;
  exposures_s[2] *= 1.1;
  for (const ResponseMethod method : {ResponseMethod::levels, ResponseMethod::basis}) {
    ResponseOptions options;
    options.method = method;
    options.basis_functions = 5;
    const auto right = recover_response(series.views(), series.exposures_s, options);
    const auto wrong = recover_response(series.views(), exposures_s, options);
    ASSERT_TRUE(right.ok() && wrong.ok());
    EXPECT_EQ(right->channels[0].variance_factor, 1);
    EXPECT_GT(wrong->channels[0].variance_factor, 2);
    EXPECT_NE(wrong.message.find("exposure times"), std::string::npos);
    EXPECT_GT(wrong->channels[0].sigma().mean(), right->channels[0].sigma().mean());
  }
}

TEST(Response, OnlyRatiosOfExposureTimesCount) {
  auto series = test::exposure_series(test::wall_of_lamps(Response::srgb), 4);
  const auto one = recover_response(series.views(), series.exposures_s);
  for (double& t : series.exposures_s) t *= 1000;
  const auto other = recover_response(series.views(), series.exposures_s);
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_TRUE(one->channels[0].log_exposure.isApprox(other->channels[0].log_exposure, 1e-6));
}

TEST(Response, TwelveBits) {
  Scene scene = test::wall_of_lamps(Response::gamma);
  scene.sensor.bit_depth = 12;
  scene.sensor.gain_dn_per_e *= 16;
  scene.sensor.black_level_dn = 64;
  scene.sensor.full_well_e = 8000;  // below full scale; clipped pixels must be excluded
  ResponseOptions options;
  options.bit_depth = 12;
  options.black_level_dn = 64;
  const auto series = test::exposure_series(scene, 6, 1.7);
  const auto found = recover_response(series.views(), series.exposures_s, options);
  ASSERT_TRUE(found.ok()) << found.message;
  const ChannelResponse& channel = found->channels[0];
  EXPECT_LE(channel.level_dn.size(), 256);
  EXPECT_EQ(channel.level_dn[0], 65);
  EXPECT_EQ(channel.level_dn[channel.level_dn.size() - 1], 4095);
  EXPECT_LT(channel.highest_dn, scene.sensor.grey_level(8000));
  EXPECT_EQ(channel.variance_factor, 1);
  scene.sensor.full_well_e = 1e9;  // no saturation below full scale
  EXPECT_LT(table_error(channel, scene.sensor, 0.05), 0.02);
  EXPECT_LT(squared_errors(channel, scene.sensor, {900, 1500, 3000}), 11);
}

TEST(Response, TreatsThreeChannelsSeparately) {
  const std::vector<double> gammas{1.6, 2.0, 2.4};  // red, green, blue
  Scene scene = test::wall_of_lamps(Response::gamma);
  test::Series series;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    scene.sensor.gamma = gammas[channel];
    const auto one = test::exposure_series(scene, 5, 1.7, channel + 1);
    series.exposures_s = one.exposures_s;
    series.images.resize(5);
    for (std::size_t j = 0; j < 5; ++j) {
      Image& image = series.images[j];
      image.width = one.images[j].width;
      image.height = one.images[j].height;
      image.channels = 3;
      image.u8.resize(3 * one.images[j].u8.size());
      for (std::size_t i = 0; i < one.images[j].u8.size(); ++i)
        image.u8[3 * i + channel] = one.images[j].u8[i];
    }
  }
  const auto found = recover_response(series.views(), series.exposures_s);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->channels.size(), 3U);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    scene.sensor.gamma = gammas[channel];
    EXPECT_LT(table_error(found->channels[channel], scene.sensor, 0.05), 0.02);
  }
  EXPECT_NE(test::complaint([&] { with_response(Sensor{}, found.value); }).find("mosaic"),
            std::string::npos);
  Sensor sensor;
  sensor.mosaic = Mosaic::rggb;
  sensor = with_response(sensor, found.value);
  EXPECT_NO_THROW(sensor.validate());
  EXPECT_EQ(sensor.channels[0].response_table, found->channels[0].table()) << "red comes first";
}

TEST(Response, ReportsAnUndeterminedCurve) {
  const Scene scene = test::wall_of_lamps();
  const auto expect_degenerate = [](const test::Series& series, const std::string& text,
                                    const ResponseOptions& options = {}) {
    const auto found = recover_response(series.views(), series.exposures_s, options);
    EXPECT_EQ(found.status, Status::degenerate);
    EXPECT_NE(found.message.find(text), std::string::npos) << found.message;
    EXPECT_TRUE(found->channels.empty());
  };
  expect_degenerate(test::exposure_series(scene, 2, 2), "2 different exposure times");
  test::Series same = test::exposure_series(scene, 3, 1);
  expect_degenerate(same, "1 different exposure times");
  ResponseOptions basis;
  basis.method = ResponseMethod::basis;
  expect_degenerate(same, "1 different exposure times", basis);
  expect_degenerate(test::exposure_series(scene, 3, 2, 1, 0.001), "neither black nor clipped");
  // Two groups of lamps with very different brightness, and almost equal exposure times.
  Scene apart = scene;
  for (std::size_t i = 0; i < apart.lamps.size(); ++i)
    apart.lamps[i].power_w = (i % 2 ? 3.5 : 35) * (1 + 0.002 * static_cast<double>(i));
  expect_degenerate(test::exposure_series(apart, 3, 1.1, 1, 50), "no patch links the levels below");
  // Texture everywhere.
  test::Series texture = test::exposure_series(scene, 3);
  Random random(1);
  for (Image& image : texture.images)
    for (auto& pixel : image.u8) pixel = static_cast<std::uint8_t>(random.uniform(1, 254));
  const auto found = recover_response(texture.views(), texture.exposures_s);
  EXPECT_TRUE(!found.ok() || found->channels[0].variance_factor > 1) << found.message;
}

TEST(Response, PicturesOfDifferentScenesAreDegenerate) {
  for (const ResponseMethod method : {ResponseMethod::levels, ResponseMethod::basis}) {
    Scene scene = test::wall_of_lamps(Response::srgb);
    test::Series series = test::exposure_series(scene, 4, 1.7);
    for (std::size_t i = 0; i < scene.lamps.size() / 2; ++i)  // other lamps are bright
      std::swap(scene.lamps[i].power_w, scene.lamps[scene.lamps.size() - 1 - i].power_w);
    series.images[2] = test::exposure_series(scene, 4, 1.7).images[2];
    ResponseOptions options;
    options.method = method;
    const auto found = recover_response(series.views(), series.exposures_s, options);
    EXPECT_EQ(found.status, Status::degenerate) << found.message;
    EXPECT_NE(found.message.find("images 0 and 2 show different scenes"), std::string::npos)
        << found.message;
  }
}

TEST(Response, RejectsLongerTimesWithDarkerImages) {
  test::Series series = test::exposure_series(test::wall_of_lamps(Response::gamma), 4);
  std::reverse(series.exposures_s.begin(), series.exposures_s.end());
  ResponseOptions options;
  options.method = ResponseMethod::basis;
  const auto found = recover_response(series.views(), series.exposures_s, options);
  EXPECT_EQ(found.status, Status::not_converged) << found.message;
  EXPECT_NE(found.message.find("no rising curve"), std::string::npos);
  const auto levels = recover_response(series.views(), series.exposures_s);
  EXPECT_TRUE(!levels.ok() || levels->channels[0].variance_factor > 100);
}

TEST(Response, RejectsInvalidInput) {
  test::Series series = test::exposure_series(test::wall_of_lamps(), 3);
  const auto expect_error = [&](const std::function<void(test::Series&, ResponseOptions&)>& change,
                                const std::string& text) {
    test::Series changed = series;
    ResponseOptions options;
    change(changed, options);
    const std::string said =
        test::complaint([&] { recover_response(changed.views(), changed.exposures_s, options); });
    EXPECT_NE(said.find(text), std::string::npos) << text << ": " << said;
  };
  expect_error([](auto& s, auto&) { s.images.resize(1); }, "images must be at least two, got 1");
  expect_error([](auto& s, auto&) { s.exposures_s.pop_back(); },
               "exposures_s must be one for each of 3");
  expect_error([](auto& s, auto&) { s.exposures_s[1] = 0; },
               "exposures_s[1] must be positive, got 0");
  expect_error([](auto& s, auto&) { s.exposures_s[2] = NAN; }, "exposures_s[2]");
  expect_error([](auto& s, auto&) { s.images[2].height /= 2, s.images[2].u8.resize(240 * 80); },
               "images[2]'s size must be that of images[0], 240 x 160, got 240 x 80");
  expect_error(
      [](auto& s, auto&) { s.images[1].channels = 3, s.images[1].u8.resize(3 * 240 * 160); },
      "images[1]'s channels");
  expect_error([](auto&, auto& o) { o.bit_depth = 12; }, "bit_depth must be 8 for 8-bit images");
  expect_error([](auto&, auto& o) { o.smoothness = 0; }, "smoothness");
  expect_error([](auto&, auto& o) { o.basis_functions = 9; }, "basis_functions");
  expect_error([](auto&, auto& o) { o.black_level_dn = 250; }, "black_level_dn");
  expect_error([](auto&, auto& o) { o.max_patches = 3; }, "max_patches");
  for (Image& image : series.images) {
    image.type = PixelType::u16;
    image.u16.assign(image.u8.begin(), image.u8.end());
    image.u8.clear();
  }
  expect_error([](auto&, auto&) {}, "bit_depth must be given for 16-bit images");
  expect_error([](auto& s, auto& o) { o.bit_depth = 10, s.images[1].u16[7] = 1024; },
               "images[1]'s brightest pixel must be at most 1023");
}

}  // namespace
}  // namespace occ
