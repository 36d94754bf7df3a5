// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/photometric_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/radiometry/internal/hermite_grid.hpp"
#include "libocc/radiometry/internal/photometric_text.hpp"

namespace occ {
namespace internal::radiometry {
namespace {

// Angles of LM-63 and EULUMDAT have at most two decimals, so closer planes are the same plane.
constexpr double same_angle_deg = 1e-6;

// Length of the UTF-8 sequence at `i`, or 0 if it is malformed.
std::size_t utf8_length(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const std::size_t length = byte(i) < 0x80                      ? 1
                             : byte(i) >= 0xC2 && byte(i) < 0xE0 ? 2
                             : byte(i) >= 0xE0 && byte(i) < 0xF0 ? 3
                             : byte(i) >= 0xF0 && byte(i) < 0xF5 ? 4
                                                                 : 0;
  if (length == 0 || i + length > text.size()) return 0;
  for (std::size_t k = 1; k < length; ++k)
    if ((byte(i + k) & 0xC0) != 0x80) return 0;
  return length;
}

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

std::string latin1_to_utf8(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      out += c;
    } else {
      out += static_cast<char>(0xC0 | (byte >> 6));
      out += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return out;
}

}  // namespace

std::string trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\f\v\x1a";  // DOS ends a text with the byte 0x1a
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(blanks) - first + 1));
}

bool parse_number(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto parsed = std::from_chars(word.data(), end, value);
  return parsed.ec == std::errc() && parsed.ptr == end && std::isfinite(value);
}

PhotometricText::PhotometricText(const std::string& text, std::string name)
    : name_(std::move(name)) {
  std::string_view rest = text;
  if (rest.substr(0, 3) == "\xEF\xBB\xBF") rest.remove_prefix(3);
  const bool utf8 = is_utf8(rest);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    const std::string_view line = rest.substr(0, end);
    for (const char c : line)
      if (static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\f' && c != '\v' &&
          c != '\x1a')
        fail(lines_.size(),
             "is no photometric file: it contains the byte " + std::to_string(static_cast<int>(c)));
    lines_.push_back(trimmed(utf8 ? std::string(line) : latin1_to_utf8(line)));
    rest.remove_prefix(end);
    if (rest.substr(0, 2) == "\r\n")
      rest.remove_prefix(2);
    else if (!rest.empty())
      rest.remove_prefix(1);
  }
  while (!lines_.empty() && lines_.back().empty()) lines_.pop_back();
  if (lines_.empty()) fail(0, "is empty");
}

void PhotometricText::fail(std::size_t index, const std::string& message) const {
  throw std::runtime_error(name_ + ":" + std::to_string(index + 1) + ": " + message);
}

void set_planes(PhotometricDistribution& distribution, const std::vector<double>& vertical_deg,
                std::vector<PhotometricPlane> planes) {
  for (PhotometricPlane& plane : planes) {
    plane.angle_deg = std::fmod(plane.angle_deg + 360, 360);
    if (360 - plane.angle_deg < same_angle_deg) plane.angle_deg = 0;
  }
  std::stable_sort(planes.begin(), planes.end(),
                   [](const auto& a, const auto& b) { return a.angle_deg < b.angle_deg; });
  planes.erase(std::unique(planes.begin(), planes.end(),
                           [](const auto& a, const auto& b) {
                             return b.angle_deg - a.angle_deg < same_angle_deg;
                           }),
               planes.end());
  distribution.vertical_rad.clear();
  distribution.horizontal_rad.clear();
  for (const double angle : vertical_deg) distribution.vertical_rad.push_back(angle * pi / 180);
  distribution.intensities_cd.resize(static_cast<Eigen::Index>(vertical_deg.size()),
                                     static_cast<Eigen::Index>(planes.size()));
  for (std::size_t j = 0; j < planes.size(); ++j) {
    distribution.horizontal_rad.push_back(planes[j].angle_deg * pi / 180);
    for (std::size_t i = 0; i < vertical_deg.size(); ++i)
      distribution.intensities_cd(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          planes[j].intensities_cd[i];
  }
}

void set_planes_of_type_ab(PhotometricDistribution& distribution, bool type_b, bool mirrored,
                           const std::vector<double>& vertical_deg,
                           const std::vector<PhotometricPlane>& planes) {
  HermiteGrid grid;
  grid.x = vertical_deg;
  for (const PhotometricPlane& plane : planes) grid.y.push_back(plane.angle_deg);
  grid.f.resize(static_cast<Eigen::Index>(grid.x.size()), static_cast<Eigen::Index>(grid.y.size()));
  for (std::size_t j = 0; j < planes.size(); ++j)
    for (std::size_t i = 0; i < vertical_deg.size(); ++i)
      grid.f(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          planes[j].intensities_cd[i];
  grid.set_slopes();

  const double deg = 180 / pi;
  // As fine as the angles of common floodlight files at their beam.
  constexpr double gamma_step_deg = 1, c_step_deg = 5;
  std::vector<double> gammas;
  for (int i = 0; i <= 90; ++i) gammas.push_back(i * gamma_step_deg);
  std::vector<PhotometricPlane> resampled;
  for (int k = 0; k < 72; ++k) {
    PhotometricPlane plane;
    plane.angle_deg = k * c_step_deg;
    for (const double gamma_deg : gammas) {
      const double gamma = gamma_deg / deg, c = plane.angle_deg / deg;
      const double along_0 = std::sin(gamma) * std::cos(c), ahead = std::cos(gamma);
      const double along_270 = -std::sin(gamma) * std::sin(c);
      // Type A: the vertical angle is a latitude; type B: the horizontal angle is one.
      double vertical =
          deg * (type_b ? std::atan2(along_0, ahead) : std::asin(std::clamp(along_0, -1.0, 1.0)));
      double horizontal = deg * (type_b ? std::asin(std::clamp(along_270, -1.0, 1.0))
                                        : std::atan2(along_270, ahead));
      if (mirrored) horizontal = std::abs(horizontal);
      const auto covered = [](const std::vector<double>& angles, double angle) {
        return angle >= angles.front() - same_angle_deg && angle <= angles.back() + same_angle_deg;
      };
      const bool inside = covered(grid.x, vertical) && covered(grid.y, horizontal);
      plane.intensities_cd.push_back(inside ? std::max(0.0, grid.at(vertical, horizontal).value)
                                            : 0.0);
    }
    resampled.push_back(std::move(plane));
  }
  set_planes(distribution, gammas, std::move(resampled));
}

}  // namespace internal::radiometry

using namespace internal::core;
using namespace internal::radiometry;
namespace {

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

bool looks_like_lm63(const PhotometricText& text) {
  const std::string first = lower(text.line(0));
  if (first.compare(0, 5, "iesna") == 0 || first.compare(0, 4, "ies:") == 0) return true;
  for (std::size_t i = 0; i < text.line_count(); ++i)
    if (lower(text.line(i)).compare(0, 4, "tilt") == 0) return true;
  return false;
}

void require_angles(const std::vector<double>& angles, const char* name, double max, bool closed) {
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double angle = angles[i];
    const bool ascends = i == 0 || angle > angles[i - 1];
    const bool inside = angle >= 0 && (closed ? angle <= max : angle < max);
    if (!(ascends && inside))
      require(false, std::string(name) + "[" + std::to_string(i) + "]", angle,
              closed ? "ascending in [0, pi]" : "ascending in [0, 2 pi)");
  }
}

}  // namespace

