// SPDX-License-Identifier: Apache-2.0
// Internal: images and tags of one block, posed one after the other.
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
  Eigen::Matrix2Xd px;  ///< of the four corners
  double sigma_px = 0.1;
  std::vector<TagSighting> sightings;
};

struct TagPlace {
  std::optional<Rigid3> world_from_tag;
  int views = 0;  ///< images of known pose that see it
  double rms_px = 0;
};

class TagChain {
 public:
  /// `corners`: of each tag in its frame; `cameras`: of each image.
  TagChain(std::vector<Eigen::Matrix3Xd> corners, std::vector<const Camera*> cameras,
           std::vector<TagView> views);

  /// Poses what it can of these images, from the pair that agrees best; the first image of that
  /// pair is the world's frame. False when there is none.
  bool link(const std::vector<int>& images);

  /// Fits all images to the tags and all tags to the images.
  void sweep();

  const std::vector<std::optional<Rigid3>>& cams_from_world() const { return poses_; }
  const std::vector<TagPlace>& places() const { return places_; }

  /// Its size over the stated one as the images of known pose see it, with a standard deviation.
  BodyFit scale_of(int tag) const;

 private:
  struct PairStart {
    int a = -1, b = -1;
    double agree = 0;  // tags, each by how well
    Rigid3 b_from_a;
  };

  std::vector<int> shared_tags(int a, int b) const;
  const TagView* view(int image, int tag) const;
  double rms_px(const TagView& view, const Rigid3& cam_from_tag) const;
  double likely(const TagView& view, const Rigid3& cam_from_tag) const;
  PairStart relative_pose(int a, int b) const;
  bool pose_image(int image);
  void place_tag(int tag);
  void place_tags_of(int image);
  std::vector<BodyView> body_views(int tag) const;
  int next_image(const std::vector<int>& images, const std::vector<bool>& failed) const;

  std::vector<Eigen::Matrix3Xd> corners_;
  std::vector<const Camera*> cameras_;
  std::vector<TagView> views_;
  std::vector<std::vector<int>> of_image_, of_tag_;  // indices of views
  std::vector<std::optional<Rigid3>> poses_;
  std::vector<TagPlace> places_;
};

}  // namespace occ::internal::calibrate
