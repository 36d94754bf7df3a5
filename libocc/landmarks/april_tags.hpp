// SPDX-License-Identifier: Apache-2.0
// Finds AprilTags: printed landmarks with a number (Olson, "AprilTag: a robust and flexible visual
// fiducial system", ICRA 2011; Wang, Olson, "AprilTag 2", IROS 2016), by libapriltag. Its corners
// are then measured again in the full image: each side of the tag is the parabola (a lens bends
// sides) through sub-pixel edges across it (where the light under the profile is that of a sharp
// step), a corner the intersection of two, its covariance from how far the edges are off them.
//
// Very large images are searched tile by tile, in memory that a tile bounds. Tiles overlap, and a
// tag counts in the tile whose middle part holds its centre: tags smaller than the overlap are
// found alike however the image is divided.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
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
  /// How far the middles of a tag's sides (corner k to the next) are off the straight lines between
  /// its corners, towards (-y, x) of that direction [px]; nothing: measured with the corners, which
  /// costs half of their accuracy. For a calibrated camera: calibrate/resection.hpp.
  std::function<std::array<double, 4>(const std::array<Eigen::Vector2d, 4>& corners_px)> bends_px;
  int tile_px = 0;       ///< sides of the tiles, overlap included; 0: the image is one
  int overlap_px = 400;  ///< of neighbouring tiles; with its white border, a tag must be smaller
  /// Called after each tile; false stops the search, which returns what it has found.
  std::function<bool(int tiles_done, int tiles)> progress;

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
  /// Corners have sides in common: these are such that the corners' mean has the covariance it has.
  std::array<Eigen::Matrix2d, 4> covariance_px2;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();       ///< where the diagonals meet
  Eigen::Matrix3d homography = Eigen::Matrix3d::Identity();  ///< from the tag, corners at (-1, -1)
                                                             ///< to (1, 1), y up, to the image
  bool refined = false;  ///< false: too small or cut; corners are libapriltag's, good to 0.1 px
                         ///< and a hundredth of the side
};

/// Names of the families that can be read.
LIBOCC_API std::vector<std::string> april_tag_families();

/// The tags in the image, by rising id; none is not an error. Throws std::invalid_argument for a
/// bad view or bad options.
LIBOCC_API std::vector<AprilTag> detect_april_tags(const ImageView& image,
                                                   const AprilTagOptions& options = {});

/// An image that is read a window at a time: pixels x0 <= x < x0 + width, y0 <= y < y0 + height.
struct ImageReader {
  int width = 0, height = 0;
  std::function<Image(int x0, int y0, int width, int height)> read;
};

/// The same of an image that need not be in memory; options.tile_px = 0 stands for 2048. Throws
/// std::invalid_argument when `read` gives a window of another size, or not always grey of one
/// type. Images of more than 8 bits are read twice.
LIBOCC_API std::vector<AprilTag> detect_april_tags(const ImageReader& image,
                                                   const AprilTagOptions& options = {});

}  // namespace occ
