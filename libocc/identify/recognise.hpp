// SPDX-License-Identifier: Apache-2.0
// Which of several known objects are in an image, where, and how likely chance is to have made them
// up. Each object is looked for by itself (identify_object). The surest answer takes its blobs, the
// others are looked for in what is left, and so on, as long as chance would hardly bring as much.
// An object can be there more than once.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"

namespace occ {

struct LIBOCC_API RecogniseOptions {
  IdentifyOptions identify;  ///< its prior holds for every object
  double max_false_alarms =
      1e-3;  ///< an object is there when chance brings fewer than this, in an image like this one

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// An object that explains blobs, and how well.
struct ObjectMatch {
  int object = 0;                 ///< index of the objects given
  std::vector<Hypothesis> poses;  ///< cam_from_world is cam_from_object; smallest chi2 first
  int plausible = 0;              ///< of the poses: no less likely than 1/1000 of the first
  /// Base-10 logarithm of how often chance would bring as good an explanation by any of the objects
  /// in an image of as many blobs.
  double log10_false_alarms = 300;
};

struct RecognisedObject {
  ObjectMatch match;
  Status status = Status::ok;       ///< ambiguous: several poses, or rivals
  std::vector<ObjectMatch> rivals;  ///< other objects that explain the same blobs, no less likely
                                    ///< than 1/1000 of this one
};

struct Recognition {
  std::vector<RecognisedObject> found;     ///< surest first; each blob is of one only
  std::vector<double> log10_false_alarms;  ///< of each object given at its best, found or not;
                                           ///< infinite for one that was not worth a look
};

/// Status: ok (objects were found, each of them one, in one pose); ambiguous (a pose or an object
/// among them is not the only one that fits); no_pose (none is in the image that chance would not
/// bring); too_few_lamps (fewer than four whole blobs). Throws std::invalid_argument for options
/// out of range, no objects, and blobs that are not finite; objects must be valid.
LIBOCC_API Result<Recognition> recognise(const std::vector<Blob>& blobs,
                                         const std::vector<Object>& objects, const Camera& camera,
                                         const RecogniseOptions& options = {});

}  // namespace occ
