// SPDX-License-Identifier: Apache-2.0
// Computing time of each rung of the refinement, as measured:
//     time = fixed + per_lamp lamps + per_rim_point rim points + per_pixel pixels.
// `libocc ladder --costs FILE.yaml` measures one on the machine at hand.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/refine/refine.hpp"

namespace occ {

/// Numbers of measurements of one pose.
struct RungWork {
  int lamps = 0;       ///< number of assigned blobs
  int rim_points = 0;  ///< total over all blobs
  int pixels = 0;      ///< in the boxes around the blobs, including their dark margin of 4 px
};

/// Counts the measurements of matched blobs.
LIBOCC_API RungWork work_of(const std::vector<Match>& matches, const std::vector<Blob>& blobs);

/// Coefficients of one rung's computing time [s].
struct LIBOCC_API RungCost {
  /// Coefficients of the equation above.
  double fixed_s = 0, per_lamp_s = 0, per_rim_point_s = 0, per_pixel_s = 0;

  /// Predicted time of one pose [s].
  double predicted_s(const RungWork& work) const;
  /// True if all coefficients are equal.
  bool operator==(const RungCost& other) const;
};

/// Times for one pose. The defaults were measured by `libocc ladder --costs` (irregular_six, three
/// to six lamps of 13 to 29 px) on one core of an x86-64 server of about 2.5 GHz.
struct LIBOCC_API RungCosts {
  RungCost points{7e-6, 0.55e-6, 0, 0};       ///< cost of Rung::points
  RungCost centres{7e-6, 0.6e-6, 0, 0};       ///< cost of Rung::centres
  RungCost rims{16e-6, 0, 0.28e-6, 0};        ///< cost of Rung::rims
  RungCost direct{80e-6, 20e-6, 0, 0.11e-6};  ///< cost of Rung::direct

  /// Cost of a rung.
  const RungCost& of(Rung rung) const;
  /// True if the costs of all rungs are equal.
  bool operator==(const RungCosts& other) const;
  void validate() const;  ///< throws std::invalid_argument: finite, not negative
};

/// YAML files with one mapping for each rung. Reading throws std::runtime_error, e.g. "FILE:LINE:
/// key `direct.per_lamp_s`: must be zero or positive, got -1". Writing is atomic and throws
/// std::runtime_error with the file's name.
LIBOCC_API RungCosts read_rung_costs(const std::string& path);
/// Reads costs from text; messages use `name` in place of a file name.
LIBOCC_API RungCosts parse_rung_costs(const std::string& text, const std::string& name = "<text>");
/// Text that parse_rung_costs reads back to equal costs.
LIBOCC_API std::string format_rung_costs(const RungCosts& costs);
/// Writes the file completely or leaves it unchanged.
LIBOCC_API void write_rung_costs(const std::string& path, const RungCosts& costs);

}  // namespace occ
