// SPDX-License-Identifier: Apache-2.0
// Walls: the room's surfaces reflect the lamps' light, once. A diffuse surface of irradiance E has
// the radiance rho E / pi, and a pixel on which it is imaged receives at most pi / 4N^2 of that
// (less by cos^4 off the axis). A box in front of a surface is black. Without the effect the
// surfaces are dark and do not light each other; the lamps' images do not change.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/scene/internal/vignetting.hpp"
#include "libocc/simulate/internal/bounds.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/planning.hpp"

namespace occ::internal::simulate {

using namespace internal::scene;
namespace walls_effect {
namespace {

// Electrons of pixels by light of the surfaces, and the surface that each pixel sees.
class WallImage {
 public:
  WallImage(const Frame& frame, const RoomSurfaces& surfaces)
      : frame_(frame),
        surfaces_(surfaces),
        camera_(rendered_camera(frame)),
        pose_(Motion(frame).still_pose()),
        origin_(pose_.origin_in_source()) {
    check_inside_room(surfaces_.size_m(), origin_);
    if (frame.plan.applies(Effect::vignetting)) vignetting_.emplace(frame.scene);
  }

  struct Sample {
    int face = none;  // of the room, or `none` or `box`
    double electrons = 0;
  };
  static constexpr int none = -1, box = -2;

  Sample at(int x, int y) const {
    Eigen::Matrix<double, 3, 2> jacobian;
    const Sensor& sensor = frame_.scene.sensor;
    const Eigen::Vector2d px(x, y);
    const auto bearing = camera_.unproject(px, &jacobian);
    if (!bearing) return {};
    const RoomSurfaces::Hit hit = surfaces_.hit(origin_, pose_.rotation.transpose() * *bearing);
    if (frame_.plan.applies(Effect::occlusion))
      for (const Box& b : frame_.scene.boxes)
        if (b.hides(hit.point, origin_)) return {box, 0};
    const double exitance = surfaces_.reflectance() * (surfaces_.direct(hit.face, hit.point) +
                                                       surfaces_.indirect(hit.face, hit.point));
    const double irradiance = irradiance_of_radiance(exitance / pi, camera_, sensor, *bearing,
                                                     jacobian.col(0).cross(jacobian.col(1)).norm());
    const double transmission = vignetting_ ? vignetting_->transmission(px) : 1;
    return {hit.face, transmission * (sensor.electrons(irradiance) - sensor.electrons(0))};
  }

  // Side of the blocks in which light on a surface is interpolated linearly [px]. It changes
  // linearly to 1e-3 over 1/50 of the focal length.
  int block_px() const {
    return std::clamp(static_cast<int>(std::min(camera_.fx_px(), camera_.fy_px()) / 50), 1, 8);
  }

 private:
  const Frame& frame_;
  const RoomSurfaces& surfaces_;
  Camera camera_;
  Rigid3 pose_;
  Eigen::Vector3d origin_;
  std::optional<Vignetting> vignetting_;
};

// Adds the light of the surfaces to the pixels of the given places in the mosaic, block by block.
class WallPainter {
 public:
  WallPainter(const WallImage& walls, const std::array<bool, 4>& places, Signal& signal)
      : walls_(walls), places_(places), signal_(signal), step_(walls.block_px()) {}

  void paint() {
    std::vector<WallImage::Sample> upper, lower = line_at(0);
    for (int y0 = 0; y0 < signal_.height(); y0 += step_) {
      upper = std::move(lower);
      lower = line_at(y0 + step_);
      for (std::size_t i = 0; i + 1 < upper.size(); ++i)
        paint_block(static_cast<int>(i) * step_, y0,
                    {upper[i], upper[i + 1], lower[i], lower[i + 1]});
    }
  }

 private:
  using Corners = std::array<WallImage::Sample, 4>;

  std::vector<WallImage::Sample> line_at(int y) const {
    std::vector<WallImage::Sample> line;
    for (int x = 0; x < signal_.width() + step_; x += step_) line.push_back(walls_.at(x, y));
    return line;
  }

  void paint_block(int x0, int y0, const Corners& at) {
    const bool smooth = at[0].face >= 0 && at[0].face == at[1].face && at[0].face == at[2].face &&
                        at[0].face == at[3].face;
    for (int y = y0; y < std::min(y0 + step_, signal_.height()); ++y)
      for (int x = x0; x < std::min(x0 + step_, signal_.width()); ++x) {
        if (!places_[place_of(x, y)]) continue;
        const double u = static_cast<double>(x - x0) / step_,
                     v = static_cast<double>(y - y0) / step_;
        signal_.row(y)[x] += smooth ? (1 - v) * ((1 - u) * at[0].electrons + u * at[1].electrons) +
                                          v * ((1 - u) * at[2].electrons + u * at[3].electrons)
                                    : walls_.at(x, y).electrons;
      }
  }

  const WallImage& walls_;
  const std::array<bool, 4>& places_;
  Signal& signal_;
  int step_;
};

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.room && scene.room->wall_reflectance > 0;
}

double background_e(const SceneView& view) { return surface_electrons(view, 1); }

Bound bound(const SceneView& view) { return {view.grey_levels(max_wall_electrons(view)), 0}; }

// Light of each lamp that the pixels of a place receive.
std::vector<double> lamp_light(const Frame& frame, std::size_t place) {
  std::vector<double> light;
  for (const Lamp& lamp : frame.scene.lamps)
    light.push_back(light_by_place(frame, lamp.colour)[place]);
  return light;
}

void render(const Frame& frame, const ByPlace&, Signal& signal) {
  signal.touch_everything();
  // Places whose pixels receive the same light are painted together.
  std::map<std::vector<double>, std::array<bool, 4>> places_of;
  for (std::size_t place = 0; place < 4; ++place)
    places_of.try_emplace(lamp_light(frame, place)).first->second[place] = true;
  for (const auto& [light, places] : places_of) {
    const RoomSurfaces& surfaces =
        frame.storage.room(frame.scene, light, frame.plan.applies(Effect::interreflection));
    WallPainter(WallImage(frame, surfaces), places, signal).paint();
  }
}

}  // namespace
}  // namespace walls_effect

const EffectModel walls_model = [] {
  EffectModel model{Effect::walls, Stage::charge, walls_effect::called_for,
                    "there is no room, or room.wall_reflectance is 0", walls_effect::bound};
  model.background_e = walls_effect::background_e;
  model.render = walls_effect::render;
  return model;
}();

}  // namespace occ::internal::simulate
