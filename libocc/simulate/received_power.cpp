// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/received_power.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "libocc/core/internal/quadrature.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"
#include "libocc/scene/internal/vignetting.hpp"
#include "libocc/scene/view.hpp"

namespace occ {

using namespace internal::scene;
using namespace internal::formation;
using namespace internal::core;
namespace {

// Maps the square [0, 1]^2 to the face of an extended lamp, or to one triangle of it: u along
// chords parallel to x_axis, v across them as the sine of a uniform angle. The map is smooth at the
// ends of a round face. Of a triangle, v is along it from its last corner.
class FaceMap {
 public:
  // One map for a whole face, or one for each triangle of a polygon.
  static std::vector<FaceMap> of(const Lamp& lamp) {
    std::vector<FaceMap> maps;
    for (const std::array<int, 3>& corners : lamp.face_triangles())
      maps.push_back(FaceMap(lamp, corners));
    if (maps.empty()) maps.push_back(FaceMap(lamp));
    return maps;
  }

  Eigen::Vector3d point(double u, double v) const {
    if (is_triangle_) return face_.point(tip_ + v * (to_first_ + u * to_second_));
    const double across = std::sin(pi * (v - 0.5));
    return face_.point({(2 * u - 1) * half_m_.x() * half_chord(across), half_m_.y() * across});
  }

  // Density of the face's area in the square, relative to the whole face.
  double density(double v) const {
    if (is_triangle_) return 2 * part_ * v;
    const double angle = pi * (v - 0.5);
    return part_ * half_chord(std::sin(angle)) * 0.5 * pi * std::cos(angle);
  }

 private:
  FaceMap(const Lamp& lamp, const std::array<int, 3>& corners) : face_(lamp), is_triangle_(true) {
    const auto corner = [&](std::size_t i) -> const Eigen::Vector2d& {
      return lamp.corners_m[static_cast<std::size_t>(corners[i])];
    };
    tip_ = corner(2);
    to_first_ = corner(0) - tip_;
    to_second_ = corner(1) - corner(0);
    part_ = 0.5 * cross_2d(to_first_, to_second_) / lamp.area_m2();
  }

  explicit FaceMap(const Lamp& lamp) : face_(lamp) {
    half_m_ = lamp.shape == LampShape::disc ? Eigen::Vector2d::Constant(lamp.radius_m)
                                            : Eigen::Vector2d(0.5 * lamp.size_m);
    exponent_ = lamp.shape == LampShape::disc ? 2 : lamp.exponent;
    square_ = lamp.shape == LampShape::rectangle;
    part_ = 4 * half_m_.prod() / lamp.area_m2();
  }

  double half_chord(double across) const {
    if (square_) return 1;
    if (exponent_ == 2) return std::sqrt(std::max(0.0, 1 - across * across));
    const double rest = 1 - std::pow(std::abs(across), exponent_);
    return rest > 0 ? std::pow(rest, 1 / exponent_) : 0;
  }

  Face face_;
  Eigen::Vector2d half_m_ = Eigen::Vector2d::Zero();
  double exponent_ = 2;
  double part_ = 1;  // of the box around the face, or the triangle, over the face's area
  bool square_ = false;
  bool is_triangle_ = false;
  Eigen::Vector2d tip_, to_first_, to_second_;
};

// Properties of a scene that all poses share.
struct Receiver {
  explicit Receiver(const Scene& given)
      : scene(given),
        lens_m2(aperture_m2(scene.camera, scene.sensor)),
        vignetting(scene),
        nodes(gauss_legendre(3)) {}

  const Scene& scene;
  double lens_m2;
  Vignetting vignetting;
  std::vector<QuadratureNode> nodes;
};

// One lamp seen from one pose.
class SeenLamp {
 public:
  SeenLamp(const Receiver& receiver, const Lamp& lamp, const Rigid3& pose)
      : receiver_(receiver),
        lamp_(lamp),
        emission_(lamp),
        pose_(pose),
        position_(pose.origin_in_source()) {}

  ReceivedLamp received() {
    if (!lamp_.shows_lit_side(position_) || inside_box(receiver_.scene.boxes, position_)) return {};
    if (!receiver_.scene.boxes.empty())
      hidden_ = 1 - visible_part(lamp_, receiver_.scene.boxes, position_).share;
    if (hidden_ == 1) return {};
    if (lamp_.shape == LampShape::point) {
      const double power_w = power_from(lamp_.centre_m);
      return {power_w, power_w > 0};
    }
    ReceivedLamp sum{0, hidden_ == 0};
    for (const FaceMap& face : FaceMap::of(lamp_))
      for (int i = 0; i < cells_per_side; ++i)
        for (int j = 0; j < cells_per_side; ++j)
          add({1.0 / cells_per_side, i / double{cells_per_side}, j / double{cells_per_side}}, 0,
              face, sum);
    return sum;
  }

