// SPDX-License-Identifier: Apache-2.0
// Time within one image: poses of the moving camera, and light of blinking lamps.
//
// The camera moves with a constant twist. Times count from the beginning of the first line's
// exposure, when the pose is cam_from_world. A line is a row or a column, as the sensor reads out.
//
// With a rolling shutter, the exposure of a line begins one line time after that of the line
// before. With motion blur, a line receives light from all poses of its exposure; without it, from
// the pose in the middle of its exposure.
#pragma once

#include <optional>
#include <vector>

#include "libocc/geometry/motion.hpp"
#include "libocc/simulate/internal/frame.hpp"

namespace occ::internal::simulate {

/// Mean light of the lamp over [start_s, start_s + exposure_s] as a fraction of power_w, from its
/// waveform, or from a square wave that is lit for the first `duty` of each period. At t = 0,
/// `phase` periods have passed. 1 for a lamp that does not blink.
double lit_fraction(const Lamp& lamp, double start_s, double exposure_s);

/// Distribution in time of a lamp's light within an interval.
struct LightMoments {
  double mean = 1;         ///< mean light as a fraction of power_w
  double mean_time_s = 0;  ///< mean time since the beginning of the interval
  double sigma_s = 0;      ///< standard deviation of the time
};

/// Moments over an interval. When `blinks` is false, the lamp shines at its mean level throughout.
LightMoments light_moments(const Lamp& lamp, bool blinks, double begin_s, double length_s);

/// Lit fractions of `count` lines from `first` on; 1 for a lamp whose image already includes its
/// blinking (Motion::Kind).
std::vector<double> lit_fractions(const Lamp& lamp, const Frame& frame, int first, int count);

/// A pose from which a line sees a lamp, and its weight as a fraction of power_w.
struct LightNode {
  double time_s = 0, weight = 1;
};

class Motion {
 public:
  /// Effects of time that the image contains.
  struct Effects {
    bool blur, rolling_shutter, modulation;
  };
  Motion(const Scene& scene, const Rigid3& cam_from_world, const SimulateOptions& options,
         const Effects& effects);
  explicit Motion(const Frame& frame);

  enum class Kind {
    still,     ///< one pose for the whole image, which does not include blinking
    blurred,   ///< all lines see the same poses; the image includes blinking
    by_lines,  ///< each line has its own poses and light
  };
  Kind kind(const Lamp& lamp) const;

  /// Time of the pose of a still image: the middle of the first line's exposure.
  double still_s() const { return moves_ ? 0.5 * exposure_s_ : 0; }
  Rigid3 pose_at(double time_s) const;
  const Rigid3& still_pose() const { return still_pose_; }

  /// True if each line sees the lamps from its own poses.
  bool rolls() const { return effects_.rolling_shutter; }
  double line_begin_s(double line) const {
    return effects_.rolling_shutter ? line * line_time_s_ : 0;
  }
  double exposure_s() const { return exposure_s_; }
  int lines() const;
  bool by_columns() const { return scene_.sensor.readout == Readout::columns; }

  /// Poses from which a line sees the lamp: two nodes for each of `panels` equal parts of the
  /// exposure, at the mean time of the light plus and minus its standard deviation. Under steady
  /// light these are Gauss-Legendre nodes, exact for images that change as a cubic within a part.
  std::vector<LightNode> nodes(const Lamp& lamp, int line, int panels) const;

  /// Projection of a point of the world in the middle of the exposure of the line that records it.
  struct Seen {
    Eigen::Vector2d px;
    Rigid3 pose;
  };
  std::optional<Seen> seen(const Eigen::Vector3d& point_in_world, const Camera& camera) const;

 private:
  const Scene& scene_;
  const Rigid3& cam_from_world_;
  const SimulateOptions& options_;
  Effects effects_;
  double exposure_s_, line_time_s_;
  bool moves_;
  Rigid3 still_pose_;
};

}  // namespace occ::internal::simulate
