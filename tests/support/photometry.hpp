// SPDX-License-Identifier: Apache-2.0
// Writes photometric files of closed forms, for tests.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/radiometry/emission_profile.hpp"

namespace occ::test {

/// Intensity [cd] by gamma and C [rad].
using Intensity = std::function<double(double, double)>;

inline std::vector<double> steps_deg(double step, double last) {
  std::vector<double> all;
  for (int i = 0; i * step <= last + 1e-9; ++i) all.push_back(i * step);
  return all;
}

inline std::string joined_numbers(const std::vector<double>& values, const char* separator) {
  std::ostringstream text;
  text.precision(12);
  for (std::size_t i = 0; i < values.size(); ++i) text << (i > 0 ? separator : "") << values[i];
  return text.str();
}

/// An LM-63-2002 file with a luminous opening "WIDTH LENGTH HEIGHT" in metres.
inline std::string lm63_text(const Intensity& intensity, const std::vector<double>& gamma_deg,
                             const std::vector<double>& c_deg,
                             const std::string& opening = "-0.17 -0.17 0") {
  std::ostringstream text;
  text << "IESNA:LM-63-2002\n[TEST] closed form\nTILT=NONE\n1 1000 1 " << gamma_deg.size() << " "
       << c_deg.size() << " 1 2 " << opening << "\n1 1 20\n"
       << joined_numbers(gamma_deg, " ") << "\n"
       << joined_numbers(c_deg, " ") << "\n";
  for (const double c : c_deg) {
    std::vector<double> plane;
    for (const double gamma : gamma_deg) plane.push_back(intensity(gamma * pi / 180, c * pi / 180));
    text << joined_numbers(plane, " ") << "\n";
  }
  return text.str();
}

/// A lamp's closed form cos^m.
inline Intensity cosine_power(double order) {
  return [order](double gamma, double) { return 1000 * std::pow(std::cos(gamma), order); };
}

/// A batwing: brightest at an angle from the axis, and more so across than along C = 0. The part of
/// cos C is odd through the axis.
inline double batwing(double gamma, double c) {
  const double s = std::sin(gamma);
  return 500 * std::cos(gamma) *
         (1 + 2.5 * s * s * (1 - 0.4 * std::cos(2 * c)) + 0.3 * s * std::cos(c));
}

/// A profile of a closed form, tabulated at steps of gamma and C.
inline std::shared_ptr<const EmissionProfile> profile_of(const Intensity& intensity,
                                                         double gamma_step, double c_step,
                                                         const std::string& opening =
                                                             "-0.17 -0.17 "
                                                             "0") {
  const std::vector<double> c = c_step > 0 ? steps_deg(c_step, 360) : std::vector<double>{0};
  return std::make_shared<const EmissionProfile>(
      parse_photometry(lm63_text(intensity, steps_deg(gamma_step, 90), c, opening)));
}

/// Integral of the batwing over the hemisphere [lm].
inline double batwing_flux() {
  // The integral of cos sin over gamma is 1/2, that of sin^3 cos is 1/4; the terms of C vanish.
  return 500 * 2 * pi * (0.5 + 2.5 * 0.25);
}

/// Unit vector in the lamp's frame.
inline Eigen::Vector3d direction_of(double gamma, double c) {
  return {std::sin(gamma) * std::cos(c), std::sin(gamma) * std::sin(c), std::cos(gamma)};
}

}  // namespace occ::test
