// SPDX-License-Identifier: Apache-2.0
// Parser of EULUMDAT: one item per line, in a fixed order. Source: Stockmar, Licht'90, as listed by
// P. Bourke, "EULUMDAT file format specification".
#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/internal/yaml_lines.hpp"
#include "libocc/radiometry/internal/photometric_text.hpp"

namespace occ::internal::radiometry {
namespace {

using core::text_of;

class LineReader {
 public:
  explicit LineReader(const PhotometricText& text) : text_(text) {}

  std::string text(const std::string& item) {
    if (next_ == text_.line_count())
      text_.fail(text_.line_count() - 1, "the file ends before " + item);
    return text_.line(next_++);
  }

  [[noreturn]] void fail(const std::string& message) const { text_.fail(next_ - 1, message); }
  [[noreturn]] void fail(const std::string& item, const std::string& rule, double value) const {
    fail(item + " must " + rule + ", got " + text_of(value));
  }

  double number(const std::string& item) {
    const std::string given = text(item);
    std::string word = given;
    std::replace(word.begin(), word.end(), ',', '.');  // decimal separator of many countries
    double value = 0;
    if (!parse_number(word, value)) fail(item + " must be a finite number, got `" + given + "`");
    return value;
  }

  double not_negative(const std::string& item) {
    const double value = number(item);
    if (!(value >= 0)) fail(item, "not be negative", value);
    return value;
  }

  /// A number that the intensities do not depend on; none for an empty line, which some programs
  /// write.
  std::optional<double> optional(const std::string& item) {
    if (next_ < text_.line_count() && text_.line(next_).empty()) {
      ++next_;
      return std::nullopt;
    }
    return not_negative(item);
  }

  int whole(const std::string& item, int min, int max) {
    const double value = number(item);
    if (!(value >= min && value <= max && value == std::floor(value)))
      fail(item, "be a whole number in [" + std::to_string(min) + ", " + std::to_string(max) + "]",
           value);
    return static_cast<int>(value);
  }

  std::vector<double> angles(const std::string& item, int count, double max) {
    std::vector<double> all;
    for (int i = 0; i < count; ++i) {
      const std::string name = item + " " + std::to_string(i + 1);
      const double angle = number(name);
      if (!(angle >= 0 && angle <= max)) fail(name, "be in [0, " + text_of(max) + "]", angle);
      if (!all.empty() && !(angle > all.back()))
        fail(name, "be greater than the one before, " + text_of(all.back()), angle);
      all.push_back(angle);
    }
    return all;
  }

  void require_end(const std::string& item) {
    if (next_ == text_.line_count()) return;
    ++next_;
    fail("unexpected `" + text_.line(next_ - 1) + "` after " + item);
  }

