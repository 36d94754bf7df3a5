// SPDX-License-Identifier: Apache-2.0
// Renders what a camera sees of the lamps, with the truth. Effects so far: extended lamps by their
// rim integral, PSF, Lambertian and cos^4 gradient over the lamp, blinking under a rolling shutter,
// saturation, response, shot and read noise, quantisation.
//
// Mean electrons of a pixel are good to 1e-5 of the lamp's peak (1e-4 for a PSF of 2 px or a focal
// length of 200 px): formation/coverage.hpp, formation/light.hpp. Noise is a function of (seed,
// frame, pixel): the same seed gives the same bits, and a pixel's noise does not depend on lamps
// elsewhere. Lamps do not hide one another and light no walls.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Which pixels have noise.
enum class NoiseArea {
  everywhere,
  around_lamps,  ///< those of Rendered::lit, as with `everywhere`; all others have their mean
};

struct LIBOCC_API SimulateOptions {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;  ///< noise differs from frame to frame under one seed
  bool noise = true;        ///< shot and read noise
  NoiseArea noise_area = NoiseArea::everywhere;  ///< around lamps alone it is much faster
  double start_s = 0;  ///< time at which the first row's exposure begins; blinking lamps begin
                       ///< a period, lit, at time 0
  double spacing_sigma =
      1.0;  ///< rim samples are this many PSF sigmas apart: accuracy against time
  /// Motion of the camera, d [rotation, translation] / dt of the left perturbation of
  /// cam_from_world [rad/s, m/s], a constant twist; the pose is that of the first row's exposure's
  /// beginning. Without motion blur a row sees the pose in the middle of its exposure.
  Vector6 velocity = Vector6::Zero();

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

/// What is true of one lamp in the rendered image. Under a moving camera all points are where they
/// are in the middle of the exposure of the row that sees them.
struct LampTruth {
  int id = 0;
  bool in_view = false;                                 ///< some of its image lies on the sensor
  bool whole = false;                                   ///< all of its rim does
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< projection of the lamp's centre
  Eigen::Vector2d image_centre_px =
      Eigen::Vector2d::Zero();          ///< centre of the lamp's image (ellipse centre)
  double hidden = 0;                    ///< share of its face that boxes hide
  double electrons = 0;                 ///< signal electrons on the sensor, before any clipping
  std::vector<Eigen::Vector2d> rim_px;  ///< empty when it is not in view
};

/// Pixels x0 <= x < x0 + width, y0 <= y < y0 + height.
struct PixelRectangle {
  int x0 = 0, y0 = 0, width = 0, height = 0;
};

struct Rendered {
  Image image;
  Rigid3 cam_from_world;
  std::vector<LampTruth> lamps;     ///< one for each lamp of the scene, in its order
  std::vector<PixelRectangle> lit;  ///< contain every pixel that light of its own reaches
  /// Grey level of all other pixels: at the even and odd columns of even rows, then of odd rows.
  /// None when each has noise of its own.
  std::optional<std::array<int, 4>> background_dn;
};

/// One image; whoever wants many of one scene takes a Renderer (simulate/renderer.hpp), which gives
/// the same bits. An image of the camera's size, 16 bits when the sensor has more than 8. Stripes
/// of blinking lamps follow sensor.row_time_s and sensor.readout (unknown: rows). A lamp whose rim
/// is partly behind the camera or outside the lens's domain, or that shows its dark side, is not
/// rendered; its truth says that it is not in view. Throws std::invalid_argument when the scene,
/// the pose or the options do not validate.
LIBOCC_API Rendered simulate(const Scene& scene, const Rigid3& cam_from_world,
                             const SimulateOptions& options = {});

}  // namespace occ
