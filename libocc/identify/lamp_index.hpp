// SPDX-License-Identifier: Apache-2.0
// Index of a map for IdentifyMethod::hashing: the shapes of all triangles of neighbouring lamps, as
// star trackers store those of stars. Valid for maps in which four fifths of the lamps, and at
// least four, hang within 2 cm of one height.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ {

namespace internal::identify {
class LampTable;
}

/// Index of a map; build it once and pass it to each identify().
class LIBOCC_API LampIndex {
 public:
  /// Takes about 0.1 ms per lamp. The lamps are copied.
  explicit LampIndex(const std::vector<Lamp>& lamps);

  /// True if the lamps hang at one height (see above). Otherwise identify() uses voting.
  bool applies() const;
  std::size_t triangles() const;  ///< number of triangles

  /// Content of the index, for the library's own use.
  const internal::identify::LampTable& table() const { return *table_; }

 private:
  std::shared_ptr<const internal::identify::LampTable> table_;
};

}  // namespace occ
