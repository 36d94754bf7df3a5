// SPDX-License-Identifier: Apache-2.0
// Internal: calibration targets as plane figures: outlines of paper and print, and their grey
// levels.
#pragma once

#include <vector>

#include "libocc/geometry/rigid.hpp"
#include "libocc/simulate/internal/target_outline.hpp"
#include "libocc/simulate/targets.hpp"

namespace occ::internal::simulate {

/// A plane figure with its layers from the lowest to the uppermost.
struct TargetFigure {
  Rigid3 cam_from_plane;
  std::vector<PlaneOutline> outlines;
  std::vector<double> levels_dn;
};

TargetFigure tag_figure(const Tag& tag, const Rigid3& cam_from_world, const TargetImageOptions& o);
TargetFigure circle_figure(const CircularTarget& circle, const Rigid3& cam_from_world,
                           const TargetImageOptions& o);
TargetFigure board_figure(const ChessboardTarget& board, const Rigid3& cam_from_world,
                          const TargetImageOptions& o);
TargetFigure grid_figure(const CircleGridTarget& grid, const Rigid3& cam_from_world,
                         const TargetImageOptions& o);
TargetFigure april_grid_figure(const AprilGridTarget& grid, const Rigid3& cam_from_world,
                               const TargetImageOptions& o);
TargetFigure charuco_figure(const CharucoTarget& board, const Rigid3& cam_from_world,
                            const TargetImageOptions& o);

}  // namespace occ::internal::simulate
