// SPDX-License-Identifier: Apache-2.0
// Incremental poses of the images and tags of one block (start_network.hpp, steps 2 to 4).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/calibrate/internal/pixel_fit.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/camera/camera.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::calibrate {

/// One tag in one image.
struct TagView {
  int image = 0, tag = 0;
  Eigen::Matrix2Xd px;  ///< the four corners, 2 x 4
  double sigma_px = 0.1;
  std::vector<TagPoseHypothesis> hypotheses;
};

struct TagPlacement {
  std::optional<Rigid3> world_from_tag;
  int views = 0;  ///< number of posed images that observe it
  double rms_px = 0;
};

class TagChain {
 public:
  /// `corners`: 3 x 4 for each tag, in its frame; `cameras`: one for each image.
  TagChain(std::vector<Eigen::Matrix3Xd> corners, std::vector<const Camera*> cameras,
           std::vector<TagView> views);

  /// Determines the poses of as many of these images as possible. It starts with the pair of images
  /// with the best score; the first image of that pair is the world frame. False without such a
  /// pair.
  bool connect(const std::vector<int>& images);

  /// Fits all images to the tags and all tags to the images.
  void refine_all();

  const std::vector<std::optional<Rigid3>>& cams_from_world() const { return poses_; }
  const std::vector<TagPlacement>& placements() const { return placements_; }

  /// Ratio of a tag's size to the given size, fitted to the posed images, with standard deviation.
  BodyFit scale_of(int tag) const;

 private:
  struct RelativePose {
    int a = -1, b = -1;
    double score = 0;  // sum of fit_score over the common tags
    Rigid3 b_from_a;
  };

  std::vector<int> shared_tags(int a, int b) const;
  const TagView* view(int image, int tag) const;
  double rms_px(const TagView& view, const Rigid3& cam_from_tag) const;
  double fit_score(const TagView& view, const Rigid3& cam_from_tag) const;
  RelativePose relative_pose(int a, int b) const;
  bool pose_image(int image);
  void place_tag(int tag);
  void place_tags_of(int image);
  std::vector<BodyView> body_views(int tag) const;
  int next_image(const std::vector<int>& images, const std::vector<bool>& failed) const;

  std::vector<Eigen::Matrix3Xd> corners_;
  std::vector<const Camera*> cameras_;
  std::vector<TagView> views_;
  std::vector<std::vector<int>> of_image_, of_tag_;  // indices into views_
  std::vector<std::optional<Rigid3>> poses_;
  std::vector<TagPlacement> placements_;
};

}  // namespace occ::internal::calibrate
