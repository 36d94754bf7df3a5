// SPDX-License-Identifier: Apache-2.0
// Rooms, halls and the blobs of their lamps, for tests of surveys without a map.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/network_statistics.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/survey/survey.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ::test {

using Eigen::Vector3d;

inline Scene room_of(const std::vector<Vector3d>& lamps_m) {
  Scene scene;
  scene.camera = Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5);
  for (const Vector3d& at : lamps_m) {
    Lamp lamp;
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.centre_m = at;
    lamp.radius_m = 0.08;
    lamp.validate();
    scene.lamps.push_back(lamp);
  }
  return scene;
}

inline Scene uneven_room() {
  return room_of({{0.8, 0.9, 2.7},
                  {2.9, 0.7, 2.7},
                  {1.7, 1.6, 2.7},
                  {0.7, 2.8, 2.5},
                  {2.6, 2.4, 2.7},
                  {1.8, 3.3, 2.7}});
}

/// Six lamps at other places.
inline Scene other_room() {
  return room_of({{0.5, 0.6, 2.7},
                  {1.9, 0.9, 2.7},
                  {3.1, 2.2, 2.7},
                  {1.2, 2.1, 2.7},
                  {0.9, 3.1, 2.7},
                  {2.4, 3.2, 2.7}});
}

struct MadePicture {
  SurveyPicture picture;
  std::vector<int> lamps;  // of the scene, for each blob
  Rigid3 pose;
};

/// Corners of a rectangle in the image, in the order of Blob::corners_px.
inline std::vector<Eigen::Vector2d> corners_of(const Lamp& lamp, const Rigid3& pose,
                                               const Camera& camera) {
  const Vector3d a = 0.5 * lamp.size_m.x() * lamp.x_axis;
  const Vector3d b = 0.5 * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
  std::vector<Eigen::Vector2d> corners;
  for (const Vector3d& corner :
       {Vector3d(a + b), Vector3d(a - b), Vector3d(-a - b), Vector3d(b - a)})
    corners.push_back(camera.project(pose * (lamp.centre_m + corner)).value());
  return corners;
}

/// Blobs of the lamps that are whole in the image, with the ellipse of their rims. `noise_px`:
/// standard deviation of a centre, per axis, as it follows from the noise of the rim.
inline MadePicture make_picture(const Scene& scene, const Rigid3& pose, const std::string& name,
                                double noise_px, Random& random) {
  MadePicture made;
  made.picture.name = name;
  made.pose = pose;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    constexpr int rim_points = 40;
    const auto rim = project_rim(scene.lamps[i], pose, scene.camera, rim_points);
    if (!rim) continue;
    bool whole = true;
    for (const auto& px : *rim)
      whole = whole && px.x() > 1 && px.y() > 1 && px.x() < scene.camera.width() - 2 &&
              px.y() < scene.camera.height() - 2;
    if (!whole) continue;
    Blob blob;
    blob.centroid_px = project_lamp_centre(scene.lamps[i], pose, scene.camera).value();
    blob.rim = exact_rim(scene.lamps[i], pose, scene.camera, rim_points,
                         std::max(noise_px, 1e-6) * std::sqrt(rim_points / 2.0), 0);
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    Eigen::Vector2d low = rim->front(), high = low;
    const double rim_noise_px = noise_px * std::sqrt(rim_points / 2.0);
    Eigen::Matrix2d normals = Eigen::Matrix2d::Zero();
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (RimPoint& point : blob.rim) {
      const double error = rim_noise_px * random.normal();
      point.px += error * point.normal;
      normals += point.normal * point.normal.transpose();
      sum += error * point.normal;
    }
    blob.centroid_px += normals.inverse() * sum;
    blob.covariance_px2 = square(std::max(rim_noise_px, 1e-6)) * normals.inverse();
    for (const auto& px : *rim) {
      moments += (px - blob.centroid_px) * (px - blob.centroid_px).transpose() / 20.0;
      low = low.cwiseMin(px);
      high = high.cwiseMax(px);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(moments);
    if (scene.lamps[i].shape == LampShape::rectangle)
      blob.corners_px = corners_of(scene.lamps[i], pose, scene.camera);
    blob.ellipse.centre_px = blob.centroid_px;
    blob.ellipse.semi_minor_px = std::sqrt(eigen.eigenvalues()[0]);
    blob.ellipse.semi_major_px = std::sqrt(eigen.eigenvalues()[1]);
    blob.ellipse.angle_rad = std::atan2(eigen.eigenvectors()(1, 1), eigen.eigenvectors()(0, 1));
    blob.x0 = static_cast<int>(low.x());
    blob.y0 = static_cast<int>(low.y());
    blob.x1 = static_cast<int>(high.x());
    blob.y1 = static_cast<int>(high.y());
    const Vector3d in_cam = pose * scene.lamps[i].centre_m;
    const double emission = -(pose.rotation * scene.lamps[i].normal).dot(in_cam) / in_cam.norm();
    blob.flux_dn =
        1e4 * scene.lamps[i].power_w * emission * in_cam.z() / in_cam.norm() / in_cam.squaredNorm();
    made.picture.blobs.push_back(blob);
    made.lamps.push_back(static_cast<int>(i));
  }
  return made;
}

