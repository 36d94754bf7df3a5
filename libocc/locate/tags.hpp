// SPDX-License-Identifier: Apache-2.0
// AprilTags as landmarks: the poses from which one tag is seen, and the camera's pose from all tags
// of a scene, with its lamps when their names are known.
#pragma once

#include <map>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/locate/fix.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Every pose of the camera from which the tag is seen, best first, whatever it leaves: a small
/// square far away is seen nearly alike from two sides (IPPE, pose/internal/ippe.hpp), and both
/// minima are returned, with their chi2 (2 degrees of freedom) and rms_px to judge by. Where noise
/// has made them one there is one. "World" is the tag's frame: x to the right, y up, z towards the
/// viewer. Throws std::invalid_argument for a size that is not positive and corners outside the
/// camera's domain.
LIBOCC_API std::vector<Candidate> tag_poses(const AprilTag& tag, double size_m,
                                            const Camera& camera);

/// The camera's pose from the corners of those tags that the scene has, each by its covariance (one
/// whose id is seen twice does not count), and the centroids of `lamps` (id -> blob, as in
/// Fix::lamps). Status as of solve_pose; too_few_lamps when no tag of the scene is seen and fewer
/// than three lamps are. Throws std::invalid_argument for a lamp that the scene does not have.
LIBOCC_API Result<Fix> locate_by_tags(const std::vector<AprilTag>& tags, const Scene& scene,
                                      const std::map<int, Blob>& lamps = {});

}  // namespace occ
