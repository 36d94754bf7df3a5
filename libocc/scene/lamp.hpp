// SPDX-License-Identifier: Apache-2.0
// A lamp: position, shape, radiation and blinking. Data only.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/codes/code.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/per_axis.hpp"

namespace occ {

class EmissionProfile;  // radiometry/emission_profile.hpp

/// lame: the area inside the Lame curve (superellipse) |2x/a|^n + |2y/b|^n = 1.
enum class LampShape {
  disc,       ///< has radius_m
  rectangle,  ///< has size_m
  point,      ///< without extent
  lame,       ///< has size_m and exponent
  polygon,    ///< has corners_m
};

/// The code and the id that a lamp transmits by blinking.
struct LampCode {
  Code code;        ///< modulation and its parameters
  int id = 0;       ///< 0 to 2^id_bits - 1; need not be Lamp::id
  int channel = 0;  ///< s2psk: 0 the lamp, 1 its reference; csk: 0 red, 1 green, 2 blue emitter

  friend bool operator==(const LampCode& a, const LampCode& b) {
    return a.code == b.code && a.id == b.id && a.channel == b.channel;
  }
};

/// A lamp of the room.
struct LIBOCC_API Lamp {
  int id = 0;                                          ///< unique in the scene
  std::string name;                                    ///< optional label
  LampShape shape = LampShape::disc;                   ///< shape of the lit face
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< centre of the lit face in the world
  Eigen::Vector3d normal =
      -Eigen::Vector3d::UnitZ();  ///< towards the lit side; unit after validate()
  double radius_m = 0;            ///< radius of a disc
  Eigen::Vector2d size_m =
      Eigen::Vector2d::Zero();  ///< rectangle, lame: (a, b), along x_axis and across it
  /// Direction of the first side of a rectangle or Lame curve, x in corners_m, and C = 0 of
  /// photometry.
  Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX();
  double exponent = 2;  ///< lame: n in [1, 100]; 2 is an ellipse
  /// polygon: corners (x, y) in the lamp's plane from centre_m, along x_axis and normal x x_axis:
  /// as its lit side is seen, x to the right and y up. After validate() counter-clockwise, with the
  /// centroid of the area at (0, 0).
  std::vector<Eigen::Vector2d> corners_m;
  /// Standard deviations of centre_m along the axes of the world; none: Scene::map_sigma_m.
  std::optional<PerAxis> position_sigma_m;
  /// Errors of the map that lamps share, beside position_sigma_m, which is of this lamp alone:
  /// displacement of centre_m by one standard deviation of each error. All lamps with such errors
  /// list the same ones in the same order.
  std::vector<Eigen::Vector3d> shared_errors_m;
  double size_sigma = 0;  ///< relative standard deviation of radius_m, size_m or corners_m
  /// Standard deviation of the directions of the normal and, of shapes with sides, of x_axis.
  std::optional<double> tilt_sigma_rad;
  double power_w = 1;                          ///< radiant power while lit
  double power_sigma = 0.1;                    ///< relative standard deviation of power_w
  double half_power_rad = 1.0471975511965976;  ///< half-power semi-angle (60 degrees)
  /// Measured emission; none: Lambertian with half_power_rad. power_w is the radiant power of the
  /// lit hemisphere in both cases. C = 0 lies along x_axis, C = 90 degrees along x_axis x normal.
  std::shared_ptr<const EmissionProfile> photometry;
  std::optional<double> frequency_hz;  ///< frequency of blinking; none: always lit
  double duty = 0.5;                   ///< lit fraction of a blink period
  std::vector<double> waveform;  ///< instead of `duty`: light over power_w (0..1) in equal parts
                                 ///< of a period, such as the chips of a code
  double phase = 0;              ///< periods passed at time 0
  std::optional<LampCode> code;  ///< code that frequency_hz and waveform transmit; see set_code()
  /// Response of red, green and blue pixels over that to white light of the same power. It is
  /// compared with the colours in an image if the channels of any lamp of the scene differ.
  Eigen::Vector3d colour = Eigen::Vector3d::Ones();
  /// Relative standard deviation of the ratio of two channels of `colour`, in an image. The default
  /// covers an unknown white balance: its gains for daylight and for tungsten light differ by a
  /// factor of about 2, so that +-1 sigma about the middle is a factor of 1.35, and 2 sigma 1.8.
  double colour_sigma = 0.3;

  double area_m2() const;  ///< area of the emitting face; 0 for a point
  double reach_m() const;  ///< distance of the rim's farthest point from the centre; 0 for a point
  /// Lambertian order m; with photometry its equivalent_order(), for estimates only.
  double order() const;
  double mean_light() const;  ///< mean light over a blink period, over power_w; 1 if always lit
  /// True if a camera at this position (world frame) is on the lit side of the lamp's plane.
  bool shows_lit_side(const Eigen::Vector3d& seen_from) const;

  /// polygon: triangles that cover the face, as indices into corners_m. Empty for other shapes.
  std::vector<std::array<int, 3>> face_triangles() const;

  /// False if the blob's outline has straight sides and the lamp has none.
  bool may_show(const Blob& blob) const;

  /// Sets code, frequency_hz and waveform. Throws std::invalid_argument as encode_id() does.
  void set_code(const LampCode& lamp_code);

  /// Sets photometry. Shape, radius_m, size_m and exponent become those of the luminous opening;
  /// throws std::invalid_argument if the opening faces sideways.
  void set_photometry(std::shared_ptr<const EmissionProfile> profile);

  /// True if x_axis matters: shapes with sides, and photometry that depends on C.
  bool uses_x_axis() const;

  /// Checks all fields. Sets frequency_hz and waveform if there is a code without waveform. With
  /// photometry, a disc without radius_m takes shape and size of the luminous opening, and a shape
  /// with sides without size_m takes those of an opening of that shape. Moves centre_m and
  /// corners_m so that centre_m is the centroid of a polygon's area. Makes normal and x_axis unit
  /// and orthogonal; unless uses_x_axis(), x_axis is replaced by an axis
  /// that depends on the normal only. A second call changes nothing. Throws std::invalid_argument
  /// naming the lamp, the field and its value.
  void validate();
};

}  // namespace occ