inline std::vector<MadePicture> walk(const Scene& scene, int count, std::uint64_t seed,
                                     double noise_px = 0.03) {
  Random random(seed);
  std::vector<MadePicture> made;
  Vector3d low = scene.lamps[0].centre_m, high = low;
  for (const Lamp& lamp : scene.lamps) {
    low = low.cwiseMin(lamp.centre_m);
    high = high.cwiseMax(lamp.centre_m);
  }
  for (int i = 0; i < count; ++i) {
    const Vector3d at(random.uniform(low.x(), high.x()), random.uniform(low.y(), high.y()),
                      random.uniform(0, 0.6));
    const Vector3d middle = 0.5 * (low + high);
    const Vector3d target(0.6 * at.x() + 0.4 * middle.x() + random.uniform(-0.3, 0.3),
                          0.6 * at.y() + 0.4 * middle.y() + random.uniform(-0.3, 0.3), 2.7);
    const double turn = random.uniform(0, 2 * pi);
    const Rigid3 pose = look_at(at, target, {std::cos(turn), std::sin(turn), 0});
    made.push_back(make_picture(scene, pose, "picture " + std::to_string(i), noise_px, random));
  }
  return made;
}

inline std::vector<SurveyPicture> pictures_of(const std::vector<MadePicture>& made) {
  std::vector<SurveyPicture> pictures;
  for (const MadePicture& one : made) pictures.push_back(one.picture);
  return pictures;
}

/// Lamp of the scene for each lamp of the survey; -2 if blobs of several lamps have its id.
inline std::vector<int> truth_of(const Survey& survey, const std::vector<MadePicture>& made) {
  std::vector<int> truth(survey.lamps.size(), -1);
  for (std::size_t i = 0; i < made.size(); ++i)
    for (std::size_t b = 0; b < made[i].lamps.size(); ++b) {
      const int id = survey.lamp_of_blob[i][b];
      if (id < 0) continue;
      if (truth[id] == -1) truth[id] = made[i].lamps[b];
      if (truth[id] != made[i].lamps[b]) truth[id] = -2;
    }
  return truth;
}

/// Largest difference between distances of lamps in the survey and in the scene.
inline double worst_distance_m(const Survey& survey, const Scene& scene,
                               const std::vector<int>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (truth[i] < 0 || truth[j] < 0) return infinity;
      const double found = (survey.lamps[i].lamp.centre_m - survey.lamps[j].lamp.centre_m).norm();
      const double real = (scene.lamps[truth[i]].centre_m - scene.lamps[truth[j]].centre_m).norm();
      worst = std::max(worst, std::abs(found - real));
    }
  return worst;
}

