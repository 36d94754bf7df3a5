// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/status.hpp"

namespace occ {

const char* to_string(Status status) {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::ambiguous:
      return "ambiguous";
    case Status::no_lamps:
      return "no_lamps";
    case Status::too_few_lamps:
      return "too_few_lamps";
    case Status::no_pose:
      return "no_pose";
    case Status::degenerate:
      return "degenerate";
    case Status::not_converged:
      return "not_converged";
    case Status::budget_not_met:
      return "budget_not_met";
  }
  return "unknown";
}

}  // namespace occ
