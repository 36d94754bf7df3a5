// SPDX-License-Identifier: Apache-2.0
// Relative power and colour of a lamp from its blobs in pictures of known pose. With the intensity
// I(direction) of the lamp per unit of its power, the flux in the image is proportional to
//
//     power I(direction) cos(incidence) / distance^2.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/lamp.hpp"
#include "libocc/survey/survey.hpp"

namespace occ::internal::survey {

/// Blob of a lamp in one picture.
struct BlobInPicture {
  const Blob* blob = nullptr;
  Rigid3 cam_from_world;
};

/// Result of lamp_light().
struct RelativeLight {
  /// Median over the blobs, in a unit that all lamps of the pictures share; nothing if all blobs
  /// are saturated or seen from the side.
  std::optional<double> power;
  double power_sigma = 0;  ///< relative standard deviation of `power` by the scatter of the blobs
  std::optional<Eigen::Vector3d> colour;  ///< mean of the blobs without clipped channels
};

/// Id or frequency that a lamp transmits by blinking.
struct LampSignal {
  std::optional<int> id;    ///< nothing if its blobs have none, or different ones
  double frequency_hz = 0;  ///< median over the blobs; 0: not measured
  double frequency_sigma_hz = 0;
};

LampSignal lamp_signal(const std::vector<BlobInPicture>& blobs);

/// Power and colour of a lamp whose centre, normal and emission are known.
RelativeLight lamp_light(const Lamp& lamp, const std::vector<BlobInPicture>& blobs);

/// Makes the mean power 1 W: the pictures determine ratios only.
void normalise_power(std::vector<SurveyedLamp>& lamps);

}  // namespace occ::internal::survey