inline SurveyOptions with_distance(const Scene& scene, const std::vector<MadePicture>& made) {
  const auto free = survey(pictures_of(made), scene.camera);
  EXPECT_TRUE(free.ok()) << free.message;
  const std::vector<int> truth = truth_of(*free, made);
  SurveyOptions options;
  if (truth.size() < 2) return options;
  const int last = static_cast<int>(truth.size()) - 1;
  const double length = (scene.lamps[truth[0]].centre_m - scene.lamps[truth[last]].centre_m).norm();
  options.distances = {{0, last, length, 1e-4}};
  return options;
}

/// The network after the similarity that brings its points nearest to the check points.
inline Network aligned(const Network& network, const std::vector<CheckPoint>& points) {
  Vector3d from = Vector3d::Zero(), to = from;
  const double count = static_cast<double>(points.size());
  for (const CheckPoint& point : points) {
    from += network.position_m(point.target) / count;
    to += point.position_m / count;
  }
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  double spread_from = 0, spread_to = 0;
  for (const CheckPoint& point : points) {
    const Vector3d a = network.position_m(point.target) - from, b = point.position_m - to;
    product += b * a.transpose();
    spread_from += a.squaredNorm();
    spread_to += b.squaredNorm();
  }
  Similarity similarity;
  similarity.rotation = nearest_rotation(product);
  similarity.scale = std::sqrt(spread_to / spread_from);
  similarity.translation = to - similarity.scale * (similarity.rotation * from);
  return transformed(network, similarity);
}

/// Squared errors of the positions over their covariance, free of the similarity between map and
/// scene; sets `dof`. Distances would not do: those of lamps in one plane do not change with small
/// errors across it.
inline double shape_chi2(const Survey& survey, const Scene& scene, const std::vector<int>& truth,
                         int& dof) {
  std::vector<CheckPoint> points;  // those that are determined, as in a scene of the survey
  const auto determined = precision(survey.adjustment.network);
  if (!determined.ok()) return infinity;
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (determined->point(static_cast<int>(i)).allFinite())
      points.push_back({Target::of_point(static_cast<int>(i)),
                        scene.lamps[static_cast<std::size_t>(truth[i])].centre_m});
  const Network network = aligned(survey.adjustment.network, points);
  const auto known = precision(network);
  if (!known.ok()) return infinity;
  const auto count = static_cast<Eigen::Index>(points.size());
  dof = std::max(0, static_cast<int>(3 * count) - 7);
  if (dof == 0) return 0;  // two lamps have a distance only
  Eigen::VectorXd errors(3 * count);
  Eigen::MatrixXd by_similarity(3 * count, 7);  // change of the positions
  std::vector<Target> targets;
  for (Eigen::Index i = 0; i < count; ++i) {
    const CheckPoint& point = points[static_cast<std::size_t>(i)];
    targets.push_back(point.target);
    errors.segment<3>(3 * i) = network.position_m(point.target) - point.position_m;
    by_similarity.middleRows<3>(3 * i) << Eigen::Matrix3d::Identity(), skew(point.position_m),
        point.position_m;
  }
  const Eigen::MatrixXd q = by_similarity.householderQr().householderQ();
  const Eigen::MatrixXd free = q.rightCols(dof);
  const Eigen::MatrixXd covariance = std::max(1.0, square(survey.adjustment.sigma0)) *
                                     free.transpose() * known->joint(targets) * free;
  const Eigen::VectorXd reduced = free.transpose() * errors;
  return reduced.dot(covariance.ldlt().solve(reduced));
}

/// Sums over the maps of many surveys.
struct MapSums {
  int ok = 0, wrong = 0, dof = 0;
  double chi2 = 0;
};

