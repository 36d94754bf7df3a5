// SPDX-License-Identifier: Apache-2.0
// Detects AprilTags, printed landmarks with a number (Olson, "AprilTag: a robust and flexible
// visual fiducial system", ICRA 2011; Wang, Olson, "AprilTag 2", IROS 2016), with libapriltag.
//
// The corners are then refined in the full image. Each side of the tag is modelled as a parabola,
// because lens distortion bends straight sides. It is fitted to sub-pixel edges across the side: an
// edge is where a sharp step would have the same integral as the profile. Corners are intersections
// of two sides; their covariance follows from the residuals of the edges.
//
// Very large images are searched tile by tile, which bounds the memory. Tiles overlap, and a tag is
// reported by the tile whose middle part contains its centre. The tags found are independent of the
// tiling if they are smaller than the overlap.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ {

/// Options of detect_april_tags().
struct LIBOCC_API AprilTagOptions {
  std::string family = "tag36h11";  ///< a name in april_tag_families()
  /// Width of the tags' black border [cells], 1 to 4; 2 in grids of Kalibr. Wider borders than 1
  /// are for the families tag36h11, tag36h10, tag25h9 and tag16h5.
  int border_cells = 1;
  double decimate = 1;  ///< factor by which the image is reduced for the search of squares, 1 to 8;
                        ///< 2 takes a third of the time and misses tags below about 30 px
  int threads = 1;      ///< number of threads of the search, at least 1
  int max_hamming = 1;  ///< max number of corrected bits, 0 to 2; more give more false tags
  /// Min of AprilTag::decision_margin. Tags of low contrast are accepted with a quarter of their
  /// contrast, if random bits are read as a tag of the family with a probability of at most 1e-5.
  double min_decision_margin = 20;
  bool refine = true;  ///< refine the corners
  /// Returns the offset of the middle of each side (corner k to k + 1) from the straight line
  /// between its corners [px], positive towards (-y, x) of its direction (x, y). Without it, the
  /// bends are estimated with the corners, which halves their accuracy. For a calibrated camera:
  /// calibrate/resection.hpp.
  std::function<std::array<double, 4>(const std::array<Eigen::Vector2d, 4>& corners_px)> bends_px;
  int tile_px = 0;       ///< side of a tile, overlap included; 0: no tiles
  int overlap_px = 400;  ///< overlap of neighbouring tiles; larger than any tag with its border
  /// Called after each tile; false stops the search, which returns the tags found so far.
  std::function<bool(int tiles_done, int tiles)> progress;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A detected tag.
struct AprilTag {
  int id = 0;                  ///< number within its family
  std::string family;          ///< as in AprilTagOptions
  int hamming = 0;             ///< number of corrected bits
  double decision_margin = 0;  ///< mean difference between bits and threshold [grey levels of 255]
  /// Lower left, lower right, upper right, upper left of the upright tag. Pixel (0, 0) is the
  /// *centre* of the first pixel (in libapriltag its corner).
  std::array<Eigen::Vector2d, 4> corners_px;
  /// Covariances of the corners. Corners are correlated, because they have sides in common; the
  /// covariances are inflated so that the mean of the corners has its correct covariance.
  std::array<Eigen::Matrix2d, 4> covariance_px2;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< intersection of the diagonals
  /// Maps the tag to the image; the tag's corners are (-1, -1) to (1, 1), y up.
  Eigen::Matrix3d homography = Eigen::Matrix3d::Identity();
  bool refined = false;  ///< false: too small or cut; corners are libapriltag's, with a sigma of
                         ///< 0.1 px plus 1 % of the side
};

/// Names of the supported families.
LIBOCC_API std::vector<std::string> april_tag_families();

/// Returns the tags in the image by increasing id; an empty list is not an error. Throws
/// std::invalid_argument for an invalid view or option.
LIBOCC_API std::vector<AprilTag> detect_april_tags(const ImageView& image,
                                                   const AprilTagOptions& options = {});

/// Image that is read in windows: pixels x0 <= x < x0 + width, y0 <= y < y0 + height.
struct ImageReader {
  int width = 0, height = 0;  ///< size of the whole image [px]
  /// Returns the pixels of a window inside the image.
  std::function<Image(int x0, int y0, int width, int height)> read;
};

/// Detects tags in an image that need not be in memory; options.tile_px = 0 means 2048. Throws
/// std::invalid_argument if `read` returns a window of another size, colour, or different pixel
/// types. Images of more than 8 bits are read twice.
LIBOCC_API std::vector<AprilTag> detect_april_tags(const ImageReader& image,
                                                   const AprilTagOptions& options = {});

}  // namespace occ
