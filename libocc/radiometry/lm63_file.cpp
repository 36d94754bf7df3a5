// SPDX-License-Identifier: Apache-2.0
// Parser of IES LM-63. Sources: ANSI/IESNA LM-63-02, sections 4 and 5; I. Ashdown, "Parsing the
// IESNA LM-63 photometric data file", 1998, for the versions of 1986, 1991 and 1995.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/yaml_lines.hpp"
#include "libocc/core/math.hpp"
#include "libocc/radiometry/internal/photometric_text.hpp"

namespace occ::internal::radiometry {
namespace {

using core::text_of;

constexpr std::string_view number_separators = " \t\f\v,\x1a";
constexpr double metres_per_foot = 0.3048;

std::string upper(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

// Numbers that continue over lines, from a given line on.
class NumberReader {
 public:
  NumberReader(const PhotometricText& text, std::size_t line) : text_(text), line_(line) {}

  /// Line of the number that was read last.
  std::size_t line() const { return last_line_; }

  [[noreturn]] void fail(const std::string& message) const { text_.fail(last_line_, message); }
  [[noreturn]] void fail(const std::string& item, const std::string& rule, double value) const {
    text_.fail(last_line_, item + " must " + rule + ", got " + text_of(value));
  }

  double number(const std::string& item) {
    const std::string word = next_word();
    if (word.empty()) text_.fail(text_.line_count() - 1, "the file ends before " + item);
    double value = 0;
    if (!parse_number(word, value))
      text_.fail(last_line_, item + " must be a finite number, got `" + word + "`");
    return value;
  }

  double positive(const std::string& item) {
    const double value = number(item);
    if (!(value > 0)) fail(item, "be positive", value);
    return value;
  }

  double not_negative(const std::string& item) {
    const double value = number(item);
    if (!(value >= 0)) fail(item, "not be negative", value);
    return value;
  }

  int whole(const std::string& item, int min, int max) {
    const double value = number(item);
    if (!(value >= min && value <= max && value == std::floor(value)))
      fail(item, "be a whole number in [" + std::to_string(min) + ", " + std::to_string(max) + "]",
           value);
    return static_cast<int>(value);
  }

  /// Angles in degrees that ascend from at least `min` to at most `max`.
  std::vector<double> angles(const std::string& item, int count, double min, double max) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i) {
      const std::string name = item + " " + std::to_string(i + 1);
      const double angle = number(name);
      if (!(angle >= min && angle <= max))
        fail(name, "be in [" + text_of(min) + ", " + text_of(max) + "]", angle);
      if (!all.empty() && !(angle > all.back()))
        fail(name, "be greater than the one before, " + text_of(all.back()), angle);
      all.push_back(angle);
    }
    return all;
  }

  void require_end(const std::string& item) {
    const std::string word = next_word();
    if (!word.empty()) text_.fail(last_line_, "unexpected `" + word + "` after " + item);
  }

 private:
  std::string next_word() {
    for (; line_ < text_.line_count(); ++line_, column_ = 0) {
      const std::string& line = text_.line(line_);
      const std::size_t from = line.find_first_not_of(number_separators, column_);
      if (from == std::string::npos) continue;
      const std::size_t to = std::min(line.find_first_of(number_separators, from), line.size());
      column_ = to;
      last_line_ = line_;
      return line.substr(from, to - from);
    }
    return "";
  }

