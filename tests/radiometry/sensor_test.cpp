// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::complaint;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
double degrees(double value) { return value * pi / 180; }
double dbm(double watt) { return 10 * std::log10(watt / 1e-3); }

// Lamp of the 802.15 contribution: 170 mm, half power at 70 degrees, 1500 mW; at 1.5 m.
struct Contribution : ::testing::Test {
  const double power_w = 1.5, distance_m = 1.5, radius_m = 0.085;
  const double area_m2 = pi * radius_m * radius_m;
  const double order = lambertian_order(degrees(70));
};

TEST_F(Contribution, LambertianOrder) {
  EXPECT_NEAR(order, 0.64606, 5e-6);
  EXPECT_NEAR(lambertian_order(degrees(60)), 1, 1e-15);
}

TEST_F(Contribution, IntensityIrradianceRadiance) {
  const double intensity = radiant_intensity(power_w, order, 1);
  EXPECT_NEAR(intensity, 0.39297, 5e-6);
  EXPECT_NEAR(intensity / (distance_m * distance_m), 0.17465, 5e-6);
  EXPECT_NEAR(radiance(power_w, order, area_m2, 1), 17.313, 5e-4);
}

TEST_F(Contribution, ReceivedPower) {
  const auto received_dbm = [&](double aperture_m2) {
    return dbm(aperture_power(power_w, order, 1, 1, distance_m, aperture_m2));
  };
  const auto lens_m2 = [](double focal_length_m) {
    return pi / 4 * std::pow(focal_length_m / 2, 2);
  };
  EXPECT_NEAR(received_dbm(1e-4), -17.58, 5e-3);
  EXPECT_NEAR(received_dbm(lens_m2(1.4e-3)), -41.73, 5e-3);
  EXPECT_NEAR(received_dbm(lens_m2(3e-3)), -35.11, 5e-3);
}

TEST_F(Contribution, HalfOfTheDefaultFullWell) {
  const Sensor sensor;
  const double irradiance =
      sensor_irradiance(radiance(power_w, order, area_m2, 1), sensor.f_number, 1);
  EXPECT_NEAR(sensor.electrons(irradiance) / sensor.full_well_e, 0.5, 0.05);
}

// A small disc parallel to the sensor: the power on its image equals the power through the lens.
TEST_F(Contribution, PowerOnTheImageEqualsPowerThroughTheAperture) {
  const double focal_length_m = 3e-3, f_number = 2;
  const double lens_m2 = pi / 4 * std::pow(focal_length_m / f_number, 2);
  const double image_m2 = area_m2 * std::pow(focal_length_m / distance_m, 2);
  for (const double psi : {0.0, 0.3, 0.9, 1.4}) {
    const double c = std::cos(psi);
    const double by_image =
        image_m2 * sensor_irradiance(radiance(power_w, order, area_m2, c), f_number, c);
    const double by_lens = aperture_power(power_w, order, c, c, distance_m / c, lens_m2);
    EXPECT_NEAR(by_image / by_lens, 1, 1e-12) << "psi " << psi;
  }
}

TEST(Lambertian, PowerIsTheIntegralOfIntensity) {
  for (const double half_deg : {10.0, 45.0, 60.0, 70.0, 85.0}) {
    const double order = lambertian_order(degrees(half_deg));
    const int n = 20000;
    double sum = 0;  // midpoint rule over cos(phi): dOmega = 2 pi d cos(phi)
    for (int i = 0; i < n; ++i) sum += radiant_intensity(2.5, order, (i + 0.5) / n);
    EXPECT_NEAR(2 * pi * sum / n, 2.5, 1e-4) << half_deg;
  }
}

TEST(Lambertian, HalfPowerIsHalf) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const double half = random.uniform(1e-6, degrees(89.9));
    const double order = lambertian_order(half);
    const double ratio =
        radiant_intensity(1, order, std::cos(half)) / radiant_intensity(1, order, 1);
    // cos^m: a relative rounding error of cos is multiplied by m.
    EXPECT_NEAR(ratio, 0.5, 1e-14 + 4e-16 * order) << half;
  }
}

