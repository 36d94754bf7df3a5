// SPDX-License-Identifier: Apache-2.0
// Recognises known objects in an image and estimates their poses.
//
// Each object is identified separately (identify_object). Matches with few expected false alarms
// (a contrario, Desolneux, Moisan, Morel 2008) are significant. Of these the one with the largest
// evidence is accepted and its blobs are removed; the search continues in the remaining blobs while
// matches are significant. An object can be found more than once.
//
// Poses of all objects that share blobs with an accepted one compete with it, as does "none of
// these": their probabilities follow from their evidence, as in identify(). Each of n objects is
// present with the prior odds 1 / n.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"

namespace occ {

/// Options of recognise().
struct LIBOCC_API RecogniseOptions {
  IdentifyOptions identify;        ///< prior and max_risk apply to every object
  double max_false_alarms = 1e-3;  ///< an object is accepted if chance produces fewer matches as
                                   ///< good in an image with as many blobs

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// An object with the poses that match its points to blobs.
struct ObjectMatch {
  int object = 0;                 ///< index in the list of objects
  std::vector<Hypothesis> poses;  ///< cam_from_world is cam_from_object; most probable first
  int plausible = 0;  ///< number of poses with at least 1/1000 of the first's probability
  /// Base-10 logarithm of the expected number of matches as good, by any of the objects, in an
  /// image with as many random blobs.
  double log10_false_alarms = 300;
};

/// An accepted object.
struct RecognisedObject {
  ObjectMatch match;                ///< object and its poses
  double risk = 1;                  ///< probability that object or pose is wrong
  Status status = Status::ok;       ///< ok: the risk is at most max_risk; else ambiguous
  std::vector<ObjectMatch> rivals;  ///< other objects that match some of the blobs, with a
                                    ///< probability of at least 1e-6
};

/// Result of recognise().
struct Recognition {
  std::vector<RecognisedObject> found;     ///< most significant first; each blob is used once
  std::vector<double> log10_false_alarms;  ///< best match of each object, accepted or not; infinite
                                           ///< where there is none
};

/// objects: at least one, all valid. Status: ok (objects found, each with a risk of at most
/// max_risk); ambiguous (the risk of one is larger); no_pose (no match is significant and more
/// probable than false lights); too_few_lamps (fewer than four whole blobs). Throws
/// std::invalid_argument for options out of range, an empty list of objects, and blobs that are not
/// finite.
LIBOCC_API Result<Recognition> recognise(const std::vector<Blob>& blobs,
                                         const std::vector<Object>& objects, const Camera& camera,
                                         const RecogniseOptions& options = {});

}  // namespace occ