  const PhotometricText& text_;
  std::size_t line_, column_ = 0, last_line_ = 0;
};

// Version of the opening line; 1986 for files without one.
int version_of(const PhotometricText& text) {
  const std::string first = upper(text.line(0));
  if (first.compare(0, 7, "IESNA91") == 0) return 1991;
  const bool iesna = first.compare(0, 12, "IESNA:LM-63-") == 0;
  const bool ies = first.compare(0, 10, "IES:LM-63-") == 0;
  if (!iesna && !ies) return 1986;
  const std::string year = first.substr(iesna ? 12 : 10);
  constexpr std::array<std::pair<const char*, int>, 9> years{{{"1986", 1986},
                                                              {"1991", 1991},
                                                              {"1995", 1995},
                                                              {"2002", 2002},
                                                              {"2019", 2019},
                                                              {"91", 1991},
                                                              {"95", 1995},
                                                              {"02", 2002},
                                                              {"19", 2019}}};
  for (const auto& [name, version] : years)
    if (year == name) return version;
  text.fail(0, "the version of LM-63 must be 1986, 1991, 1995, 2002 or 2019, got `" + year + "`");
}

// The value of a line `TILT=...`, or nothing for other lines.
std::optional<std::string> tilt_value(const std::string& line) {
  if (upper(line.substr(0, 4)) != "TILT") return std::nullopt;
  const std::string rest = trimmed(std::string_view(line).substr(4));
  if (rest.empty() || rest.front() != '=') return std::nullopt;
  return trimmed(std::string_view(rest).substr(1));
}

// Reads keywords and labels up to the line `TILT=...`, and returns the index of that line.
std::size_t read_header(const PhotometricText& text, int version,
                        PhotometricDistribution& distribution) {
  auto& keywords = distribution.keywords;
  const std::size_t version_line_count = version == 1986 ? 0 : 1;
  for (std::size_t i = version_line_count; i < text.line_count(); ++i) {
    const std::string& line = text.line(i);
    if (tilt_value(line)) return i;
    const std::size_t close =
        line.empty() || line.front() != '[' ? std::string::npos : line.find(']');
    if (close == std::string::npos) {
      keywords.emplace_back("", line);  // a label line, without keyword
      continue;
    }
    const std::string keyword = line.substr(1, close - 1);
    const std::string value = trimmed(std::string_view(line).substr(close + 1));
    if (keyword == "MORE" && !keywords.empty())
      keywords.back().second += "\n" + value;
    else
      keywords.emplace_back(keyword, value);
  }
  text.fail(text.line_count() - 1, "the file ends before the line `TILT=`");
}

LampTilt read_tilt(NumberReader& numbers) {
  LampTilt tilt;
  tilt.geometry = numbers.whole("lamp-to-luminaire geometry", 1, 3);
  const int pairs = numbers.whole("number of tilt angles", 1, max_photometric_angles);
  tilt.tilt_rad = numbers.angles("tilt angle", pairs, 0, 180);
  for (double& angle : tilt.tilt_rad) angle *= pi / 180;
  for (int i = 0; i < pairs; ++i)
    tilt.factors.push_back(numbers.not_negative("tilt factor " + std::to_string(i + 1)));
  return tilt;
}

// Reads the file that `TILT=FILE` names, from the folder of the photometric file. A folder in the
// name is ignored: it is that of the computer that wrote the file.
LampTilt read_tilt_file(const PhotometricText& text, std::size_t line, const std::string& given) {
  const std::size_t slash = given.find_last_of("/\\");
  const std::string name = slash == std::string::npos ? given : given.substr(slash + 1);
  if (name.empty())
    text.fail(line, "`TILT=` must be NONE, INCLUDE or a file name, got `" + given + "`");
  const std::string path = (std::filesystem::path(text.name()).parent_path() / name).string();
  std::string content;
  try {
    content = core::read_file(path);
  } catch (const std::runtime_error& error) {
    text.fail(line, "the file of `TILT=" + given + "` is needed beside this one; " + error.what());
  }
  const PhotometricText tilt_text(content, path);
  NumberReader numbers(tilt_text, 0);
  LampTilt tilt = read_tilt(numbers);
  numbers.require_end("the last tilt factor");
  return tilt;
}

// Table 1 of LM-63-1995 and of LM-63-2002. Negative dimensions are diameters of round openings. In
// 1995 and before, zero stands for a diameter that is equal to another one.
void set_opening(PhotometricDistribution& distribution, int version, double width, double length,
                 double height) {
  distribution.height_m = std::abs(height);
  const double across = std::abs(width), along = std::abs(length);
  OpeningShape shape = OpeningShape::rectangle;
  Eigen::Vector2d size(along, across);  // length: along C = 0; width: along C = 90 degrees
  if (width == 0 && length == 0) {
    shape = OpeningShape::point;
  } else if (width < 0 && length == 0) {
    size.x() = across;  // circle, sphere, vertical cylinder
    shape = version >= 2002 && height < 0 ? OpeningShape::sideways : OpeningShape::ellipse;
  } else if (height < 0 && (width == 0 || length == 0)) {
    for (double& side : size)  // horizontal cylinder; -height is its diameter
      if (side == 0) side = std::abs(height);
  } else if (width < 0 && length < 0) {
    shape = OpeningShape::ellipse;
  } else if (width < 0 || length < 0) {  // 1995: ellipse or ellipsoid; 2002: horizontal cylinder
    if (version < 2002 || height >= 0) shape = OpeningShape::ellipse;
  } else if (width == 0 || length == 0) {
    shape = OpeningShape::sideways;
  }
  if (shape == OpeningShape::point || shape == OpeningShape::sideways) size.setZero();
  distribution.opening = shape;
  distribution.size_m = size;
}

std::vector<PhotometricPlane> read_candela(NumberReader& numbers, std::size_t vertical,
                                           const std::vector<double>& horizontal, double factor) {
  std::vector<PhotometricPlane> planes;
  for (std::size_t j = 0; j < horizontal.size(); ++j) {
    PhotometricPlane plane{horizontal[j], {}};
    for (std::size_t i = 0; i < vertical; ++i) {
      const std::string item =
          "candela value " + std::to_string(i + 1) + " of plane " + std::to_string(j + 1);
      const double intensity_cd = factor * numbers.not_negative(item);
      if (!std::isfinite(intensity_cd))
        numbers.fail(item, "be finite with all factors", intensity_cd);
      plane.intensities_cd.push_back(intensity_cd);
    }
    planes.push_back(std::move(plane));
  }
  return planes;
}

void require_ends(const NumberReader& numbers, const std::string& item,
                  const std::vector<double>& angles, bool holds, const std::string& rule) {
  if (!holds)
    numbers.fail("the " + item + " must be " + rule + ", got " + text_of(angles.front()) + " to " +
                 text_of(angles.back()));
}

// Expands the symmetry that the range of the horizontal angles of type C states.
std::vector<PhotometricPlane> expand_type_c(std::vector<PhotometricPlane> planes) {
  const double first = planes.front().angle_deg, last = planes.back().angle_deg;
  std::vector<PhotometricPlane> all = planes;
  const auto mirror = [&](double offset_deg, double sign) {
    for (PhotometricPlane plane : planes) {
      plane.angle_deg = offset_deg + sign * plane.angle_deg;
      all.push_back(std::move(plane));
    }
  };
  if (first == 90) {
    mirror(180, -1);
  } else if (last == 90) {
    mirror(180, -1), mirror(180, 1), mirror(360, -1);
  } else if (last == 180) {
    mirror(360, -1);
  }
  return all;
}

}  // namespace