/// Adds a map, and prints a wrong one. `truth`: lamp of the scene of each lamp; negative: none.
inline void add(MapSums& sums, const Survey& survey, const Scene& scene,
                const std::vector<int>& truth, std::uint64_t seed) {
  ++sums.ok;
  int dof = 0;
  const bool mixed = std::any_of(truth.begin(), truth.end(), [](int lamp) { return lamp < 0; });
  const double chi2 = mixed ? infinity : shape_chi2(survey, scene, truth, dof);
  if (chi2 <= dof + 8 * std::sqrt(2.0 * dof)) {
    sums.chi2 += chi2;
    sums.dof += dof;
    return;
  }
  ++sums.wrong;
  std::cout << "seed " << seed << ": wrong, " << truth.size() << " lamps of " << scene.lamps.size()
            << ", chi-square " << chi2 << " of " << dof << ", sigma0 " << survey.adjustment.sigma0
            << ", redundancy " << survey.adjustment.redundancy << ", "
            << survey.adjustment.rejected.size() << " rejected" << std::endl;
}

inline std::ostream& operator<<(std::ostream& out, const MapSums& sums) {
  return out << "ok " << sums.ok << ", wrong " << sums.wrong << ", squared errors over variances "
             << sums.chi2 / sums.dof;
}

/// Lamp of the scene for each blob of a picture; -1: none.
inline std::vector<int> lamps_of_blobs(const std::vector<Blob>& blobs, const Scene& scene,
                                       const Rigid3& pose) {
  constexpr double max_distance_px = 3;
  std::vector<int> lamps(blobs.size(), -1);
  for (std::size_t b = 0; b < blobs.size(); ++b)
    for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
      const auto px = project_lamp_centre(scene.lamps[i], pose, scene.camera);
      if (px && (*px - blobs[b].centroid_px).norm() < max_distance_px)
        lamps[b] = static_cast<int>(i);
    }
  return lamps;
}

/// Pictures of a camera that moves slowly below the lamps and turns, as frames of a video.
inline std::vector<MadePicture> video(const Scene& scene, int count, std::uint64_t seed,
                                      std::vector<Rigid3>& poses, double noise_px = 0.03) {
  Random random(seed);
  std::vector<MadePicture> made;
  Vector3d middle = Vector3d::Zero();
  for (const Lamp& lamp : scene.lamps)
    middle += lamp.centre_m / static_cast<double>(scene.lamps.size());
  for (int i = 0; i < count; ++i) {
    const double turn = 2 * pi * i / count;
    const Vector3d at(middle.x() + 0.5 * std::cos(turn), middle.y() + 0.4 * std::sin(2 * turn),
                      0.3 + 0.2 * std::sin(turn));
    const Vector3d target(middle.x() + 0.1 * std::cos(3 * turn), middle.y(), middle.z());
    poses.push_back(look_at(at, target, {std::cos(turn), std::sin(turn), 0}));
    made.push_back(
        make_picture(scene, poses.back(), "frame " + std::to_string(i), noise_px, random));
  }
  return made;
}

/// The corners of a printed tag in each picture that shows all of it from the front.
inline void add_tag(std::vector<MadePicture>& made, const Scene& scene, const Vector3d& at,
                    double size_m, const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  Random random(4);
  for (MadePicture& one : made) {
    AprilTag tag;
    tag.id = 7;
    const double x[] = {-0.5, 0.5, 0.5, -0.5}, y[] = {0.5, 0.5, -0.5, -0.5};
    bool is_seen = (one.pose.rotation * axes.col(2)).dot(one.pose * at) > 0;
    for (std::size_t k = 0; k < 4 && is_seen; ++k) {  // seen from below: x to the right, y down
      const Vector3d corner = at + size_m * (axes * Vector3d(x[k], y[k], 0));
      const auto px = scene.camera.project(one.pose * corner);
      is_seen = px && px->x() > 0 && px->y() > 0 && px->x() < scene.camera.width() - 1 &&
                px->y() < scene.camera.height() - 1;
      if (!is_seen) break;
      tag.corners_px[k] = *px + noise_2d(random, 0.05);
      tag.covariance_px2[k] = square(0.05) * Eigen::Matrix2d::Identity();
    }
    if (!is_seen) continue;
    for (const Eigen::Vector2d& corner : tag.corners_px) tag.centre_px += corner / 4;
    one.picture.tags.push_back(tag);
  }
}

}  // namespace occ::test
