// SPDX-License-Identifier: Apache-2.0
// Information about the pose in the predicted image of a lamp.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/lamp_pixels.hpp"

namespace occ::internal::refine {

class ExpectedLamps {
 public:
  /// Keeps references.
  ExpectedLamps(const Scene& scene, const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
                Rung rung, FluxModel flux);

  /// Adds the lamp's information; false if it is dark or not completely inside the image. `shared`:
  /// null if no errors are shared.
  bool add(const Lamp& lamp, PoseNormalEquations& normal, SharedSums* shared) const;

 private:
  void add_centroid(const LampObservation& lamp, Eigen::Matrix2d information,
                    PoseNormalEquations& normal, SharedSums* shared) const;
  void add_rim(const LampObservation& lamp, const MovingContour& contour,
               PoseNormalEquations& normal, SharedSums* shared) const;
  void add_flux(const Lamp& lamp, double information, PoseNormalEquations& normal) const;
  double edge_information(double background_e, double full_e) const;

  const Scene& scene_;
  Rigid3 pose_;
  Eigen::Vector3d pivot_;
  RefineOptions options_;
  PixelNoise noise_;
  PixelPsf psf_;
  SharedErrors shared_errors_;
};

}  // namespace occ::internal::refine
