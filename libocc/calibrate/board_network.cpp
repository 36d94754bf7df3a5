// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/board_network.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

bool is_planar(const Eigen::Matrix3Xd& points) {
  constexpr double min_depth = 1e-3;  // of the board's extent; a flatter board counts as planar
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d scatter = centred * centred.transpose();
  const Eigen::Vector3d values = scatter.selfadjointView<Eigen::Lower>().eigenvalues();
  return !(values[0] > min_depth * min_depth * values[2]);
}

/// Index of a point of the image among the points of the board.
int index_of(const BoardImage& image, Eigen::Index k) {
  return image.indices.empty() ? static_cast<int>(k) : image.indices[static_cast<std::size_t>(k)];
}

/// Points of the board that the image has.
Eigen::Matrix3Xd points_of(const BoardImage& image, const Eigen::Matrix3Xd& board_m) {
  Eigen::Matrix3Xd points(3, image.px.cols());
  for (Eigen::Index k = 0; k < points.cols(); ++k) points.col(k) = board_m.col(index_of(image, k));
  return points;
}

/// Checks the indices against a board of `count` points.
void check_indices(const BoardImage& image, Eigen::Index count) {
  const std::string name = "image " + image.name + ": ";
  if (image.indices.empty() && image.px.cols() > 0) {
    require(image.px.cols() == count, name + "px", image.px.cols(),
            "one for each of the board's " + std::to_string(count) + " points");
    return;
  }
  require(static_cast<Eigen::Index>(image.indices.size()) == image.px.cols(), name + "indices",
          image.indices.size(), "one for each of the " + std::to_string(image.px.cols()) + " px");
  std::vector<bool> is_used(static_cast<std::size_t>(count), false);
  for (const int index : image.indices) {
    require(index >= 0 && index < count, name + "indices", index,
            "indices of the board's " + std::to_string(count) + " points");
    require(!is_used[static_cast<std::size_t>(index)], name + "indices", index,
            "different: an index may occur once");
    is_used[static_cast<std::size_t>(index)] = true;
  }
}

void check_image(const BoardImage& image, const Eigen::Matrix3Xd& board_m) {
  const std::string name = "image " + image.name + ": ";
  check_indices(image, board_m.cols());
  require_finite(image.px, name + "px");
  require(image.covariance_px2.empty() ||
              static_cast<Eigen::Index>(image.covariance_px2.size()) == image.px.cols(),
          name + "covariance_px2", image.covariance_px2.size(), "none, or one for each point");
  for (const Eigen::Matrix2d& covariance : image.covariance_px2)
    internal::core::require_positive_definite(covariance, name + "covariance_px2");
}

}  // namespace