PhotometricDistribution parse_lm63(const PhotometricText& text) {
  PhotometricDistribution distribution;
  const int version = version_of(text);
  distribution.source_format = "LM-63-" + std::to_string(version);
  const std::size_t tilt_line = read_header(text, version, distribution);
  const std::string tilt = *tilt_value(text.line(tilt_line));
  NumberReader numbers(text, tilt_line + 1);
  if (upper(tilt) == "INCLUDE")
    distribution.tilt = read_tilt(numbers);
  else if (upper(tilt) != "NONE")
    distribution.tilt = read_tilt_file(text, tilt_line, tilt);

  const int lamps = numbers.whole("number of lamps", 1, 1000000);
  const double lumens = numbers.number("lumens per lamp");
  if (!(lumens >= 0 || lumens == -1))
    numbers.fail("lumens per lamp", "be positive, or -1 for absolute photometry", lumens);
  if (lumens > 0) distribution.lamp_lm = lamps * lumens;
  double factor = numbers.positive("candela multiplier");
  const int vertical_count = numbers.whole("number of vertical angles", 2, max_photometric_angles);
  const int horizontal_count =
      numbers.whole("number of horizontal angles", 1, max_photometric_angles);
  if (static_cast<long long>(vertical_count) * horizontal_count > max_photometric_values)
    text.fail(numbers.line(), "the file must have at most " +
                                  std::to_string(max_photometric_values) + " candela values, got " +
                                  std::to_string(vertical_count) + " x " +
                                  std::to_string(horizontal_count));
  const int type = numbers.whole("photometric type", 1, 3);
  const double unit = numbers.whole("units type", 1, 2) == 1 ? metres_per_foot : 1;
  const double width = unit * numbers.number("width of the luminous opening");
  const double length = unit * numbers.number("length of the luminous opening");
  const double height = unit * numbers.number("height of the luminous opening");
  set_opening(distribution, version, width, length, height);
  factor *= numbers.positive("ballast factor");
  // 1995 reserved this number for future use, and 2019 codes the origin of the file in it.
  const double second = numbers.number("ballast-lamp photometric factor");
  if (version <= 1991) {
    if (!(second > 0)) numbers.fail("ballast-lamp photometric factor", "be positive", second);
    factor *= second;
  }
  distribution.input_w = numbers.not_negative("input watts");

  const bool type_c = type == 1;
  const std::vector<double> vertical =
      numbers.angles("vertical angle", vertical_count, type_c ? 0 : -90, type_c ? 180 : 90);
  const double low = vertical.front(), high = vertical.back();
  if (type_c)
    require_ends(numbers, "vertical angles", vertical,
                 (low == 0 || low == 90) && (high == 90 || high == 180),
                 "0 to 90, 0 to 180 or 90 to 180");
  else
    require_ends(numbers, "vertical angles", vertical,
                 (low == -90 || low == 0) && (high == 0 || high == 90),
                 "-90 to 90, -90 to 0 or 0 to 90");
  const std::vector<double> horizontal =
      numbers.angles("horizontal angle", horizontal_count, type_c ? 0 : -90, type_c ? 360 : 90);
  const double first = horizontal.front(), last = horizontal.back();
  if (type_c)
    require_ends(numbers, "horizontal angles", horizontal,
                 (first == 0 && (horizontal_count == 1 || last == 90 || last >= 180)) ||
                     (first == 90 && last == 270),
                 "only 0, or 0 to 90, 0 to 180, 90 to 270, or 0 to at most 360");
  else
    require_ends(numbers, "horizontal angles", horizontal,
                 (first == 0 || first == -90) && last == 90, "0 to 90 or -90 to 90");

  std::vector<PhotometricPlane> planes = read_candela(numbers, vertical.size(), horizontal, factor);
  numbers.require_end("the last candela value");
  if (type_c)
    set_planes(distribution, vertical, expand_type_c(std::move(planes)));
  else
    set_planes_of_type_ab(distribution, type == 2, first == 0, vertical, planes);
  return distribution;
}

}  // namespace occ::internal::radiometry