 private:
  const PhotometricText& text_;
  std::size_t next_ = 0;
};

// Indices of the C planes whose intensities the file lists, for the symmetry ISYM:
// 0 none, 1 rotational, 2 about C 0-180, 3 about C 90-270, 4 about both.
std::vector<std::size_t> listed_planes(int symmetry, int count) {
  const int first = symmetry == 3 ? 3 * count / 4 : 0;
  const int planes = symmetry == 0   ? count
                     : symmetry == 1 ? 1
                     : symmetry == 4 ? count / 4 + 1
                                     : count / 2 + 1;
  std::vector<std::size_t> indices;
  for (int i = 0; i < planes; ++i) indices.push_back(static_cast<std::size_t>((first + i) % count));
  return indices;
}

// The symmetry needs planes at these angles, and as many planes on each side.
void require_symmetry(const LineReader& lines, int symmetry, const std::vector<double>& c_deg) {
  const std::size_t count = c_deg.size();
  if (!c_deg.empty() && symmetry != 1 && c_deg.front() != 0)
    lines.fail("angle C 1", "be 0", c_deg.front());
  if (symmetry < 2) return;
  const std::size_t step = symmetry == 2 ? 2 : 4;
  if (count % step != 0)
    lines.fail("the number of C planes",
               "be a multiple of " + std::to_string(step) + " for the symmetry " +
                   std::to_string(symmetry),
               static_cast<double>(count));
  for (std::size_t i = 0; i < step; ++i) {
    const double angle = 360.0 * static_cast<double>(i) / static_cast<double>(step);
    const std::size_t index = i * count / step;
    if (std::abs(c_deg[index] - angle) > 1e-6)
      lines.fail("angle C " + std::to_string(index + 1),
                 "be " + text_of(angle) + " for the symmetry " + std::to_string(symmetry),
                 c_deg[index]);
  }
}

std::vector<PhotometricPlane> expand(int symmetry, std::vector<PhotometricPlane> planes) {
  std::vector<PhotometricPlane> all = planes;
  const auto mirror = [&](double offset_deg, double sign) {
    for (PhotometricPlane plane : planes) {
      plane.angle_deg = offset_deg + sign * plane.angle_deg;
      all.push_back(std::move(plane));
    }
  };
  if (symmetry == 2) mirror(360, -1);
  if (symmetry == 3) mirror(180, -1);
  if (symmetry == 4) mirror(180, -1), mirror(180, 1), mirror(360, -1);
  return all;
}

// Lines 26 to 26f: the first lamp set gives flux and power; the others are alternatives to it.
void read_lamp_sets(LineReader& lines, PhotometricDistribution& distribution) {
  const int sets = lines.whole("number of lamp sets", 1, 20);
  for (int i = 0; i < sets; ++i) {
    const std::string set = " of lamp set " + std::to_string(i + 1);
    lines.number("number of lamps" + set);  // negative: absolute photometry
    const std::string type = lines.text("type of lamps" + set);
    const double flux_lm = lines.number("total luminous flux" + set);
    if (!(flux_lm > 0)) lines.fail("total luminous flux" + set, "be positive", flux_lm);
    lines.text("colour appearance" + set);
    lines.text("colour rendering" + set);
    const std::optional<double> input_w = lines.optional("input watts" + set);
    if (i > 0) continue;
    distribution.keywords.emplace_back("lamps", type);
    distribution.lamp_lm = flux_lm;
    distribution.input_w = input_w;
  }
}

}  // namespace

PhotometricDistribution parse_eulumdat(const PhotometricText& text) {
  PhotometricDistribution distribution;
  distribution.source_format = "EULUMDAT";
  LineReader lines(text);
  const auto keyword = [&](const char* name) {
    distribution.keywords.emplace_back(name, lines.text(name));
  };
  keyword("company");
  lines.whole("type of the luminaire (Ityp)", 0, 3);
  const int symmetry = lines.whole("symmetry (Isym)", 0, 4);
  const int planes = lines.whole("number of C planes (Mc)", 1, max_photometric_angles);
  lines.optional("distance of C planes (Dc)");
  const int verticals = lines.whole("number of gamma angles (Ng)", 2, max_photometric_angles);
  if (static_cast<long long>(planes) * verticals > max_photometric_values)
    lines.fail("the file must have at most " + std::to_string(max_photometric_values) +
               " intensities, got " + std::to_string(planes) + " x " + std::to_string(verticals));
  lines.optional("distance of gamma angles (Dg)");
  for (const char* name : {"report", "luminaire", "luminaire number", "file", "date"})
    keyword(name);
  for (const char* item :
       {"length of the luminaire", "width of the luminaire", "height of the luminaire"})
    lines.optional(item);
  const double length_m = 1e-3 * lines.not_negative("length of the luminous area");
  const double width_m = 1e-3 * lines.not_negative("width of the luminous area");
  for (const char* item :
       {"height of the luminous area at C0", "height of the luminous area at C90",
        "height of the luminous area at C180", "height of the luminous area at C270"})
    distribution.height_m =
        std::max(distribution.height_m, 1e-3 * lines.optional(item).value_or(0));
  if (length_m > 0) {  // width 0: a circle; the length is along C = 90 degrees
    distribution.opening = width_m > 0 ? OpeningShape::rectangle : OpeningShape::ellipse;
    distribution.size_m = {width_m > 0 ? width_m : length_m, length_m};
  }
  const auto percent = [&](const char* item) {
    std::optional<double> value = lines.optional(item);
    if (value) *value /= 100;
    return value;
  };
  distribution.downward_ratio = percent("downward flux fraction");
  distribution.output_ratio = percent("light output ratio");
  const double conversion = lines.number("conversion factor of the intensities");
  if (!(conversion > 0))
    lines.fail("conversion factor of the intensities", "be positive", conversion);
  lines.text("tilt of the luminaire during measurement");
  read_lamp_sets(lines, distribution);
  for (int i = 0; i < 10; ++i) lines.optional("direct ratio " + std::to_string(i + 1));

  const std::vector<double> c_deg = lines.angles("angle C", planes, 360);
  if (c_deg.back() == 360 && planes > 1)
    lines.fail("angle C " + std::to_string(planes), "be below 360", c_deg.back());
  require_symmetry(lines, symmetry, c_deg);
  const std::vector<double> gamma_deg = lines.angles("angle gamma", verticals, 180);
  const double low = gamma_deg.front(), high = gamma_deg.back();
  if (!((low == 0 || low == 90) && (high == 90 || high == 180)))
    lines.fail("the gamma angles must be 0 to 90, 0 to 180 or 90 to 180, got " + text_of(low) +
               " to " + text_of(high));

  const double factor = conversion * *distribution.lamp_lm / 1000;
  std::vector<PhotometricPlane> listed;
  for (const std::size_t index : listed_planes(symmetry, planes)) {
    PhotometricPlane plane{symmetry == 1 ? 0 : c_deg[index], {}};
    for (std::size_t i = 0; i < gamma_deg.size(); ++i) {
      const std::string item =
          "intensity " + std::to_string(i + 1) + " of plane C " + std::to_string(index + 1);
      const double intensity_cd = factor * lines.not_negative(item);
      if (!std::isfinite(intensity_cd))
        lines.fail(item, "be finite with all factors", intensity_cd);
      plane.intensities_cd.push_back(intensity_cd);
    }
    listed.push_back(std::move(plane));
  }
  lines.require_end("the last intensity");
  set_planes(distribution, gamma_deg, expand(symmetry, std::move(listed)));
  return distribution;
}

}  // namespace occ::internal::radiometry
