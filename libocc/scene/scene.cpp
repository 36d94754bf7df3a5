// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/vector_text.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/lamp_polygon.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

// Reflecting walls must not light lamps from behind. Dark walls have no effect, so they are allowed
// anywhere.
void check_lamps_are_inside(const std::vector<Lamp>& lamps, const Room& room) {
  constexpr double mounting_m = 1e-3;
  if (!(room.wall_reflectance > 0)) return;
  for (const Lamp& lamp : lamps) {
    const Eigen::Vector3d& c = lamp.centre_m;
    if (c.minCoeff() < -mounting_m || (room.size_m - c).minCoeff() < -mounting_m)
      require(false, "lamp " + std::to_string(lamp.id) + ": centre_m", vector_text(c),
              "in the room of " + vector_text(room.size_m) + " m, not behind its walls");
  }
}

// The emitters (channels) of one lamp share an id; two lamps may not.
void check_codes(const std::vector<Lamp>& lamps) {
  std::map<std::tuple<CodeKind, int, int>, int> lamp_of_code;
  for (const Lamp& lamp : lamps) {
    if (!lamp.code) continue;
    const auto [first, is_new] = lamp_of_code.emplace(
        std::tuple(lamp.code->code.kind, lamp.code->id, lamp.code->channel), lamp.id);
    if (!is_new)
      require(false, "lamp " + std::to_string(lamp.id) + ": code", lamp.code->id,
              "unique, lamp " + std::to_string(first->second) + " has the same id");
  }
}

// A sigma of zero for every lamp states that the map is exact: then it is left out.
void check_position_sigmas(const Scene& scene) {
  bool stated = false;
  for (const Lamp& lamp : scene.lamps) {
    if (!lamp.shared_errors_m.empty()) return;
    const std::optional<PerAxis> sigma_m = scene.position_sigma_m(lamp);
    if (sigma_m && !sigma_m->isZero(0)) return;
    stated = stated || sigma_m;
  }
  if (stated)
    require(false, scene.map_sigma_m ? "map_sigma_m" : "lamps: position_sigma_m", 0.0,
            "positive for one lamp or more; leave it out if the map is exact");
}

// Errors are known by their place in the list.
void check_shared_errors(const std::vector<Lamp>& lamps) {
  const Lamp* first = nullptr;
  for (const Lamp& lamp : lamps) {
    if (lamp.shared_errors_m.empty()) continue;
    if (!first) first = &lamp;
    const std::size_t count = first->shared_errors_m.size();
    if (lamp.shared_errors_m.size() != count)
      require(
          false, "lamp " + std::to_string(lamp.id) + ": shared_errors_m",
          std::to_string(lamp.shared_errors_m.size()) + " displacements",
          "as long as that of lamp " + std::to_string(first->id) + ", " + std::to_string(count));
  }
}

}  // namespace

bool Scene::has_discs() const {
  return !std::all_of(lamps.begin(), lamps.end(), &may_have_corners);
}

bool Scene::has_straight_sides() const {
  return std::any_of(lamps.begin(), lamps.end(), &may_have_corners);
}

bool Scene::has_free_forms() const {
  return std::any_of(lamps.begin(), lamps.end(), [](const Lamp& lamp) {
    return is_polygon(lamp) || (is_lame(lamp) && lamp.exponent != 2);
  });
}

bool Scene::has_hollows() const {
  return std::any_of(lamps.begin(), lamps.end(), [](const Lamp& lamp) {
    return is_polygon(lamp) && !is_convex(lamp.corners_m);
  });
}

Eigen::Vector3d Scene::position_variance_m2(const Lamp& lamp) const {
  Eigen::Vector3d variance_m2 = Eigen::Vector3d::Zero();
  if (const auto own = position_sigma_m(lamp)) variance_m2 = own->cwiseAbs2();
  for (const Eigen::Vector3d& displacement_m : lamp.shared_errors_m)
    variance_m2 += displacement_m.cwiseAbs2();
  if (map_scale_sigma > 0)
    variance_m2 += (map_scale_sigma * (lamp.centre_m - mean_lamp_position_m())).cwiseAbs2();
  return variance_m2;
}

