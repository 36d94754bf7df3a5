// SPDX-License-Identifier: Apache-2.0
// Renders calibration targets for test images, with the ground truth: printed AprilTags, circular
// targets, chessboards, grids of discs or tags, and ChArUco boards, seen by any camera model.
// Targets are sheets of paper in front of an even ground. Sheets are painted from far to near; a
// sheet changes the grey level of a pixel to
//
//   grey (1 - c_0) + level_0 c_0 + sum over k >= 1 of (level_k - level_(k-1)) c_k,
//
// with c_k the coverage of its k-th layer (paper, print); noise is added at the end. Coverage is
// the area under the pixel's box and a Gaussian PSF (formation/coverage.hpp), a contour integral
// along the projected outline. The camera model projects its points and tangents, so lens
// distortion is exact. The error is 1e-4 of full contrast.
//
// Sheets seen from behind are not drawn, nor sheets that are partly outside the camera's domain. An
// image of more than 360 degrees shows a sheet more than once. Noise is a function of (seed, frame,
// pixel): a window has the same bits as the whole image, and needs memory for its own pixels only.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/marker_boards.hpp"
#include "libocc/scene/tag.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

/// Cells of a printed AprilTag: those inside its square, and the family's ring around it.
struct TagPattern {
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> black;  ///< rows from the top, columns
  int square_cells = 0;  ///< side of the square whose corners are detected, in the middle [cells]
};

/// border_cells: width of the black border, 1 to 4; above 1 for the families tag36h11, tag36h10,
/// tag25h9 and tag16h5 only. Throws std::invalid_argument for an unknown family, an id that the
/// family does not have, or such a border.
LIBOCC_API TagPattern tag_pattern(const std::string& family, int id, int border_cells = 1);

/// A disc on a square sheet of the opposite tone.
struct LIBOCC_API CircularTarget {
  int id = 0;           ///< label, copied to the truth
  double radius_m = 0;  ///< radius of the disc
  double sheet_m = 0;   ///< side of the sheet; 0 selects four radii
  bool dark = false;    ///< true: black disc on white; false: white disc on black
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< in the world
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();  ///< direction that the printed side faces

  /// Normalises `normal`. Throws std::invalid_argument, naming the field and its value.
  void validate();
};

/// A chessboard of (columns + 1) x (rows + 1) squares, of which the first, at the upper left, is
/// black. Inner corners are at (column, row) * square_m in the board's frame: x to the right, y
/// down, z away from the viewer.
struct LIBOCC_API ChessboardTarget {
  int columns = 9, rows = 6;  ///< numbers of inner corners
  double square_m = 0;        ///< side of a square
  Rigid3 world_from_board;    ///< pose of the board

  void validate() const;  ///< throws std::invalid_argument, naming the field and its value

  /// Inner corners in the board's frame [m], row by row.
  Eigen::Matrix3Xd corners_m() const;
};

/// A grid of discs on a sheet of the opposite tone. Centres are at (column, row) spacing_m in the
/// board's frame, or at (2 column + row % 2, row) spacing_m if asymmetric: x to the right, y down,
/// z away from the viewer.
struct LIBOCC_API CircleGridTarget {
  int columns = 4, rows = 11;  ///< number of discs of a row, and of rows
  bool asymmetric = true;      ///< odd rows are shifted by spacing_m
  double spacing_m = 0;        ///< distance of the rows
  double radius_m = 0;         ///< radius of the discs
  bool dark = true;            ///< true: black discs on white; false: white discs on black
  Rigid3 world_from_board;     ///< pose of the board

  void validate() const;  ///< throws std::invalid_argument, naming the field and its value

  /// Centres of the discs in the board's frame [m], row by row.
  Eigen::Matrix3Xd centres_m() const;
};

/// A grid of AprilTags in the world.
struct LIBOCC_API AprilGridTarget {
  AprilGrid board;          ///< the print
  Rigid3 world_from_board;  ///< pose of the board: x to the right, y up, z towards the viewer

  void validate() const;  ///< throws std::invalid_argument, naming the field and its value
};

/// A ChArUco board in the world.
struct LIBOCC_API CharucoTarget {
  CharucoBoard board;       ///< the print
  Rigid3 world_from_board;  ///< pose of the board: x to the right, y down, z away from the viewer

