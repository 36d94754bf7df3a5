// SPDX-License-Identifier: Apache-2.0
// Support for the tests of identification: blobs are computed from the truth, without an image.
#pragma once

#include <algorithm>
#include <vector>

#include "libocc/formation/rim.hpp"
#include "libocc/identify/identify.hpp"
#include "tests/support/support.hpp"

namespace occ::test {

struct View {
  Rigid3 cam_from_world;
  std::vector<Blob> blobs;
  std::vector<int> lamp;  ///< lamp index of each blob; -1 for a false light
};

inline Blob spot(const Eigen::Vector2d& px, double sigma_px, double flux_dn) {
  Blob blob;
  blob.centroid_px = px;
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = flux_dn;
  blob.x0 = static_cast<int>(px.x()) - 4;
  blob.y0 = static_cast<int>(px.y()) - 4;
  blob.x1 = blob.x0 + 8;
  blob.y1 = blob.y0 + 8;
  return blob;
}

/// Blobs of the lamps that are well inside the image, with Gaussian noise.
inline View see(const Scene& scene, const Rigid3& cam_from_world, Random& random, double sigma_px) {
  constexpr double border_px = 18;
  View view{cam_from_world, {}, {}};
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const auto px = project_lamp_centre(scene.lamps[i], cam_from_world, scene.camera);
    if (!px || px->minCoeff() < border_px || px->x() > scene.camera.width() - border_px ||
        px->y() > scene.camera.height() - border_px)
      continue;
    const double distance = (cam_from_world * scene.lamps[i].centre_m).norm();
    const Eigen::Vector2d noise(random.normal(), random.normal());
    view.blobs.push_back(spot(*px + sigma_px * noise, sigma_px, 1e5 / (distance * distance)));
    view.lamp.push_back(static_cast<int>(i));
  }
  return view;
}

inline void hide(View& view, int index) {
  view.blobs.erase(view.blobs.begin() + index);
  view.lamp.erase(view.lamp.begin() + index);
}

/// Adds false lights at random pixels, fainter than most lamps.
inline void add_false_lights(View& view, const Scene& scene, Random& random, int count) {
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d px(random.uniform(10, scene.camera.width() - 10),
                             random.uniform(10, scene.camera.height() - 10));
    view.blobs.push_back(spot(px, 0.1, random.uniform(1e3, 1.5e4)));
    view.lamp.push_back(-1);
  }
}

inline void shuffle(View& view, Random& random) {
  for (int i = static_cast<int>(view.blobs.size()) - 1; i > 0; --i) {
    const std::size_t a = i;
    const std::size_t b = random.below(i + 1);
    std::swap(view.blobs[a], view.blobs[b]);
    std::swap(view.lamp[a], view.lamp[b]);
  }
}

/// True if every lamp of the view is matched with its own blob, and nothing else is matched.
inline bool assignment_is_right(const Hypothesis& h, const View& view) {
  const auto true_lights =
      std::count_if(view.lamp.begin(), view.lamp.end(), [](int lamp) { return lamp >= 0; });
  return static_cast<long>(h.matches.size()) == true_lights &&
         std::all_of(h.matches.begin(), h.matches.end(),
                     [&](const Match& m) { return view.lamp[m.blob] == m.lamp; });
}

inline bool pose_is_near(const Rigid3& a, const Rigid3& b, double position_m = 0.1,
                         double angle_rad = 0.1) {
  return (a.origin_in_source() - b.origin_in_source()).norm() < position_m &&
         so3_log(a.rotation * b.rotation.transpose()).norm() < angle_rad;
}

inline bool holds_truth(const Identification& found, const View& view) {
  return std::any_of(found.hypotheses.begin(), found.hypotheses.end(), [&](const Hypothesis& h) {
    return pose_is_near(h.cam_from_world, view.cam_from_world);
  });
}

/// `count` ceiling lamps at random places at least 0.4 m apart, at heights between low_m and 3 m.
inline Scene random_room(Random& random, int count, double low_m = 3) {
  Scene scene = irregular_room();
  scene.lamps.clear();
  while (static_cast<int>(scene.lamps.size()) < count) {
    const Eigen::Vector3d centre(random.uniform(0.8, 3.2), random.uniform(0.8, 3.2),
                                 random.uniform(low_m, 3));
    const bool crowded = std::any_of(scene.lamps.begin(), scene.lamps.end(), [&](const Lamp& l) {
      return (l.centre_m - centre).head<2>().norm() < 0.4;
    });
    if (!crowded) scene.lamps.push_back(disc_lamp(static_cast<int>(scene.lamps.size()), centre));
  }
  return scene;
}

/// A view from a random pose that shows at least `min_lamps` lamps.
inline View random_view(const Scene& scene, Random& random, int min_lamps, double sigma_px = 0.05) {
  for (;;) {
    View view = see(scene, random_room_pose(random), random, sigma_px);
    if (static_cast<int>(view.blobs.size()) >= min_lamps) return view;
  }
}

/// Expects one hypothesis with the correct assignment and pose.
inline void expect_unique_and_right(const Result<Identification>& found, const View& view) {
  ASSERT_EQ(found.status, Status::ok) << found.message;
  ASSERT_EQ(found->hypotheses.size(), 1u);
  const Hypothesis& h = found->hypotheses.front();
  EXPECT_TRUE(assignment_is_right(h, view));
  EXPECT_TRUE(pose_is_near(h.cam_from_world, view.cam_from_world));
  EXPECT_TRUE(std::is_sorted(h.matches.begin(), h.matches.end(),
                             [](const Match& a, const Match& b) { return a.lamp < b.lamp; }));
}

/// Pose rotated by yaw about the vertical, then tilted about the image's x axis.
inline Rigid3 upright(const Eigen::Vector3d& position, double yaw_rad, double tilt_rad = 0) {
  const Eigen::Matrix3d rotation =
      so3_exp(Eigen::Vector3d(tilt_rad, 0, 0)) * so3_exp(Eigen::Vector3d(0, 0, yaw_rad));
  return {rotation, -(rotation * position)};
}

}  // namespace occ::test