TEST(Lambertian, DarkBehindTheLampAndBehindTheCamera) {
  EXPECT_EQ(radiant_intensity(1, 1, 0), 0);
  EXPECT_EQ(radiant_intensity(1, 0.6, -0.5), 0);
  EXPECT_EQ(radiance(1, 0.6, 0.1, -0.5), 0);
  EXPECT_EQ(radiance(1, 0.6, 0.1, 0), 0);
  EXPECT_EQ(aperture_power(1, 1, -0.1, 1, 2, 1e-4), 0);
  EXPECT_EQ(aperture_power(1, 1, 1, -0.1, 2, 1e-4), 0);
  EXPECT_EQ(sensor_irradiance(1, 2, 0), 0);
  EXPECT_EQ(sensor_irradiance(1, 2, -0.1), 0);
}

TEST(Lambertian, RadianceIsBoundedAtGrazing) {
  EXPECT_EQ(radiance(1, 0.6, 0.1, 1e-9), radiance(1, 0.6, 0.1, 0.01));
  EXPECT_GT(radiance(1, 0.6, 0.1, 0.01), radiance(1, 0.6, 0.1, 0.02));
  EXPECT_EQ(radiance(1, 1, 0.1, 1e-9), radiance(1, 1, 0.1, 1)) << "order 1 does not diverge";
  EXPECT_LT(radiance(1, 2, 0.1, 1e-9), 1e-6) << "order 2 vanishes without a bound";
}

TEST(Lambertian, RejectsInvalidArguments) {
  EXPECT_EQ(complaint([] { lambertian_order(0); }), "half_power_rad must be in (0, pi/2), got 0");
  EXPECT_NE(complaint([] { lambertian_order(pi / 2); }), "");
  EXPECT_NE(complaint([] { lambertian_order(nan); }), "");
  EXPECT_EQ(complaint([] { radiance(1, 1, -2, 1); }), "area_m2 must be positive, got -2");
  EXPECT_EQ(complaint([] { aperture_power(1, 1, 1, 1, 0, 1); }),
            "distance_m must be positive, got 0");
  EXPECT_EQ(complaint([] { aperture_power(1, 1, 1, 1, 1, nan); }),
            "area_m2 must be positive, got nan");
  EXPECT_EQ(complaint([] { sensor_irradiance(1, 0, 1); }), "f_number must be positive, got 0");
}

TEST(SensorElectrons, AreCountedPhotons) {
  Sensor sensor;
  sensor.dark_current_e_per_s = 100;
  sensor.exposure_s = 0.01;
  // One photon of 550 nm carries 3.6117e-19 J.
  const double photons = 2e-3 * 7.1e-6 * 7.1e-6 * 0.01 / 3.61171e-19;
  EXPECT_NEAR(sensor.electrons(2e-3), 0.5 * photons + 1, 1e-5 * photons);
  EXPECT_DOUBLE_EQ(sensor.electrons(0), 1) << "dark current alone";
}

TEST(SensorNoise, FollowsEmva1288) {
  Sensor sensor;
  sensor.gain_dn_per_e = 0.1;
  sensor.read_noise_e = 7;
  EXPECT_DOUBLE_EQ(sensor.noise_dn(1000), std::sqrt(0.01 * (49 + 1000) + 1.0 / 12));
  EXPECT_DOUBLE_EQ(sensor.noise_dn(0), std::sqrt(0.49 + 1.0 / 12));
}

// Compares the formula with a simulation: Poisson electrons, normal read noise, rounding.
TEST(SensorNoise, AgreesWithSimulatedGreyLevels) {
  Sensor sensor;
  sensor.gain_dn_per_e = 0.1;
  Random random(2);
  const double mean_e = 500;
  const int n = 40000;
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double e = random.poisson(mean_e) + sensor.read_noise_e * random.normal();
    const double dn = std::round(sensor.black_level_dn + sensor.gain_dn_per_e * e);
    sum += dn;
    squares += dn * dn;
  }
  const double spread = std::sqrt(squares / n - (sum / n) * (sum / n));
  // The standard deviation of a standard deviation is sigma / sqrt(2 n): 4 of them.
  EXPECT_NEAR(spread / sensor.noise_dn(mean_e), 1, 4 / std::sqrt(2.0 * n));
}