  void validate() const;  ///< throws std::invalid_argument, naming the field and its value
};

/// All targets of an image.
struct TargetField {
  std::vector<Tag> tags;                       ///< printed in black on white
  std::vector<CircularTarget> circles;         ///< single discs
  std::vector<ChessboardTarget> boards;        ///< chessboards
  std::vector<CircleGridTarget> grids;         ///< grids of discs
  std::vector<AprilGridTarget> april_grids{};  ///< grids of tags
  std::vector<CharucoTarget> charucos{};       ///< chessboards with markers
};

/// Options of a TargetRenderer.
struct LIBOCC_API TargetImageOptions {
  double psf_sigma_px = 0.6;  ///< Gaussian blur, without the pixel's box
  /// Grey levels of print, paper and background.
  double black_dn = 30, white_dn = 200, ground_dn = 110;
  /// White paper around the print of a tag, a board or a grid [cells, squares, spacings, gaps].
  double margin_cells = 0.5;
  double noise_dn = 0;      ///< standard deviation of the noise of a pixel
  std::uint64_t seed = 0;   ///< equal seeds give equal bits
  std::uint32_t frame = 0;  ///< index of the image; images of one seed differ in noise

  void validate() const;  ///< throws std::invalid_argument, naming the field and its value
};

/// Truth of one tag. Pixels are those of the camera. In an image of 360 degrees they are continuous
/// across the seam, relative to the target's centre.
struct TagTruth {
  int id = 0;            ///< number within its family
  bool in_view = false;  ///< it is drawn, and part of it lies on the image
  bool whole = false;    ///< its whole sheet lies on the image
  /// In the order of AprilTag::corners_px.
  std::array<Eigen::Vector2d, 4> corners_px{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                            Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

/// Truth of one circular target.
struct CircleTruth {
  int id = 0;                                                 ///< id of the target
  bool in_view = false, whole = false;                        ///< as in TagTruth
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();        ///< projection of the centre
  Eigen::Vector2d image_centre_px = Eigen::Vector2d::Zero();  ///< centroid of the disc's image
};

/// Truth of one chessboard.
struct ChessboardTruth {
  bool in_view = false, whole = false;  ///< as in TagTruth
  Eigen::Matrix2Xd corners_px;          ///< inner corners, row by row; empty if it is not drawn
};

/// Truth of one board with tags.
struct MarkerBoardTruth {
  bool in_view = false, whole = false;  ///< as in TagTruth
  Eigen::Matrix2Xd points_px;  ///< points of the board in their order; empty if it is not drawn
};

/// Truth of one grid of discs.
struct CircleGridTruth {
  bool in_view = false, whole = false;  ///< as in TagTruth
  Eigen::Matrix2Xd centres_px;  ///< projections of the centres, row by row; empty if not drawn
};

/// Truth of all targets.
struct TargetTruth {
  std::vector<TagTruth> tags;                 ///< in the order of the field
  std::vector<CircleTruth> circles;           ///< in the order of the field
  std::vector<ChessboardTruth> boards;        ///< in the order of the field
  std::vector<CircleGridTruth> grids;         ///< in the order of the field
  std::vector<MarkerBoardTruth> april_grids;  ///< in the order of the field
  std::vector<MarkerBoardTruth> charucos;     ///< in the order of the field
};

/// Renders windows of one image.
class LIBOCC_API TargetRenderer {
 public:
  /// Projects all targets. Throws std::invalid_argument if a target or the options do not validate,
  /// a tag has an unknown family or an id that the family does not have, or the pose is not finite.
  TargetRenderer(TargetField field, const Camera& camera, const Rigid3& cam_from_world,
                 const TargetImageOptions& options = {});
  TargetRenderer(TargetRenderer&&) noexcept;
  TargetRenderer& operator=(TargetRenderer&&) noexcept;
  ~TargetRenderer();

  /// Truth of the whole image, computed by the constructor.
  const TargetTruth& truth() const;

  /// Image of 8 bits. Throws std::invalid_argument if the window is empty or not inside the image.
  Image window(const PixelRectangle& window) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace occ
