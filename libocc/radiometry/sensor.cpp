// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/srgb.hpp"
#include "libocc/radiometry/internal/sensor_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::radiometry;
namespace {

constexpr double planck_times_light = 6.62607015e-34 * 299792458.0;  // h c [J m], exact in SI

double table_encode(const std::vector<double>& table, double linear) {
  const double at = linear * static_cast<double>(table.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), table.size() - 2);
  return table[i] + (at - static_cast<double>(i)) * (table[i + 1] - table[i]);
}
double table_decode(const std::vector<double>& table, double stored) {
  const auto above = std::upper_bound(table.begin() + 1, table.end() - 1, stored);
  const auto i = static_cast<std::size_t>(above - table.begin()) - 1;
  return (static_cast<double>(i) + (stored - table[i]) / (table[i + 1] - table[i])) /
         static_cast<double>(table.size() - 1);
}

// Converts linear 0..1 to stored 0..1.
double encode(const Sensor& sensor, double linear) {
  switch (sensor.response) {
    case Response::gamma:
      return std::pow(linear, 1 / sensor.gamma);
    case Response::srgb:
      return internal::core::srgb_encode(linear);
    case Response::table:
      return table_encode(sensor.response_table, linear);
    case Response::automatic:
    case Response::linear:
      break;
  }
  return linear;
}

// Converts stored to linear. Noise below the black level stays negative, to preserve its mean as
// far as possible: the power law continues as an odd function, the others as straight lines.
double decode(const Sensor& sensor, double stored) {
  switch (sensor.response) {
    case Response::gamma:
      return std::copysign(std::pow(std::abs(stored), sensor.gamma), stored);
    case Response::srgb:
      return internal::core::srgb_decode(stored);
    case Response::table:
      return table_decode(sensor.response_table, stored);
    case Response::automatic:
    case Response::linear:
      break;
  }
  return stored;
}

void validate_table(const std::vector<double>& table, const std::string& name) {
  require(table.size() >= 2, name, table.size(), "a list of at least two values");
  require(table.front() == 0, name, table.front(), "0 at its first entry");
  require(table.back() == 1, name, table.back(), "1 at its last entry");
  for (std::size_t i = 1; i < table.size(); ++i)
    require(table[i] > table[i - 1], name + "[" + std::to_string(i) + "]", table[i],
            "greater than the entry before it");
}

void validate_channels(const Sensor& sensor) {
  const std::vector<Channel>& channels = sensor.channels;
  if (channels.empty()) return;
  require(sensor.mosaic != Mosaic::none, "sensor.mosaic", "none", "given beside `channels`");
  require(channels.size() == 3, "sensor.channels", channels.size(), "three: red, green and blue");
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const Channel& channel = channels[i];
    const std::string name = "sensor.channels[" + std::to_string(i) + "].";
    check_fields(channel, channel_fields, name);
    if (channel.response == Response::table || !channel.response_table.empty())
      validate_table(channel.response_table, name + "response_table");
  }
}

}  // namespace

Sensor Sensor::of_image(const ImageView& image) const {
  Sensor sensor = *this;
  if (response != Response::automatic) return sensor;
  sensor.response = internal::core::is_srgb(image) ? Response::srgb : Response::linear;
  return sensor;
}

double Sensor::electrons(double irradiance_w_m2) const {
  const double photon_j = planck_times_light / wavelength_m;
  const double pixel_w = irradiance_w_m2 * pixel_pitch_m * pixel_pitch_m;
  return (quantum_efficiency * pixel_w / photon_j + dark_current_e_per_s) * exposure_s;
}

double Sensor::grey_level(double electrons) const {
  const double range = full_scale_dn() - black_level_dn;
  const double signal_dn = gain_dn_per_e * std::clamp(electrons, 0.0, full_well_e);
  return black_level_dn + range * encode(*this, std::min(signal_dn / range, 1.0));
}

double Sensor::linear_dn(double grey_level) const {
  if (is_linear()) return grey_level - black_level_dn;
  const double range = full_scale_dn() - black_level_dn;
  return range * decode(*this, std::min((grey_level - black_level_dn) / range, 1.0));
}

double Sensor::noise_dn(double electrons) const {
  const double variance_e = read_noise_e * read_noise_e + std::max(electrons, 0.0);
  return std::sqrt(gain_dn_per_e * gain_dn_per_e * variance_e + 1.0 / 12.0);
}

void Sensor::validate() const {
  check_fields(*this, sensor_fields, "sensor.");
  require(black_level_dn >= 0 && black_level_dn < full_scale_dn(), "sensor.black_level_dn",
          black_level_dn, "at least 0 and below full scale");
  if (response == Response::table || !response_table.empty())
    validate_table(response_table, "sensor.response_table");
  validate_channels(*this);
}

}  // namespace occ
