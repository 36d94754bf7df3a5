// SPDX-License-Identifier: Apache-2.0
// Random bodies with lights, and the blobs that a camera sees of them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/identify/identify.hpp"

namespace occ::bodies {

inline const Camera& camera() {
  static const Camera made = Camera::pinhole(640, 480, 800, 800, 319.5, 239.5);
  return made;
}

inline Eigen::Vector3d random_direction(Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

/// Lights at random places of an ellipsoid half a metre large, each seen within `cone_rad` of the
/// outward normal.
inline Object random_object(Random& random, int points, double cone_rad = 1.4) {
  const Eigen::Vector3d axes(0.5, 0.4, 0.3);
  Object object{"body", {}};
  while (static_cast<int>(object.points.size()) < points) {
    const Eigen::Vector3d u = random_direction(random);
    ObjectPoint p;
    p.id = static_cast<int>(object.points.size());
    p.position_m = axes.cwiseProduct(u);
    p.normal = u.cwiseQuotient(axes).normalized();
    p.cone_rad = cone_rad;
    bool crowded = false;
    for (const ObjectPoint& q : object.points)
      crowded = crowded || (p.position_m - q.position_m).norm() < 0.1;
    if (!crowded) object.points.push_back(p);
  }
  return object;
}

/// Random view from any side, with the object near the middle of the image.
inline Rigid3 random_pose(Random& random, double distance_m,
                          const Eigen::Vector2d& offset_px = Eigen::Vector2d::Zero()) {
  const Eigen::Vector3d place = *camera().unproject(Eigen::Vector2d(319.5, 239.5) + offset_px);
  return {so3_exp(3.14 * random.uniform() * random_direction(random)), distance_m * place};
}

struct Light {
  int object = -1, point = -1;  ///< -1: a false one
};

struct View {
  std::vector<Blob> blobs;
  std::vector<Light> lights;
};

inline void add_blob(View& view, const Eigen::Vector2d& px, double sigma_px, const Light& light) {
  constexpr double min_gap_px = 6;
  for (const Blob& other : view.blobs)
    if ((other.centroid_px - px).norm() < min_gap_px) return;
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = 1e4;
  blob.x0 = blob.x1 = static_cast<int>(px.x());
  blob.y0 = blob.y1 = static_cast<int>(px.y());
  view.blobs.push_back(blob);
  view.lights.push_back(light);
}

/// Returns the blobs of the visible lights of an object, with noise.
inline void add_object(View& view, int index, const Object& object, const Rigid3& pose,
                       Random& random, double sigma_px) {
  for (std::size_t i = 0; i < object.points.size(); ++i) {
    if (!object.points[i].seen_from(pose.origin_in_source())) continue;
    const auto px = camera().project(pose * object.points[i].position_m);
    if (!px || !camera().contains(*px)) continue;
    const Eigen::Vector2d noise(random.normal(), random.normal());
    add_blob(view, *px + sigma_px * noise, sigma_px, {index, static_cast<int>(i)});
  }
}

inline void add_false_lights(View& view, int count, Random& random, double sigma_px) {
  for (int i = 0; i < count; ++i)
    add_blob(view, {random.uniform(0, 639), random.uniform(0, 479)}, sigma_px, {});
}

inline void shuffle(View& view, Random& random) {
  for (int i = static_cast<int>(view.blobs.size()) - 1; i > 0; --i) {
    const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(random.below(i + 1));
    std::swap(view.blobs[a], view.blobs[b]);
    std::swap(view.lights[a], view.lights[b]);
  }
}

inline int lights_of(const View& view, int object) {
  int count = 0;
  for (const Light& light : view.lights) count += light.object == object;
  return count;
}

/// Expects that nearly every match is right.
inline bool is_right(const Hypothesis& hypothesis, const View& view, int object) {
  int right = 0;
  for (const Match& m : hypothesis.matches) {
    const Light& light = view.lights[m.blob];
    right += light.object == object && light.point == m.lamp;
  }
  return right >= 4 && right + 1 >= static_cast<int>(hypothesis.matches.size());
}

}  // namespace occ::bodies