struct ResponseCase {
  const char* name;
  Response response;
  double gamma;
  std::vector<double> table;
  double black;
  int bit_depth;
};

/// Printer for GoogleTest, which would otherwise print the bytes.
void PrintTo(const ResponseCase& response, std::ostream* out) { *out << response.name; }

class EveryResponse : public ::testing::TestWithParam<ResponseCase> {
 protected:
  static Sensor sensor() {
    Sensor s;
    s.response = GetParam().response;
    s.gamma = GetParam().gamma;
    s.response_table = GetParam().table;
    s.black_level_dn = GetParam().black;
    s.bit_depth = GetParam().bit_depth;
    // Full well lies above full scale: the whole range of grey levels is reachable.
    s.gain_dn_per_e = 1.25 * s.full_scale_dn() / s.full_well_e;
    s.validate();
    return s;
  }
};

TEST_P(EveryResponse, InvertsFromBlackToFullScale) {
  const Sensor s = sensor();
  const double range = s.full_scale_dn() - s.black_level_dn;
  for (int i = 0; i <= 1000; ++i) {
    const double electrons = i / 1000.0 * range / s.gain_dn_per_e;
    const double grey = s.grey_level(electrons);
    EXPECT_NEAR(s.linear_dn(grey), s.gain_dn_per_e * electrons, 1e-6 * range) << i;
    EXPECT_NEAR(s.grey_level(s.linear_dn(grey) / s.gain_dn_per_e), grey, 1e-6 * range) << i;
  }
}

TEST_P(EveryResponse, RisesStrictlyThenSaturates) {
  const Sensor s = sensor();
  const double at_full_scale_e = (s.full_scale_dn() - s.black_level_dn) / s.gain_dn_per_e;
  EXPECT_EQ(s.grey_level(0), s.black_level_dn);
  EXPECT_EQ(s.grey_level(-5), s.black_level_dn);
  double last = s.grey_level(0);
  for (int i = 1; i < 500; ++i) {
    const double grey = s.grey_level(i / 500.0 * at_full_scale_e);
    EXPECT_GT(grey, last) << i;
    last = grey;
  }
  for (const double beyond : {1.0, 1.1, 2.0, 1e9})
    EXPECT_DOUBLE_EQ(s.grey_level(beyond * at_full_scale_e), s.full_scale_dn()) << beyond;
}

