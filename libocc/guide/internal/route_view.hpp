// SPDX-License-Identifier: Apache-2.0
// Checks whether the view from a pose suffices, and finds sections of a route where it does not.
#pragma once

#include <vector>

#include "libocc/guide/internal/lamp_views.hpp"
#include "libocc/guide/plan_route.hpp"

namespace occ::internal::guide {

class RouteView {
 public:
  /// The scene must be valid and outlive this object.
  RouteView(const Scene& scene, const RoutePlanOptions& options);

  bool enough(const PlanarPose& pose) const;
  std::vector<ViewGap> gaps(const Route& route, double step_m) const;

 private:
  LampViews views_;
  Rigid3 cam_from_body_;
  int min_lamps_;
  double max_sigma_m_;
};

/// Joins consecutive positions without view to gaps.
class GapList {
 public:
  void add(const RoutePlace& place, bool seen);
  std::vector<ViewGap> found() && { return std::move(gaps_); }

 private:
  std::vector<ViewGap> gaps_;
  bool open_ = false;
};

}  // namespace occ::internal::guide
