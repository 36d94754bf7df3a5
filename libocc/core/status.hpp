// SPDX-License-Identifier: Apache-2.0
// What a function that depends on *data* returns: a status, a sentence, and what was found so far.
// A caller's mistake (wrong shape, NaN, f <= 0) is not a status: it throws std::invalid_argument.
#pragma once

#include <string>
#include <utility>

#include "libocc/core/abi.hpp"

namespace occ {

enum class Status {
  ok,              ///< one answer, and it fits
  ambiguous,       ///< several answers fit equally well; all are returned, ranked
  no_lamps,        ///< nothing in the image stands out from the background
  too_few_lamps,   ///< fewer identified lamps than the problem needs
  no_pose,         ///< no pose explains what was seen
  degenerate,      ///< the lamps do not determine the pose (collinear, coincident, far too small)
  not_converged,   ///< the refinement stopped before its tolerance was met
  budget_not_met,  ///< the answer is the best there is, but not within the time or error asked for
};

/// The enumerator's name, e.g. "too_few_lamps".
LIBOCC_API const char* to_string(Status status);

/// A value with the status that qualifies it. `value` holds what was found so far even when !ok().
template <typename T>
struct Result {
  T value{};
  Status status = Status::ok;
  std::string message;  ///< one sentence for a person; empty when there is nothing to add

  bool ok() const { return status == Status::ok; }
  const T* operator->() const { return &value; }
  const T& operator*() const { return value; }
};

}  // namespace occ
