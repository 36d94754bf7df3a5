// SPDX-License-Identifier: Apache-2.0
// Finds AprilTags: printed landmarks with a number (Olson, "AprilTag: a robust and flexible visual
// fiducial system", ICRA 2011; Wang, Olson, "AprilTag 2", IROS 2016), by libapriltag. Its corners
// are then measured again in the full image: each side of the tag is the line through sub-pixel
// edges across it (where the light under the profile is that of a sharp step), a corner the
// intersection of two lines, its covariance that of the lines from how far the edges are off them.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ {

struct LIBOCC_API AprilTagOptions {
  std::string family = "tag36h11";  ///< a name in april_tag_families()
  double decimate = 1;  ///< squares are looked for in an image so many times smaller; 2 takes a
                        ///< third of the time and misses tags below some 30 px
  int threads = 1;
  int max_hamming = 1;  ///< wrong bits that are corrected, 0 to 2; more find more false tags
  double min_decision_margin = 20;  ///< grey levels (of 255) between a bit and its threshold
  bool refine = true;               ///< measure the corners again

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct AprilTag {
  int id = 0;
  std::string family;
  int hamming = 0;             ///< bits that were corrected
  double decision_margin = 0;  ///< mean grey levels (of 255) between a bit and its threshold
  /// Lower left, lower right, upper right, upper left, seen upright; pixel (0, 0) is the *centre*
  /// of the first pixel (libapriltag's is its corner).
  std::array<Eigen::Vector2d, 4> corners_px;
  std::array<Eigen::Matrix2d, 4> covariance_px2;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();       ///< where the diagonals meet
  Eigen::Matrix3d homography = Eigen::Matrix3d::Identity();  ///< from the tag, corners at (-1, -1)
                                                             ///< to (1, 1), y up, to the image
  bool refined = false;  ///< false: too small or cut; corners are libapriltag's, +-0.1 px
};

/// Names of the families that can be read.
LIBOCC_API std::vector<std::string> april_tag_families();

/// The tags in the image, by rising id; none is not an error. Throws std::invalid_argument for a
/// bad view or bad options.
LIBOCC_API std::vector<AprilTag> detect_april_tags(const ImageView& image,
                                                   const AprilTagOptions& options = {});

}  // namespace occ