double PhotometricDistribution::flux_lm() const {
  double flux = 0;
  const std::size_t planes = horizontal_rad.size();
  for (std::size_t j = 0; j < planes; ++j) {
    const double next = j + 1 < planes ? horizontal_rad[j + 1] : horizontal_rad[0] + 2 * pi;
    const double last = j > 0 ? horizontal_rad[j - 1] : horizontal_rad[planes - 1] - 2 * pi;
    double plane = 0;
    for (std::size_t i = 0; i + 1 < vertical_rad.size(); ++i) {
      const double a = vertical_rad[i], b = vertical_rad[i + 1];
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      const double at_a = intensities_cd(row, column), at_b = intensities_cd(row + 1, column);
      // Integral of (linear function of gamma) sin(gamma), by parts.
      plane += at_a * std::cos(a) - at_b * std::cos(b) +
               (at_b - at_a) / (b - a) * (std::sin(b) - std::sin(a));
    }
    flux += plane * (next - last) / 2;
  }
  return flux;
}

void PhotometricDistribution::validate() const {
  require(vertical_rad.size() >= 2, "vertical_rad", vertical_rad.size(), "a list of two or more");
  require(!horizontal_rad.empty(), "horizontal_rad", 0, "a list of one or more");
  require_angles(vertical_rad, "vertical_rad", pi * (1 + 1e-12), true);
  require_angles(horizontal_rad, "horizontal_rad", 2 * pi, false);
  require(horizontal_rad.front() == 0, "horizontal_rad[0]", horizontal_rad.front(), "0");
  const auto rows = static_cast<Eigen::Index>(vertical_rad.size());
  const auto columns = static_cast<Eigen::Index>(horizontal_rad.size());
  if (intensities_cd.rows() != rows || intensities_cd.cols() != columns)
    require(false, "intensities_cd",
            std::to_string(intensities_cd.rows()) + " x " + std::to_string(intensities_cd.cols()),
            std::to_string(rows) + " x " + std::to_string(columns));
  for (Eigen::Index j = 0; j < columns; ++j)
    for (Eigen::Index i = 0; i < rows; ++i)
      if (!(std::isfinite(intensities_cd(i, j)) && intensities_cd(i, j) >= 0))
        require(false, "intensities_cd[" + std::to_string(i) + ", " + std::to_string(j) + "]",
                intensities_cd(i, j), "finite and >= 0");
  require(intensities_cd.maxCoeff() > 0, "intensities_cd", 0, "above zero in some direction");
}

PhotometricDistribution parse_photometry(const std::string& text, const std::string& name) {
  const PhotometricText lines(text, name);
  const std::string ending = lower(std::filesystem::path(name).extension().string());
  const bool lm63 = looks_like_lm63(lines) || ending == ".ies";
  double number = 0;
  const bool eulumdat =
      ending == ".ldt" || (lines.line_count() > 2 && parse_number(lines.line(1), number) &&
                           parse_number(lines.line(2), number));
  if (!lm63 && !eulumdat)
    lines.fail(0,
               "is neither an LM-63 file (no line starts with `TILT=`) nor an EULUMDAT file "
               "(lines 2 and 3 are no numbers)");
  PhotometricDistribution distribution = lm63 ? parse_lm63(lines) : parse_eulumdat(lines);
  try {
    distribution.validate();
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(name + ": " + error.what());
  }
  return distribution;
}

PhotometricDistribution read_photometry(const std::string& path) {
  // Ten times the largest sensible file: 4 million values of 10 digits are 44 MB.
  constexpr std::uintmax_t max_bytes = 64u << 20;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (!error && bytes > max_bytes)
    throw std::runtime_error(path + ": must have at most 64 MiB, got " + std::to_string(bytes) +
                             " bytes");
  PhotometricDistribution distribution = parse_photometry(read_file(path), path);
  distribution.file = path;
  return distribution;
}

}  // namespace occ
