// SPDX-License-Identifier: Apache-2.0
// Renders calibration targets for test pictures: printed AprilTags and circular targets as any
// camera sees them, with the truth. Sheets of paper before an even ground; a pixel is
//
//   grey = sum over sheets, far ones first, of  grey (1 - c_0) + level_0 c_0 + sum of
//          (level_k - level_(k-1)) c_k  + noise
//
// with c_k the coverage of its k-th layer (paper, print), the area under the pixel's box and a
// Gaussian PSF (formation/coverage.hpp) from the outline's projection: a contour integral whose
// points and tangents are projected by the camera itself, so that lens distortion costs nothing.
// Good to 1e-4 of full contrast. Sheets that show their back are not drawn, nor those of which a
// part is outside the camera's domain. A picture that shows more than a turn shows a sheet again.
// Noise is a function of (seed, frame, pixel): a window holds the same bits as the whole image, and
// takes no more memory than its own pixels.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/tag.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

/// A disc on a square sheet of the other tone.
struct LIBOCC_API CircularTarget {
  int id = 0;
  double radius_m = 0;
  double sheet_m = 0;  ///< side of the sheet; 0: four radii
  bool dark = false;   ///< a black disc on white; else a white one on black
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();  ///< towards the printed side

  /// Makes the normal unit; throws std::invalid_argument naming the field and its value.
  void validate();
};

/// A chessboard of (columns + 1) x (rows + 1) squares, that of its first corner black. Inner
/// corners are at (column, row) * square_m of its frame, whose z axis points away from the viewer:
/// columns to the right, rows down.
struct LIBOCC_API ChessboardTarget {
  int columns = 9, rows = 6;  ///< of inner corners
  double square_m = 0;
  Rigid3 world_from_board;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value

  /// Inner corners in its own frame [m], row by row.
  Eigen::Matrix3Xd corners_m() const;
};

struct TargetField {
  std::vector<Tag> tags;
  std::vector<CircularTarget> circles;
  std::vector<ChessboardTarget> boards;
};

struct LIBOCC_API TargetImageOptions {
  double psf_sigma_px = 0.6;
  double black_dn = 30, white_dn = 200, ground_dn = 110;
  double margin_cells = 0.5;  ///< of white paper around a tag's own print or a board, in its cells
  double noise_dn = 0;        ///< standard deviation of a pixel
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;  ///< noise differs from frame to frame under one seed

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Pixels are those of the camera, near the target's centre: across the seam of a camera that sees
/// all around they go on.
struct TagTruth {
  int id = 0;
  bool in_view = false;  ///< drawn, and some of it lies on the image
  bool whole = false;    ///< all of its sheet lies on the image
  std::array<Eigen::Vector2d, 4> corners_px{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                            Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

struct CircleTruth {
  int id = 0;
  bool in_view = false, whole = false;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();        ///< the centre's projection
  Eigen::Vector2d image_centre_px = Eigen::Vector2d::Zero();  ///< centroid of the disc's image
};

struct ChessboardTruth {
  bool in_view = false, whole = false;
  Eigen::Matrix2Xd corners_px;  ///< inner corners, row by row; none when it is not drawn
};

struct TargetTruth {
  std::vector<TagTruth> tags;
  std::vector<CircleTruth> circles;
  std::vector<ChessboardTruth> boards;
};

class LIBOCC_API TargetRenderer {
 public:
  /// Throws std::invalid_argument naming what does not validate: a tag of an unknown family, an id
  /// that the family does not have, a pose that is not finite.
  TargetRenderer(TargetField field, const Camera& camera, const Rigid3& cam_from_world,
                 const TargetImageOptions& options = {});
  TargetRenderer(TargetRenderer&&) noexcept;
  TargetRenderer& operator=(TargetRenderer&&) noexcept;
  ~TargetRenderer();

  const TargetTruth& truth() const;

  /// Eight bits. Throws std::invalid_argument for a window that is empty or leaves the image.
  Image window(const PixelRectangle& window) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The whole image.
LIBOCC_API Image render_targets(const TargetField& field, const Camera& camera,
                                const Rigid3& cam_from_world,
                                const TargetImageOptions& options = {});

}  // namespace occ
