// SPDX-License-Identifier: Apache-2.0
// Recognises known objects in an image and estimates their poses.
//
// Each object is identified separately (identify_object). The match with the fewest expected false
// alarms (a contrario, Desolneux, Moisan, Morel 2008) is accepted and its blobs are removed; the
// search continues in the remaining blobs while matches are significant. An object can be found
// more than once.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"

namespace occ {

/// Options of recognise().
struct LIBOCC_API RecogniseOptions {
  IdentifyOptions identify;        ///< the prior applies to every object
  double max_false_alarms = 1e-3;  ///< an object is accepted if chance produces fewer matches as
                                   ///< good in an image with as many blobs

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// An object with the poses that match its points to blobs.
struct ObjectMatch {
  int object = 0;                 ///< index in the list of objects
  std::vector<Hypothesis> poses;  ///< cam_from_world is cam_from_object; smallest chi2 first
  int plausible = 0;  ///< number of poses with at least 1/1000 of the first's likelihood
  /// Base-10 logarithm of the expected number of matches as good, by any of the objects, in an
  /// image with as many random blobs.
  double log10_false_alarms = 300;
};

/// An accepted object.
struct RecognisedObject {
  ObjectMatch match;                ///< object and its poses
  Status status = Status::ok;       ///< ambiguous: several plausible poses, or rivals
  std::vector<ObjectMatch> rivals;  ///< other objects that match some of the blobs, with at least
                                    ///< 1/1000 of this one's likelihood
};

/// Result of recognise().
struct Recognition {
  std::vector<RecognisedObject> found;     ///< most significant first; each blob is used once
  std::vector<double> log10_false_alarms;  ///< best match of each object, accepted or not; infinite
                                           ///< where there is none
};

/// objects: at least one, all valid. Status: ok (objects found, each with a unique pose); ambiguous
/// (an object has several plausible poses or rivals); no_pose (no significant match); too_few_lamps
/// (fewer than four whole blobs). Throws std::invalid_argument for options out of range, an empty
/// list of objects, and blobs that are not finite.
LIBOCC_API Result<Recognition> recognise(const std::vector<Blob>& blobs,
                                         const std::vector<Object>& objects, const Camera& camera,
                                         const RecogniseOptions& options = {});

}  // namespace occ
