// SPDX-License-Identifier: Apache-2.0
// Occlusion: boxes hide lamps. Seen from a point, a box casts a convex shadow onto the plane of a
// lamp's face. The rest of the face is divided into convex pieces, which are rendered by the
// integral along their rims like a whole face. Without the effect, partly hidden lamps are whole.
// Nothing changes when no shadow meets a lamp; otherwise all of its light may.
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/lamp_image.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace occlusion_effect {
namespace {

// Adds three-point Gauss-Legendre panels, each at most 0.75 spacings long, along the edge from a to
// b.
bool add_edge(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Camera& camera,
              double spacing_px, RimContour& rim) {
  constexpr double node = 0.7745966692414834, outer = 5.0 / 18, inner = 8.0 / 18;
  const auto from = camera.project(a), to = camera.project(b);
  if (!from || !to) return false;
  const int panels = 1 + static_cast<int>((*to - *from).norm() / (0.75 * spacing_px));
  for (int i = 0; i < panels; ++i)
    for (const double t : {-node, 0.0, node})
      rim.push_back({a + (i + 0.5 + 0.5 * t) / panels * (b - a),
                     (t == 0 ? inner : outer) / panels * (b - a)});
  return true;
}

std::vector<std::vector<Eigen::Vector3d>> corners_in_cam(const Lamp& lamp, const Visible& visible,
                                                         const Rigid3& cam_from_world) {
  const Face face(lamp);
  std::vector<std::vector<Eigen::Vector3d>> all;
  for (const Polygon& piece : visible.pieces) {
    all.emplace_back();
    for (const Eigen::Vector2d& corner : piece)
      all.back().push_back(cam_from_world * face.point(corner));
  }
  return all;
}

bool called_for(const Scene& scene, const SimulateOptions&) { return !scene.boxes.empty(); }

Bound bound(const SceneView& view) {
  Bound bound;
  const Eigen::Vector3d seen_from = view.cam_from_world.origin_in_source();
  for (const LampView& seen : view.lamps) {
    if (visible_part(*seen.lamp, view.scene.boxes, seen_from).share == 1) continue;
    bound.include({view.grey_levels(seen.peak_e), 2 * seen.radius_px});
  }
  bound.dn += view.grey_levels(max_wall_electrons(view));
  return bound;
}

}  // namespace
}  // namespace occlusion_effect

std::optional<RimContour> visible_rim(const Lamp& lamp, const Visible& visible,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px) {
  if (visible.share == 1) return rim_contour(lamp, cam_from_world, camera, spacing_px);
  RimContour rim;
  for (const auto& corners : occlusion_effect::corners_in_cam(lamp, visible, cam_from_world))
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (!occlusion_effect::add_edge(corners[i], corners[(i + 1) % corners.size()], camera,
                                      spacing_px, rim))
        return std::nullopt;
  return rim;
}

std::optional<Chords> visible_chords(const Lamp& lamp, const Visible& visible,
                                     const Rigid3& cam_from_world, const Camera& camera) {
  if (visible.share == 1) return project_chords(lamp, cam_from_world, camera);
  Chords chords;
  for (const auto& corners : occlusion_effect::corners_in_cam(lamp, visible, cam_from_world))
    if (!append_polygon(corners, camera, chords)) return std::nullopt;
  return chords;
}

const EffectModel occlusion_model{Effect::occlusion, Stage::lamp_image,
                                  occlusion_effect::called_for, "there are no boxes",
                                  occlusion_effect::bound};

}  // namespace occ::internal::simulate
