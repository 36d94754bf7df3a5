// SPDX-License-Identifier: Apache-2.0
// AprilTags as lamps whose number is known: they link pictures as rectangular lamps do, with a
// normal and a direction of their own. Their size is unknown before the first adjustment, in which
// their corners are observations of bodies (known_lengths.hpp).
#pragma once

#include <optional>
#include <vector>

#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// Number of the tag that a blob of with_tags_as_blobs() stands for; nothing for a lamp.
std::optional<int> tag_of(const Blob& blob);

/// The pictures with a blob for each tag whose id occurs once in its picture, after the others.
std::vector<SurveyPicture> with_tags_as_blobs(std::vector<SurveyPicture> pictures);

/// Number of blobs that stand for no tag; they come first.
std::size_t lamp_blobs(const SurveyPicture& picture);

}  // namespace occ::internal::survey
