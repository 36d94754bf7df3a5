// SPDX-License-Identifier: Apache-2.0
// Reads measured luminous intensity distributions of luminaires.
//
// Formats: IES LM-63 (ANSI/IESNA LM-63-1986, -1991, -1995, -2002, ANSI/IES LM-63-19) and EULUMDAT
// (.ldt; Stockmar, "EULUMDAT, ein Leuchtendatenformat fuer den europaeischen Beleuchtungsplaner",
// Licht'90). All distributions are returned in C-gamma coordinates (CIE 121-1996):
//
//   gamma  angle from the luminaire's axis (straight down for a ceiling luminaire), 0 to pi
//   C      angle about that axis, counter-clockwise as seen from above
//
// LM-63 types A and B are resampled to C-gamma: their axis (0, 0) becomes gamma = 0, positive
// vertical angles lie at C = 0, and positive horizontal angles (clockwise) at C = 270 degrees.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Face of the luminous opening, projected along the luminaire's axis.
enum class OpeningShape {
  point,      ///< no extent stated
  rectangle,  ///< has size_m
  ellipse,    ///< has size_m: its two diameters; a circle if they are equal
  sideways,   ///< a vertical face, which has no extent across the luminaire's axis
};

/// Output of a lamp against the tilt of the luminaire from the position of the measurement.
struct LampTilt {
  int geometry = 1;              ///< lamp-to-luminaire geometry of LM-63: 1, 2 or 3
  std::vector<double> tilt_rad;  ///< ascending, 0 to pi
  std::vector<double> factors;   ///< on the intensities, one per tilt_rad
};

/// A luminous intensity distribution with the symmetry of its file expanded.
struct LIBOCC_API PhotometricDistribution {
  std::string file;           ///< path of the file; empty for one that was parsed from a text
  std::string source_format;  ///< "LM-63-1986" ... "LM-63-2019", or "EULUMDAT"
  /// Keywords and texts in the order of the file, such as ("MANUFAC", "..."); UTF-8.
  std::vector<std::pair<std::string, std::string>> keywords;
  std::vector<double> vertical_rad;    ///< gamma, ascending; from 0 or pi/2 to pi/2 or pi
  std::vector<double> horizontal_rad;  ///< C, ascending from 0, below 2 pi; periodic; only 0 for a
                                       ///< distribution with rotational symmetry
  Eigen::MatrixXd intensities_cd;      ///< one row per vertical_rad, one column per horizontal_rad
  OpeningShape opening = OpeningShape::point;        ///< shape of the luminous opening
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();  ///< opening along C = 0 and along C = 90 deg
  double height_m = 0;                   ///< height of the luminous opening; 0 for a flat one
  std::optional<double> lamp_lm;         ///< rated flux of all lamps; none for absolute photometry
  std::optional<double> input_w;         ///< electrical power, if stated
  std::optional<LampTilt> tilt;          ///< LM-63: not applied to intensities_cd
  std::optional<double> output_ratio;    ///< EULUMDAT: light output ratio (LORL), 0 to 1
  std::optional<double> downward_ratio;  ///< EULUMDAT: downward flux fraction (DFF), 0 to 1

  /// Luminous flux [lm]: integral of the intensities over the sphere. Planes and angles are
  /// interpolated linearly.
  double flux_lm() const;

  /// Throws std::invalid_argument naming the field: angles as described above, at least two of
  /// vertical_rad, and intensities that are finite, not negative, and not all zero.
  void validate() const;
};

/// Reads an LM-63 or EULUMDAT file; the content decides the format, or else the ending (.ies,
/// .ldt). A file that `TILT=` names must be in the same folder. Intensities contain all factors of
/// the file; those of EULUMDAT (cd per 1000 lm) are for the first lamp set. Throws
/// std::runtime_error "FILE:LINE: REASON" naming the faulty item and its value.
LIBOCC_API PhotometricDistribution read_photometry(const std::string& path);

/// Reads the text of such a file; messages use `name` in place of a path, and its ending counts as
/// that of a path. `TILT=FILE` is looked up in the folder of `name`.
LIBOCC_API PhotometricDistribution parse_photometry(const std::string& text,
                                                    const std::string& name = "<text>");

}  // namespace occ
