// SPDX-License-Identifier: Apache-2.0
// Result of a function whose success depends on *data*: a value, a status and a message. A caller's
// mistake (wrong shape, NaN, f <= 0) throws std::invalid_argument instead.
#pragma once

#include <string>
#include <utility>

#include "libocc/core/abi.hpp"

namespace occ {

/// Outcome of a function, as far as it depends on data.
enum class Status {
  ok,              ///< one solution, which fits
  ambiguous,       ///< several solutions are plausible (all are returned, ranked), several objects
                   ///< match the same blobs, or the only solution may be accidental; see message
  no_lamps,        ///< no region of the image is brighter than the background
  too_few_lamps,   ///< fewer identified lamps than the problem needs
  no_pose,         ///< no pose fits the measurements
  degenerate,      ///< the lamps do not determine the pose (collinear, coincident, far too small)
  not_converged,   ///< the refinement stopped before its tolerance was met
  budget_not_met,  ///< best possible solution, which misses the requested time or error
};

/// The enumerator's name, e.g. "too_few_lamps".
LIBOCC_API const char* to_string(Status status);

/// A value with its status. If !ok(), `value` holds the partial result.
template <typename T>
struct Result {
  T value{};                   ///< complete if ok(), otherwise the partial result
  Status status = Status::ok;  ///< reason if there is no complete result
  std::string message;         ///< a sentence for the user; may be empty

  /// True if the value is complete.
  bool ok() const { return status == Status::ok; }
  /// Member of the value; valid for every status.
  const T* operator->() const { return &value; }
  /// The value; valid for every status.
  const T& operator*() const { return value; }
};

}  // namespace occ