Eigen::Vector3d Scene::mean_lamp_position_m() const {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) sum_m += lamp.centre_m;
  return lamps.empty() ? sum_m : Eigen::Vector3d(sum_m / static_cast<double>(lamps.size()));
}

void Scene::validate() {
  sensor.validate();
  std::set<int> ids;
  for (Lamp& lamp : lamps) {
    lamp.validate();
    require(ids.insert(lamp.id).second, "lamps: id", lamp.id, "unique");
  }
  std::set<std::pair<std::string, int>> tag_ids;
  for (Tag& tag : tags) {
    tag.validate();
    require(tag_ids.insert({tag.family, tag.id}).second, "tags: id", tag.id,
            "unique in its family");
  }
  check_codes(lamps);
  if (map_sigma_m && !NotNegative{}.holds(*map_sigma_m))
    require(false, "map_sigma_m", vector_text(*map_sigma_m), "zero or positive");
  require(map_scale_sigma >= 0 && map_scale_sigma < 1, "map_scale_sigma", map_scale_sigma,
          "zero or positive, and below 1");
  check_position_sigmas(*this);
  check_shared_errors(lamps);
  lens.validate();
  effects.validate();
  require(ambient_w_m2 >= 0 && std::isfinite(ambient_w_m2), "ambient_w_m2", ambient_w_m2,
          "zero or positive");
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Box& box = boxes[i];
    const bool is_box =
        box.min_m.allFinite() && box.max_m.allFinite() && (box.max_m - box.min_m).minCoeff() > 0;
    if (!is_box)
      require(false, "boxes[" + std::to_string(i) + "].max_m", vector_text(box.max_m),
              "greater than min_m = " + vector_text(box.min_m) + " in every coordinate");
  }
  if (!room) return;
  check_fields(*room, room_fields, "room.");
  check_lamps_are_inside(lamps, *room);
}

bool Box::hides(const Eigen::Vector3d& to, const Eigen::Vector3d& from) const {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    if (way == 0) {
      if (from[axis] <= min_m[axis] || from[axis] >= max_m[axis]) return false;
      continue;
    }
    const double a = (min_m[axis] - from[axis]) / way, b = (max_m[axis] - from[axis]) / way;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave;
}

Scene Scene::as_rendered() const {
  const auto off = [&](Effect effect) { return effects.of(effect) == Use::off; };
  Scene seen = *this;
  if (off(Effect::distortion)) seen.camera = camera.without_distortion();
  if (off(Effect::vignetting)) seen.lens.vignetting.clear();
  if (off(Effect::glare)) seen.lens.veiling_glare = 0;
  if (off(Effect::ghosts)) seen.lens.ghosts.clear();
  if (off(Effect::ambient)) seen.ambient_w_m2 = 0;
  if (off(Effect::walls) && room) seen.room->wall_reflectance = 0;
  if (off(Effect::occlusion)) seen.boxes.clear();
  if (off(Effect::gain)) seen.sensor.gain_sigma = 0;
  if (off(Effect::mosaic)) seen.sensor.mosaic = Mosaic::none;
  if (off(Effect::saturation)) seen.sensor.full_well_e = 1e30;
  if (off(Effect::response)) {
    seen.sensor.response = Response::linear;
    for (Channel& channel : seen.sensor.channels) channel.response = Response::linear;
  }
  if (!off(Effect::modulation)) return seen;
  for (Lamp& lamp : seen.lamps) {
    lamp.power_w *= lamp.mean_light();
    lamp.frequency_hz.reset();
    lamp.waveform.clear();
  }
  return seen;
}

}  // namespace occ
