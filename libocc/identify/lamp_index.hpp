// SPDX-License-Identifier: Apache-2.0
// What identification by hashing looks up, made once for a map: the shapes of all triangles of near
// lamps, as star trackers keep those of stars. Lamps must hang at one height, most of them to 2 cm.
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

class LIBOCC_API LampIndex {
 public:
  /// A tenth of a millisecond a lamp. The lamps are not kept.
  explicit LampIndex(const std::vector<Lamp>& lamps);

  /// Whether four fifths of the lamps hang at one height; otherwise voting takes over.
  bool applies() const;
  std::size_t triangles() const;

  const internal::identify::LampTable& table() const { return *table_; }

 private:
  std::shared_ptr<const internal::identify::LampTable> table_;
};

}  // namespace occ
