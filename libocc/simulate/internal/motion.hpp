// SPDX-License-Identifier: Apache-2.0
// The camera's motion while one image is taken: a constant twist. Times count from the beginning of
// the first line's exposure, when the pose is cam_from_world.
//
// With a rolling shutter, a line's exposure begins a line_time after that of the line before. With
// motion blur a lamp shines into a line from the poses of the whole exposure, without it from the
// pose in the exposure's middle. How a lamp's image is formed follows from what the plan applies.
#pragma once

#include <optional>
#include <vector>

#include "libocc/geometry/motion.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/modulation.hpp"

namespace occ::internal::simulate {

/// A pose from which a lamp shines into a line, and its share of the light in parts of power_w.
struct LightNode {
  double time_s = 0, weight = 1;
};

class Motion {
 public:
  /// Which of the effects that involve time the image contains.
  struct Effects {
    bool blur, rolling_shutter, modulation;
  };
  Motion(const Scene& scene, const Rigid3& cam_from_world, const SimulateOptions& options,
         const Effects& effects);
  explicit Motion(const Frame& frame);

  enum class Kind {
    still,     ///< one pose for all of the image; blinking is not in the image
    blurred,   ///< all lines see the lamp alike; blinking is in the image
    by_lines,  ///< every line has poses and light of its own
  };
  Kind kind(const Lamp& lamp) const;

  /// In which the exposure of a still image happens: the middle of the first line's.
  double still_s() const { return moves_ ? 0.5 * exposure_s_ : 0; }
  Rigid3 pose_at(double time_s) const;
  const Rigid3& still_pose() const { return still_pose_; }

  /// Whether lines see the lamps from poses of their own.
  bool rolls() const { return effects_.rolling_shutter; }
  double line_begin_s(double line) const {
    return effects_.rolling_shutter ? line * line_time_s_ : 0;
  }
  double exposure_s() const { return exposure_s_; }
  int lines() const;
  bool by_columns() const { return scene_.sensor.readout == Readout::columns; }

  /// Poses that a line sees the lamp from: two for every one of `panels` equal parts of the
  /// exposure, exact for images that change as a cubic over a part.
  std::vector<LightNode> nodes(const Lamp& lamp, int line, int panels) const;

  /// Where a point of the world is seen, in the middle of the exposure of the line that sees it.
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