Eigen::Matrix3Xd chessboard_points(int columns, int rows, double square_m) {
  require(columns >= 2, "columns", columns, "at least 2");
  require(rows >= 2, "rows", rows, "at least 2");
  require(square_m > 0 && std::isfinite(square_m), "square_m", square_m, "positive");
  Eigen::Matrix3Xd points(3, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      points.col(row * columns + column) = square_m * Eigen::Vector3d(column, row, 0);
  return points;
}

int correct_disc_centres(Network& network, const std::vector<BoardImage>& images, double radius_m) {
  require(radius_m > 0 && std::isfinite(radius_m), "radius_m", radius_m, "positive");
  require(network.bodies.size() == 1, "network.bodies", network.bodies.size(), "one board");
  const Eigen::Index count = network.bodies[0].corners_m.cols();
  std::map<std::string, std::map<int, Eigen::Vector2d>> by_name;
  for (const BoardImage& image : images) {
    check_indices(image, count);
    std::map<int, Eigen::Vector2d>& measured = by_name[image.name];
    for (Eigen::Index k = 0; k < image.px.cols(); ++k)
      measured[index_of(image, k)] = image.px.col(k);
  }
  int dropped = 0;
  for (ImageObservation& observation : network.observations) {
    const NetworkImage& image = network.images[observation.image];
    const auto measured = by_name.find(image.name);
    require(measured != by_name.end(), "network.images", image.name, "the name of one of `images`");
    const auto point = measured->second.find(observation.target.corner);
    require(point != measured->second.end(), "image " + image.name + ": indices", image.name,
            "those of the network: it has no point " + std::to_string(observation.target.corner));
    const Camera& camera = network.cameras[image.camera].camera;
    const Rigid3 pose = network.cam_from_world(observation.image);
    Lamp disc;
    disc.radius_m = radius_m;
    disc.centre_m = network.position_m(observation.target);
    // The board's z axis points away from the viewer.
    disc.normal = -network.bodies[0].world_from_body.rotation.col(2);
    const auto centre = camera.project(pose * disc.centre_m);
    const auto image_centre = project_lamp_centre(disc, pose, camera);
    if (centre && image_centre) {
      observation.pixel = point->second + camera.difference_px(*centre, *image_centre);
    } else {
      observation.used = false;
      ++dropped;
    }
  }
  return dropped;
}

Result<Camera> start_pinhole(const Eigen::Matrix3Xd& board_m, const std::vector<BoardImage>& images,
                             int width, int height) {
  std::vector<PlaneView> views;
  for (const BoardImage& image : images) {
    check_indices(image, board_m.cols());
    if (image.camera == 0) views.push_back({points_of(image, board_m).topRows<2>(), image.px});
  }
  return start_pinhole(views, width, height);
}

Result<NetworkStart> board_network(const std::vector<NetworkCamera>& cameras,
                                   const Eigen::Matrix3Xd& board_m,
                                   const std::vector<BoardImage>& images, double sigma_px) {
  require(sigma_px > 0 && std::isfinite(sigma_px), "sigma_px", sigma_px, "positive");
  require(board_m.cols() >= 4, "board_m", board_m.cols(), "four points or more");
  require_finite(board_m, "board_m");
  Result<NetworkStart> result;
  Network& network = result.value.network;
  network.cameras = cameras;
  NetworkBody board;
  board.name = "board";
  board.corners_m = board_m;
  board.fixed = true;
  network.bodies = {board};
  std::vector<std::string> names;
  for (const BoardImage& image : images) {
    require(image.camera >= 0 && image.camera < static_cast<int>(cameras.size()),
            "image " + image.name + ": camera", image.camera, "an index of a camera");
    check_image(image, board_m);
    if (image.px.cols() < std::min<Eigen::Index>(min_board_points, board_m.cols())) {
      result.value.warnings.push_back(
          image.name + " left out: it has " + std::to_string(image.px.cols()) +
          " points of the board; the minimum is " + std::to_string(min_board_points));
      continue;
    }
    const Camera& camera = cameras[image.camera].camera;
    const Result<Resection> found = resect(points_of(image, board_m), image.px, camera);
    if (!found.ok()) {
      result.value.warnings.push_back(image.name + " left out: " + found.message);
      continue;
    }
    const int index = network.add_image(image.name, image.camera, found->cam_from_world);
    names.push_back(image.name);
    for (Eigen::Index k = 0; k < image.px.cols(); ++k) {
      ImageObservation observation;
      observation.image = index;
      observation.target = Target::of_corner(0, index_of(image, k));
      observation.pixel = image.px.col(k);
      observation.sigma_px.setConstant(sigma_px);
      if (!image.covariance_px2.empty())
        observation.sigma_px = image.covariance_px2[k].diagonal().cwiseSqrt();
      network.observations.push_back(observation);
    }
  }
  result.value.blocks = {names};
  const std::size_t min_images = is_planar(board_m) ? 2 : 1;
  if (names.size() < min_images) {
    result.status = Status::too_few_lamps;
    result.message = std::to_string(names.size()) +
                     " images of the board have a pose; the minimum is " +
                     std::to_string(min_images);
  }
  return result;
}

}  // namespace occ
