// SPDX-License-Identifier: Apache-2.0
// Warnings and omissions that follow from the adjustment of a survey.
#pragma once

#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// A growth of all rims that blur and noise do not give is one of the response of the camera.
void note_growth(Survey& survey);

/// A calibration that is not that of the pictures bends the map, or scatters the lamps; so does a
/// wrong match that the redundancy does not reveal.
void note_contradictions(Survey& survey);

/// Pictures that the adjustment leaves out have no pose.
void note_left_out(Survey& survey);

}  // namespace occ::internal::survey
