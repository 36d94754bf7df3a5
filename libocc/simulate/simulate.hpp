// SPDX-License-Identifier: Apache-2.0
// Renders the camera image of a scene, with the ground truth. scene/effects.hpp lists the effects
// that the image contains; simulate/effects/ has the model and the equations of each.
//
// The mean electrons of a pixel have an error of 1e-5 of the lamp's peak (1e-4 for a PSF of 2 px or
// a focal length of 200 px): formation/coverage.hpp, formation/light.hpp. Noise is a function of
// (seed, frame, pixel): the same seed gives the same bits, and a pixel's noise does not depend on
// lamps elsewhere. Lamps do not hide one another.
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

/// Pixels that have noise.
enum class NoiseArea {
  everywhere,    ///< all pixels
  around_lamps,  ///< pixels of Rendered::lit, with the bits of `everywhere`; others have their mean
};

/// Options of simulate() for one image.
struct LIBOCC_API SimulateOptions {
  std::uint64_t seed = 0;   ///< equal seeds give equal bits
  std::uint32_t frame = 0;  ///< index of the image; images of one seed differ in noise
  bool noise = true;        ///< shot and read noise
  NoiseArea noise_area = NoiseArea::everywhere;  ///< around_lamps is much faster
  /// Time at which the exposure of the first row begins. At time 0, blinking lamps begin a period.
  double start_s = 0;
  /// Distance of the samples along a rim in PSF sigmas; smaller is more accurate and slower.
  double spacing_sigma = 1.0;
  /// Constant twist of the camera: d [rotation, translation] / dt of the left perturbation of
  /// cam_from_world [rad/s, m/s]. cam_from_world holds at the beginning of the first row's
  /// exposure. Without motion blur, a row sees the pose in the middle of its exposure.
  Vector6 velocity = Vector6::Zero();

  /// Throws std::invalid_argument, naming the field and its value.
  void validate() const;
};

/// Ground truth of one lamp in the rendered image. Under a moving camera, each point is projected
/// in the middle of the exposure of the row that records it.
struct LampTruth {
  int id = 0;                                           ///< id in the scene
  bool in_view = false;                                 ///< part of its image lies on the sensor
  bool whole = false;                                   ///< its whole rim lies on the sensor
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< projection of the lamp's centre
  Eigen::Vector2d image_centre_px =
      Eigen::Vector2d::Zero();          ///< centre of the lamp's image (ellipse centre)
  double hidden = 0;                    ///< fraction of its face that boxes hide
  double electrons = 0;                 ///< signal electrons on the sensor, before any clipping
  std::vector<Eigen::Vector2d> rim_px;  ///< empty if it is not in view
};

/// The pixels x0 <= x < x0 + width, y0 <= y < y0 + height.
struct PixelRectangle {
  /// First column and row, and size; empty if a side is 0.
  int x0 = 0, y0 = 0, width = 0, height = 0;
};

/// A rendered image with its ground truth.
struct Rendered {
  Image image;                      ///< one channel
  Rigid3 cam_from_world;            ///< true pose at the begin of the exposure
  std::vector<LampTruth> lamps;     ///< one per lamp, in the order of the scene
  std::vector<PixelRectangle> lit;  ///< contain all pixels with light beyond the background
  /// Grey level of all other pixels, at the even and odd columns of even rows, then of odd rows.
  /// Empty if these pixels have noise.
  std::optional<std::array<int, 4>> background_dn;
};

/// Renders one image. For many images of one scene, Renderer (simulate/renderer.hpp) is faster and
/// gives the same bits. The image has the camera's size, and 16 bits if the sensor has more than 8.
/// Stripes of blinking lamps follow sensor.row_time_s and sensor.readout (unknown: rows). A lamp is
/// not rendered, and its truth has in_view = false, if its rim is partly behind the camera or
/// outside the lens's domain, or if its dark side is visible. Throws std::invalid_argument if the
/// scene, the pose or the options do not validate.
LIBOCC_API Rendered simulate(const Scene& scene, const Rigid3& cam_from_world,
                             const SimulateOptions& options = {});

}  // namespace occ
