// SPDX-License-Identifier: Apache-2.0
// Removes the effect of a rolling shutter from the blobs and tags of a recording. Row y is exposed
// at t + row_time (y - y_middle). A point with the velocity v in the image [px/s] is moved to its
// place at the exposure of the middle row,
//
//     p' = p - v row_time (y - y_middle).
//
// v follows from the same blob or tag in the neighbouring pictures (central difference, or the one
// difference that exists). The motion between neighbours is assumed to be uniform.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// The pictures as a global shutter would show them. Pictures without a time are unchanged, as are
/// blobs that no neighbour shows; a note states their number.
std::vector<SurveyPicture> without_rolling_shutter(std::vector<SurveyPicture> pictures,
                                                   double row_time_s, int width, int height,
                                                   std::vector<std::string>& notes);

}  // namespace occ::internal::survey
