// SPDX-License-Identifier: Apache-2.0
// What a filter made of a measurement.
#pragma once

#include <string>

namespace occ {

enum class FilterOutcome {
  accepted,
  gated,        ///< contradicts the prediction: left out
  too_old,      ///< from before what the filter remembers
  overlapping,  ///< odometry of a time that odometry has told already
  not_started,  ///< the filter has no pose yet
};

struct FilterUpdate {
  FilterOutcome outcome = FilterOutcome::not_started;
  double nis = 0;   ///< normalised innovation squared, chi-square of nis_dof when all is well
  int nis_dof = 0;  ///< directions of the pose that the measurement says something of

  bool accepted() const { return outcome == FilterOutcome::accepted; }
};

}  // namespace occ