TEST_P(EveryResponse, KeepsTheSignOfNoiseBelowBlack) {
  const Sensor s = sensor();
  double last = s.linear_dn(s.black_level_dn);
  EXPECT_NEAR(last, 0, 1e-12);
  for (int i = 1; i < 20; ++i) {
    const double linear = s.linear_dn(s.black_level_dn - i * 0.1);
    EXPECT_LT(linear, last);
    last = linear;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Radiometry, EveryResponse,
    ::testing::Values(ResponseCase{"linear", Response::linear, 2.2, {}, 2, 8},
                      ResponseCase{"linear16", Response::linear, 2.2, {}, 300, 16},
                      ResponseCase{"gamma", Response::gamma, 2.2, {}, 2, 8},
                      ResponseCase{"gamma_below_one", Response::gamma, 0.5, {}, 0, 12},
                      ResponseCase{"srgb", Response::srgb, 2.2, {}, 16, 10},
                      ResponseCase{"table", Response::table, 2.2, {0, 0.4, 0.7, 0.9, 1}, 3, 8},
                      ResponseCase{"table_of_two", Response::table, 2.2, {0, 1}, 0, 8}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(SensorResponse, KnownValues) {
  Sensor s;
  s.black_level_dn = 0;
  s.gain_dn_per_e = 255 / s.full_well_e;
  const auto stored = [&s](double linear) { return s.grey_level(linear * s.full_well_e) / 255; };
  s.response = Response::srgb;
  EXPECT_NEAR(stored(0.5), 0.735357, 1e-6);  // the standard's own curve
  EXPECT_NEAR(stored(0.002), 0.02584, 1e-12);
  s.response = Response::gamma;
  EXPECT_NEAR(stored(0.5), std::pow(0.5, 1 / 2.2), 1e-14);
  s.response = Response::table;
  s.response_table = {0, 0.6, 1};
  EXPECT_NEAR(stored(0.25), 0.3, 1e-14);
  EXPECT_NEAR(stored(0.75), 0.8, 1e-14);
}

TEST(SensorResponse, FullWellClipsBelowFullScale) {
  Sensor s;  // 10000 e at 0.025 DN/e and black level 2: 252 DN of 255
  EXPECT_DOUBLE_EQ(s.grey_level(s.full_well_e), 252);
  EXPECT_DOUBLE_EQ(s.grey_level(10 * s.full_well_e), 252);
}

TEST(SensorValidate, NamesFieldAndValue) {
  struct Case {
    const char* field;
    std::function<void(Sensor&)> spoil;
    const char* value;
  };
  const std::vector<Case> cases = {
      {"pixel_pitch_m", [](Sensor& s) { s.pixel_pitch_m = 0; }, "0"},
      {"f_number", [](Sensor& s) { s.f_number = -2; }, "-2"},
      {"exposure_s", [](Sensor& s) { s.exposure_s = nan; }, "nan"},
      {"quantum_efficiency", [](Sensor& s) { s.quantum_efficiency = 1.5; }, "1.5"},
      {"quantum_efficiency", [](Sensor& s) { s.quantum_efficiency = 0; }, "0"},
      {"wavelength_m", [](Sensor& s) { s.wavelength_m = -1; }, "-1"},
      {"full_well_e", [](Sensor& s) { s.full_well_e = 0; }, "0"},
      {"gain_dn_per_e", [](Sensor& s) { s.gain_dn_per_e = 1.0 / 0.0; }, "inf"},
      {"read_noise_e", [](Sensor& s) { s.read_noise_e = -3; }, "-3"},
      {"dark_current_e_per_s", [](Sensor& s) { s.dark_current_e_per_s = -1; }, "-1"},
      {"black_level_dn", [](Sensor& s) { s.black_level_dn = 255; }, "255"},
      {"black_level_dn", [](Sensor& s) { s.black_level_dn = -1; }, "-1"},
      {"bit_depth", [](Sensor& s) { s.bit_depth = 7; }, "7"},
      {"bit_depth", [](Sensor& s) { s.bit_depth = 17; }, "17"},
      {"gamma", [](Sensor& s) { s.gamma = 0; }, "0"},
      {"response_table", [](Sensor& s) { s.response = Response::table; }, "0"},
      {"response_table",
       [](Sensor& s) {
         s.response_table = {0.1, 1};
       },
       "0.1"},
      {"response_table",
       [](Sensor& s) {
         s.response_table = {0, 0.9};
       },
       "0.9"},
      {"response_table[2]",
       [](Sensor& s) {
         s.response_table = {0, 0.5, 0.5, 1};
       },
       "0.5"},
      {"response_table[1]",
       [](Sensor& s) {
         s.response_table = {0, nan, 1};
       },
       "nan"},
      {"row_time_s", [](Sensor& s) { s.row_time_s = -1e-5; }, "-1e-05"},
      {"psf_sigma_px", [](Sensor& s) { s.psf_sigma_px = 0; }, "0"},
  };
  EXPECT_NO_THROW(Sensor().validate());
  for (const Case& c : cases) {
    Sensor sensor;
    c.spoil(sensor);
    const std::string text = complaint([&] { sensor.validate(); });
    const std::string value = std::string("got ") + c.value;
    EXPECT_NE(text.find(std::string("sensor.") + c.field + " must be "), std::string::npos)
        << c.field << ": '" << text << "'";
    EXPECT_EQ(text.rfind(value), text.size() - value.size()) << c.field << ": '" << text << "'";
  }
}

}  // namespace
}  // namespace occ
