// SPDX-License-Identifier: Apache-2.0
// Pose of the camera from AprilTags: from one tag, and from all tags and identified lamps of a
// scene.
#pragma once

#include <map>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/locate/fix.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Poses of the camera from one tag, best first, whatever their residuals are. A small square far
/// away has two similar poses (IPPE, pose/solvers/ippe.hpp), both are returned with chi2 (2
/// degrees of freedom) and rms_px. If noise leaves one minimum, one is returned. "World" is the
/// tag's frame: x to the right, y up, z towards the viewer. Throws std::invalid_argument for a size
/// that is not positive and for corners outside the camera's domain.
LIBOCC_API std::vector<Candidate> tag_poses(const AprilTag& tag, double size_m,
                                            const Camera& camera);

/// Pose of the camera from the corners of the tags of the scene, each weighted by its covariance
/// (one whose id is detected twice is ignored), and the centroids of `lamps` (id -> blob, as in
/// Fix::lamps), which are compared with the centres of the lamps' images (project_lamp_centre).
/// Blobs that the border cuts are ignored. Status as for solve_pose; too_few_lamps without a tag of
/// the scene and with fewer than three whole lamps. Throws std::invalid_argument for an unknown id.
LIBOCC_API Result<Fix> locate_by_tags(const std::vector<AprilTag>& tags, const Scene& scene,
                                      const std::map<int, Blob>& lamps = {});

}  // namespace occ
