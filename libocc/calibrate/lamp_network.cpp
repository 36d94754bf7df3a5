// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/lamp_network.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <optional>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Sightings of lamps that an image shows once.
std::vector<LampSighting> single(const SurveyImage& image, std::vector<std::string>& warnings) {
  std::map<int, int> times;
  for (const LampSighting& lamp : image.lamps) ++times[lamp.id];
  std::vector<LampSighting> once;
  for (const LampSighting& lamp : image.lamps)
    if (times[lamp.id] == 1) once.push_back(lamp);
  for (const auto& [id, count] : times)
    if (count > 1)
      warnings.push_back("lamp " + std::to_string(id) + " in " + image.name +
                         " left out: it is seen " + std::to_string(count) + " times");
  return once;
}

void check_images(const std::vector<NetworkCamera>& cameras,
                  const std::vector<SurveyImage>& images) {
  for (const SurveyImage& image : images) {
    const std::string name = "image " + image.name + ": ";
    require(image.camera >= 0 && image.camera < static_cast<int>(cameras.size()), name + "camera",
            image.camera, "an index of a camera");
    for (const LampSighting& lamp : image.lamps) {
      const std::string whose = name + "lamp " + std::to_string(lamp.id);
      require(lamp.px.allFinite(), whose, lamp.px.transpose(), "finite");
      const bool positive =
          lamp.covariance_px2.allFinite() && lamp.covariance_px2.diagonal().minCoeff() > 0;
      require(positive, whose + ": covariance_px2", lamp.covariance_px2.diagonal().transpose(),
              "positive definite");
    }
  }
}

// The place that is nearest to all rays.
struct Meeting {
  Matrix3d across = Matrix3d::Zero();
  Vector3d sum = Vector3d::Zero();
  int rays = 0;

  void add(const Ray& ray, const Rigid3& cam_from_world) {
    const Matrix3d to_world = cam_from_world.rotation.transpose();
    const Vector3d origin = cam_from_world.inverse() * ray.origin;
    const Vector3d along = to_world * ray.direction;
    const Matrix3d projector = Matrix3d::Identity() - along * along.transpose();
    across += projector;
    sum += projector * origin;
    ++rays;
  }

  // Nothing when they are parallel.
  std::optional<Vector3d> place() const {
    constexpr double min_angle2 = 1e-6;  // of a thousandth
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(across, Eigen::EigenvaluesOnly);
    if (!(eigen.eigenvalues()[0] > min_angle2 * rays)) return std::nullopt;
    return Vector3d(across.ldlt().solve(sum));
  }
};

// Images with their poses, and what they show.
struct Posed {
  int index = 0;  // in the network
  const Camera* camera = nullptr;
  Rigid3 cam_from_world;
  std::vector<LampSighting> lamps;
};

std::vector<Posed> pose_images(const std::vector<NetworkCamera>& cameras,
                               const std::map<int, Vector3d>& lamps_m,
                               const std::vector<SurveyImage>& images, NetworkStart& start) {
  std::vector<Posed> all;
  for (const SurveyImage& image : images) {
    Posed posed;
    posed.camera = &cameras[image.camera].camera;
    posed.lamps = single(image, start.warnings);
    std::vector<const LampSighting*> known;
    for (const LampSighting& lamp : posed.lamps)
      if (lamps_m.count(lamp.id) > 0) known.push_back(&lamp);
    Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(known.size()));
    Eigen::Matrix2Xd px(2, points.cols());
    for (std::size_t i = 0; i < known.size(); ++i) {
      points.col(static_cast<Eigen::Index>(i)) = lamps_m.at(known[i]->id);
      px.col(static_cast<Eigen::Index>(i)) = known[i]->px;
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

void add_points(const std::vector<Posed>& images, const std::map<int, Vector3d>& lamps_m,
                NetworkStart& start) {
  std::map<int, Meeting> meetings;
  for (const Posed& image : images)
    for (const LampSighting& lamp : image.lamps)
      if (const auto ray = image.camera->ray(lamp.px))
        meetings[lamp.id].add(*ray, image.cam_from_world);
  std::map<int, int> points;
  for (const auto& [id, meeting] : meetings) {
    const std::string name = "lamp " + std::to_string(id);
    const auto known = lamps_m.find(id);
    std::optional<Vector3d> place;
    if (meeting.rays > 1) place = known != lamps_m.end() ? known->second : meeting.place();
    if (!place) {
      start.warnings.push_back(name + " left out: " +
                               (meeting.rays > 1 ? "its rays are parallel" : "one image sees it"));
      continue;
    }
    points[id] = static_cast<int>(start.network.points.size());
    start.network.points.push_back({name, *place, false});
  }
  for (const Posed& image : images)
    for (const LampSighting& lamp : image.lamps) {
      const auto point = points.find(lamp.id);
      if (point == points.end()) continue;
      ImageObservation seen;
      seen.image = image.index;
      seen.target = Target::of_point(point->second);
      seen.pixel = lamp.px;
      seen.sigma_px = lamp.covariance_px2.diagonal().cwiseSqrt();
      start.network.observations.push_back(seen);
    }
}

}  // namespace

Result<NetworkStart> lamp_network(const std::vector<NetworkCamera>& cameras,
                                  const std::map<int, Vector3d>& lamps_m,
                                  const std::vector<SurveyImage>& images) {
  check_images(cameras, images);
  for (const auto& [id, place] : lamps_m)
    require(place.allFinite(), "lamps_m[" + std::to_string(id) + "]", place.transpose(), "finite");
  Result<NetworkStart> result;
  result.value.network.cameras = cameras;
  const std::vector<Posed> posed = pose_images(cameras, lamps_m, images, result.value);
  add_points(posed, lamps_m, result.value);
  if (posed.size() < 2) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(posed.size()) + " of " + std::to_string(images.size()) +
                     " images have a pose, it takes two";
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
  for (ImageObservation& seen : network.observations) {
    const auto lamp = by_name.find(network.points[seen.target.point].name);
    if (lamp == by_name.end()) continue;
    const NetworkImage& image = network.images[seen.image];
    const Camera& camera = cameras[image.camera].camera;
    const Rigid3 pose = network.cam_from_world(seen.image);
    const auto centre = camera.project(pose * lamp->second->centre_m);
    const auto of_image = project_lamp_centre(*lamp->second, pose, camera);
    if (centre && of_image) seen.pixel += camera.difference_px(*centre, *of_image);
  }
  return result;
}

}  // namespace occ