 private:
  struct Cell {
    double side, u, v;
  };
  static constexpr int cells_per_side = 4;
  static constexpr int max_depth = 4;        // subdivisions of a cell that a border cuts
  static constexpr int min_depth_boxes = 3;  // in case a box is narrower than a cell

  void add(const Cell& cell, int depth, const FaceMap& face, ReceivedLamp& sum) const {
    int seen = 0;
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}, {0.5, 0.5}})
      seen += sees(face.point(cell.u + u * cell.side, cell.v + v * cell.side)) ? 1 : 0;
    const bool mixed = seen != 0 && seen != 5;
    if (seen != 5) sum.whole = false;
    if (depth < (mixed ? max_depth : hidden_ > 0 ? min_depth_boxes : 0)) {
      const double half = cell.side / 2;
      for (const double u : {cell.u, cell.u + half})
        for (const double v : {cell.v, cell.v + half}) add({half, u, v}, depth + 1, face, sum);
    } else if (seen != 0) {
      sum.power_w += power_of(cell, face);
    }
  }

  double power_of(const Cell& cell, const FaceMap& face) const {
    double sum_w = 0;
    for (const QuadratureNode& across : receiver_.nodes) {
      const double v = cell.v + across.at * cell.side;
      double along_w = 0;
      for (const QuadratureNode& along : receiver_.nodes)
        along_w += along.weight * power_from(face.point(cell.u + along.at * cell.side, v));
      sum_w += across.weight * face.density(v) * along_w;
    }
    return sum_w * cell.side * cell.side;
  }

  bool sees(const Eigen::Vector3d& point) const { return seen_at(point).has_value(); }

  std::optional<Eigen::Vector2d> seen_at(const Eigen::Vector3d& point) const {
    auto px = receiver_.scene.camera.project(pose_ * point);
    if (!px || !receiver_.scene.camera.contains(*px)) return std::nullopt;
    if (hidden_ > 0 && hidden_by_box(receiver_.scene.boxes, point, position_)) return std::nullopt;
    return px;
  }

  // Received power if the whole lamp were at this point.
  double power_from(const Eigen::Vector3d& point) const {
    const auto px = seen_at(point);
    if (!px) return 0;
    const Eigen::Vector3d to_camera = position_ - point;
    const double distance = to_camera.norm();
    const double cos_incidence = receiver_.scene.camera.depth_m(pose_ * point) / distance;
    return receiver_.vignetting.transmission(*px) *
           emission_.aperture_power(lamp_.power_w, to_camera,
                                    to_camera.dot(lamp_.normal) / distance, cos_incidence, distance,
                                    receiver_.lens_m2);
  }

  const Receiver& receiver_;
  const Lamp& lamp_;
  internal::scene::LampEmission emission_;
  const Rigid3& pose_;
  Eigen::Vector3d position_;
  double hidden_ = 0;  // fraction of the face
};

}  // namespace

double ReceivedPower::total_w() const {
  double sum_w = 0;
  for (const ReceivedLamp& lamp : lamps) sum_w += lamp.power_w;
  return sum_w;
}

int ReceivedPower::visible() const {
  return static_cast<int>(std::count_if(lamps.begin(), lamps.end(),
                                        [](const ReceivedLamp& lamp) { return lamp.power_w > 0; }));
}

std::vector<ReceivedPower> received_power(const Scene& given,
                                          const std::vector<Rigid3>& cam_from_world) {
  Scene scene = given;
  scene.validate();
  const Receiver receiver(scene);
  std::vector<ReceivedPower> all;
  all.reserve(cam_from_world.size());
  for (const Rigid3& pose : cam_from_world) {
    const bool finite = pose.rotation.allFinite() && pose.translation.allFinite();
    if (!finite)
      require(false, "cam_from_world[" + std::to_string(all.size()) + "]", pose.matrix(), "finite");
    all.emplace_back();
    for (const Lamp& lamp : scene.lamps)
      all.back().lamps.push_back(SeenLamp(receiver, lamp, pose).received());
  }
  return all;
}

ReceivedPower received_power(const Scene& scene, const Rigid3& cam_from_world) {
  return received_power(scene, std::vector<Rigid3>{cam_from_world}).front();
}

}  // namespace occ
