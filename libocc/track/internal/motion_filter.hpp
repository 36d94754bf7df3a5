// SPDX-License-Identifier: Apache-2.0
// Holds one of the two filters: PoseFilter for a body in space, PlanarFilter for a vehicle.
#pragma once

#include <optional>
#include <variant>

#include "libocc/core/abi.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"

namespace occ::internal::track {

class MotionFilter {
 public:
  explicit MotionFilter(const PoseFilterOptions& options) : filter_(PoseFilter(options)) {}
  explicit MotionFilter(const PlanarFilterOptions& options) : filter_(PlanarFilter(options)) {}

  bool started() const;
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);
  std::optional<PosePrediction> predict(double time_s) const;
  double gate_sigma() const;

  template <typename Measurement>
  FilterUpdate add(const Measurement& measurement) {
    return std::visit([&](auto& filter) { return filter.add(measurement); }, filter_);
  }

  PoseFilter* in_space() { return std::get_if<PoseFilter>(&filter_); }
  PlanarFilter* on_floor() { return std::get_if<PlanarFilter>(&filter_); }
  const PlanarFilter* on_floor() const { return std::get_if<PlanarFilter>(&filter_); }

 private:
  std::variant<PoseFilter, PlanarFilter> filter_;
};

}  // namespace occ::internal::track
