// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/room_light.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/simulate/internal/check_place.hpp"
#include "libocc/simulate/internal/mosaic.hpp"
#include "libocc/simulate/internal/motion.hpp"
#include "libocc/simulate/internal/vignetting.hpp"

namespace occ::internal::simulate {

using namespace internal::scene;
using namespace internal::formation;
namespace {

/// Electrons that pixels get from the surfaces, and which surface they see.
class WallImage {
 public:
  WallImage(const Frame& frame, const RoomSurfaces& surfaces)
      : frame_(frame),
        surfaces_(surfaces),
        camera_(rendered_camera(frame)),
        pose_(Motion(frame).still_pose()),
        origin_(pose_.origin_in_source()) {
    check_in_room(surfaces_.size_m(), origin_);
    if (frame.plan.applies(Effect::vignetting)) vignetting_.emplace(frame.scene);
  }

  struct Sample {
    int face = none;  ///< also `box`
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

  /// Pixels over which light on a surface changes like a straight line, to a thousandth: a fiftieth
  /// of the focal length.
  int even_px() const {
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

/// Adds it to the pixels of these places in the mosaic, one block of pixels after the other.
class WallPainter {
 public:
  WallPainter(const WallImage& walls, const std::array<bool, 4>& places, Signal& signal)
      : walls_(walls), places_(places), signal_(signal), step_(walls.even_px()) {}

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

/// What the pixels of a place get of each lamp's light.
std::vector<double> lamp_light(const Frame& frame, std::size_t place) {
  std::vector<double> light(frame.scene.lamps.size(), 1);
  if (!frame.plan.applies(Effect::mosaic)) return light;
  for (std::size_t i = 0; i < light.size(); ++i)
    light[i] = light_by_place(frame.scene.sensor, frame.scene.lamps[i].colour)[place];
  return light;
}

}  // namespace

void add_room_light(const Frame& frame, Signal& signal) {
  signal.touch_everything();
  std::map<std::vector<double>, std::array<bool, 4>> places_of;  // whose pixels see the same colour
  for (std::size_t place = 0; place < 4; ++place)
    places_of.try_emplace(lamp_light(frame, place)).first->second[place] = true;
  for (const auto& [light, places] : places_of) {
    const RoomSurfaces& surfaces =
        frame.storage.room(frame.scene, light, frame.plan.applies(Effect::interreflection));
    WallPainter(WallImage(frame, surfaces), places, signal).paint();
  }
}

}  // namespace occ::internal::simulate
