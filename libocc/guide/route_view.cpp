// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/internal/route_view.hpp"

#include <cmath>
#include <utility>

#include "libocc/guide/mount.hpp"

namespace occ {

using namespace internal::guide;

RouteView::RouteView(const Scene& scene, const RoutePlanOptions& options)
    : views_(scene, options.view),
      cam_from_body_(camera_on_vehicle(options.view.camera_place_m, options.view.camera_pan_rad,
                                       options.view.camera_tilt_rad)),
      min_lamps_(options.min_lamps),
      max_sigma_m_(options.max_sigma_m) {}

bool RouteView::enough(const PlanarPose& pose) const {
  const std::vector<int> lamps = views_.in_view(cam_from_body_ * body_from_world(pose));
  if (static_cast<int>(lamps.size()) < min_lamps_) return false;
  if (std::isinf(max_sigma_m_)) return true;
  Visibility seen;
  views_.bound(pose, cam_from_body_, lamps, seen);
  return seen.position_sigma_m <= max_sigma_m_;
}

std::vector<ViewGap> RouteView::gaps(const Route& route, double step_m) const {
  GapList gaps;
  for (const RoutePlace& place : route.sampled(step_m)) gaps.add(place, enough(place.pose));
  return std::move(gaps).found();
}

void GapList::add(const RoutePlace& place, bool seen) {
  if (seen) {
    open_ = false;
    return;
  }
  const Eigen::Vector2d here = place.pose.position();
  if (!open_) gaps_.push_back({place.along_m, place.along_m, here, here});
  open_ = true;
  gaps_.back().to_m = place.along_m;
  gaps_.back().to = here;
}

std::vector<ViewGap> view_gaps(const Scene& scene, const Route& route,
                               const RoutePlanOptions& options, double step_m) {
  options.validate();
  Scene checked = scene;
  checked.validate();
  return RouteView(checked, options).gaps(route, step_m);
}

}  // namespace occ
