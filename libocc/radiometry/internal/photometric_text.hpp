// SPDX-License-Identifier: Apache-2.0
// Text of photometric files: lines, numbers with their place in messages, and parts that both
// formats share.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "libocc/radiometry/photometric_file.hpp"

namespace occ::internal::radiometry {

/// More angles than this in one list are rejected before memory is reserved. Goniophotometers step
/// by 0.1 degrees or more, which gives 3600 planes.
inline constexpr int max_photometric_angles = 10000;
/// Values of one file. 0.5 degrees over the sphere are 260 000.
inline constexpr int max_photometric_values = 4000000;

/// A plane of intensities, in the order of the vertical angles.
struct PhotometricPlane {
  double angle_deg = 0;
  std::vector<double> intensities_cd;
};

/// The lines of a file, without their ends.
class PhotometricText {
 public:
  /// Throws for an empty or binary text. Bytes that are not UTF-8 are read as Latin-1.
  PhotometricText(const std::string& text, std::string name);

  const std::string& name() const { return name_; }
  std::size_t line_count() const { return lines_.size(); }
  /// Line `index`, counted from 0, without blanks at its ends.
  const std::string& line(std::size_t index) const { return lines_[index]; }

  /// Throws std::runtime_error "NAME:LINE: MESSAGE"; `index` counts from 0.
  [[noreturn]] void fail(std::size_t index, const std::string& message) const;

 private:
  std::string name_;
  std::vector<std::string> lines_;
};

/// Text without blanks at its ends.
std::string trimmed(std::string_view text);

/// Parses a complete word as a finite number in the C locale. Returns false for other words.
bool parse_number(std::string_view word, double& value);

/// Fills vertical_rad, horizontal_rad and intensities_cd. Planes with angles in [0, 360] in any
/// order; 360 repeats 0, and repeated angles are dropped.
void set_planes(PhotometricDistribution& distribution, const std::vector<double>& vertical_deg,
                std::vector<PhotometricPlane> planes);

PhotometricDistribution parse_lm63(const PhotometricText& text);
PhotometricDistribution parse_eulumdat(const PhotometricText& text);

/// Resamples LM-63 types A and B to C-gamma coordinates; see photometric_file.hpp. Directions
/// outside the angles of the file are dark; `mirrored`: the planes apply to both signs of the
/// horizontal angle.
void set_planes_of_type_ab(PhotometricDistribution& distribution, bool type_b, bool mirrored,
                           const std::vector<double>& vertical_deg,
                           const std::vector<PhotometricPlane>& planes);

}  // namespace occ::internal::radiometry
