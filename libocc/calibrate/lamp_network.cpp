// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/lamp_network.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <optional>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Lamps whose id occurs once in an image; a warning for each other id.
std::vector<SurveyObservation> unique_observations(const SurveyImage& image,
                                                   std::vector<std::string>& warnings) {
  std::map<int, int> counts;
  for (const SurveyObservation& lamp : image.lamps) ++counts[lamp.id];
  std::vector<SurveyObservation> unique;
  for (const SurveyObservation& lamp : image.lamps)
    if (counts[lamp.id] == 1) unique.push_back(lamp);
  for (const auto& [id, count] : counts)
    if (count > 1)
      warnings.push_back("lamp " + std::to_string(id) + " in " + image.name +
                         " left out: its id occurs " + std::to_string(count) + " times");
  return unique;
}

void check_images(const std::vector<NetworkCamera>& cameras,
                  const std::vector<SurveyImage>& images) {
  for (const SurveyImage& image : images) {
    const std::string name = "image " + image.name + ": ";
    require(image.camera >= 0 && image.camera < static_cast<int>(cameras.size()), name + "camera",
            image.camera, "an index of a camera");
    for (const SurveyObservation& lamp : image.lamps) {
      const std::string lamp_name = name + "lamp " + std::to_string(lamp.id);
      require(lamp.px.allFinite(), lamp_name, lamp.px.transpose(), "finite");
      internal::core::require_positive_definite(lamp.covariance_px2,
                                                lamp_name + ": covariance_px2");
    }
  }
}

/// Normal equations of the point with the least sum of squared distances to some rays.
struct RayIntersection {
  Matrix3d normal = Matrix3d::Zero();
  Vector3d rhs = Vector3d::Zero();
  int rays = 0;

  void add(const Ray& ray, const Rigid3& cam_from_world) {
    const Matrix3d to_world = cam_from_world.rotation.transpose();
    const Vector3d origin = cam_from_world.inverse() * ray.origin;
    const Vector3d along = to_world * ray.direction;
    const Matrix3d projector = Matrix3d::Identity() - along * along.transpose();
    normal += projector;
    rhs += projector * origin;
    ++rays;
  }

  /// Nothing for parallel rays.
  std::optional<Vector3d> position() const {
    constexpr double min_angle2 = 1e-6;  // square of an angle of about 1 mrad between the rays
    const auto eigen = internal::core::symmetric_eigen<Matrix3d>(normal, Eigen::EigenvaluesOnly);
    if (!(eigen.eigenvalues()[0] > min_angle2 * rays)) return std::nullopt;
    return Vector3d(internal::core::solve_ldlt(normal, rhs));
  }
};

/// An image with its pose and its lamps.
struct PosedImage {
  int index = 0;  // in the network
  const Camera* camera = nullptr;
  Rigid3 cam_from_world;
  std::vector<SurveyObservation> lamps;
};

std::vector<PosedImage> pose_images(const std::vector<NetworkCamera>& cameras,
                                    const std::map<int, Vector3d>& lamps_m,
                                    const std::vector<SurveyImage>& images, NetworkStart& start) {
  std::vector<PosedImage> all;
  for (const SurveyImage& image : images) {
    PosedImage posed;
    posed.camera = &cameras[image.camera].camera;
    posed.lamps = unique_observations(image, start.warnings);
    std::vector<const SurveyObservation*> given;
    for (const SurveyObservation& lamp : posed.lamps)
      if (lamps_m.count(lamp.id) > 0) given.push_back(&lamp);
    Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(given.size()));
    Eigen::Matrix2Xd px(2, points.cols());
    for (std::size_t i = 0; i < given.size(); ++i) {
      points.col(static_cast<Eigen::Index>(i)) = lamps_m.at(given[i]->id);
      px.col(static_cast<Eigen::Index>(i)) = given[i]->px;
    }
    const Result<Resection> found = resect(points, px, *posed.camera);
    if (!found.ok()) {
      start.warnings.push_back(image.name + " left out: " + found.message);
      continue;
    }
    posed.cam_from_world = found->cam_from_world;
    posed.index = start.network.add_image(image.name, image.camera, posed.cam_from_world);
    start.blocks.resize(1);
    start.blocks[0].push_back(image.name);
    all.push_back(std::move(posed));
  }
  return all;
}

void add_points(const std::vector<PosedImage>& images, const std::map<int, Vector3d>& lamps_m,
                NetworkStart& start) {
  std::map<int, RayIntersection> intersections;
  for (const PosedImage& image : images)
    for (const SurveyObservation& lamp : image.lamps)
      if (const auto ray = image.camera->ray(lamp.px))
        intersections[lamp.id].add(*ray, image.cam_from_world);
  std::map<int, int> points;
  for (const auto& [id, intersection] : intersections) {
    const std::string name = "lamp " + std::to_string(id);
    const auto given = lamps_m.find(id);
    std::optional<Vector3d> position;
    if (intersection.rays > 1)
      position = given != lamps_m.end() ? given->second : intersection.position();
    if (!position) {
      start.warnings.push_back(
          name + " left out: " +
          (intersection.rays > 1 ? "its rays are parallel" : "only one image observes it"));
      continue;
    }
    points[id] = static_cast<int>(start.network.points.size());
    start.network.points.push_back({name, *position, false});
  }
  for (const PosedImage& image : images)
    for (const SurveyObservation& lamp : image.lamps) {
      const auto point = points.find(lamp.id);
      if (point == points.end()) continue;
      ImageObservation observation;
      observation.image = image.index;
      observation.target = Target::of_point(point->second);
      observation.pixel = lamp.px;
      observation.sigma_px = lamp.covariance_px2.diagonal().cwiseSqrt();
      start.network.observations.push_back(observation);
    }
}

}  // namespace

Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                  const std::map<int, Vector3d>& lamps_m,
                                  const std::vector<SurveyImage>& images) {
  check_images(cameras, images);
  for (const auto& [id, position] : lamps_m)
    require(position.allFinite(), "lamps_m[" + std::to_string(id) + "]", position.transpose(),
            "finite");
  Result<NetworkStart> result;
  result.value.network.cameras = cameras;
  const std::vector<PosedImage> posed = pose_images(cameras, lamps_m, images, result.value);
  add_points(posed, lamps_m, result.value);
  if (posed.size() < 2) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(posed.size()) + " of " + std::to_string(images.size()) +
                     " images have a pose; the minimum is two";
  }
  return result;
}

Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras, const Scene& scene,
                                  const std::vector<SurveyImage>& images) {
  std::map<int, Vector3d> lamps_m;
  for (const Lamp& lamp : scene.lamps) lamps_m[lamp.id] = lamp.centre_m;
  Result<NetworkStart> result = lamp_network(cameras, lamps_m, images);
  Network& network = result.value.network;
  std::map<std::string, const Lamp*> by_name;
  for (const Lamp& lamp : scene.lamps) by_name["lamp " + std::to_string(lamp.id)] = &lamp;
  for (ImageObservation& observation : network.observations) {
    const auto lamp = by_name.find(network.points[observation.target.point].name);
    if (lamp == by_name.end()) continue;
    const NetworkImage& image = network.images[observation.image];
    const Camera& camera = cameras[image.camera].camera;
    const Rigid3 pose = network.cam_from_world(observation.image);
    const auto centre = camera.project(pose * lamp->second->centre_m);
    const auto image_centre = project_lamp_centre(*lamp->second, pose, camera);
    if (centre && image_centre) observation.pixel += camera.difference_px(*centre, *image_centre);
  }
  return result;
}

}  // namespace occ
