// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/point_starts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "libocc/calibrate/resection.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/pose/relative_orientation.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int min_resection = 4;       // three points have up to four poses
constexpr int min_intersected = 6;     // points of a relative orientation
constexpr std::size_t max_pairs = 15;  // of images that are tried, those with most common points
// Smallest angle of two rays; below it a distance is uncertain by 30 times the bearing.
constexpr double min_angle_rad = 0.035;

void require_sizes(const std::vector<Camera>& cameras, const std::vector<PixelsOfPoints>& images) {
  require(cameras.size() == images.size(), "cameras", cameras.size(), "one per image");
}

/// Resection and intersection in turn.
class GrowingStart {
 public:
  GrowingStart(const std::vector<Camera>& cameras, const std::vector<PixelsOfPoints>& images,
               PointStarts known)
      : cameras_(cameras), images_(images), starts_(std::move(known)), failed_(images.size(), -1) {
    for (std::size_t i = 0; i < images.size(); ++i)
      for (const auto& [point, pixel] : images[i])
        if (const auto ray = cameras[i].ray(pixel)) rays_[point].emplace_back(i, *ray);
  }

  PointStarts run() {
    while (resect_images() + intersect_points() > 0) {
    }
    return std::move(starts_);
  }

 private:
  int resect_images() {
    std::vector<std::pair<int, int>> waiting;  // number of known points, image
    for (int i = 0; i < static_cast<int>(images_.size()); ++i) {
      if (starts_.cam_from_world.count(i) > 0) continue;
      int known = 0;
      for (const auto& [point, pixel] : images_[i]) known += starts_.points_m.count(point) > 0;
      if (known >= min_resection && known != failed_[i]) waiting.emplace_back(known, i);
    }
    std::sort(waiting.rbegin(), waiting.rend());  // the most known points: the most reliable pose
    int grown = 0;
    for (const auto& [known, i] : waiting) {
      Eigen::Matrix3Xd positions(3, known);
      Eigen::Matrix2Xd pixels(2, known);
      Index k = 0;
      for (const auto& [point, pixel] : images_[i])
        if (const auto at = starts_.points_m.find(point); at != starts_.points_m.end()) {
          positions.col(k) = at->second;
          pixels.col(k++) = pixel;
        }
      const Result<Resection> found = resect(positions, pixels, cameras_[i]);
      if (found.ok()) {
        starts_.cam_from_world[i] = found->cam_from_world;
        ++grown;
      } else {
        failed_[i] = known;
      }
    }
    return grown;
  }

  int intersect_points() {
    int grown = 0;
    for (const auto& [point, rays] : rays_) {
      if (starts_.points_m.count(point) > 0) continue;
      if (const auto at = intersection(rays)) {
        starts_.points_m[point] = *at;
        ++grown;
      }
    }
    return grown;
  }

  /// Point with the least sum of squared distances from the rays of images with a pose.
  std::optional<Vector3d> intersection(const std::vector<std::pair<int, Ray>>& rays) const {
    std::vector<Vector3d> origins, directions;
    Matrix3d sum = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    double smallest = 1;
    for (const auto& [image, ray] : rays) {
      const auto pose = starts_.cam_from_world.find(image);
      if (pose == starts_.cam_from_world.end()) continue;
      origins.push_back(pose->second.inverse() * ray.origin);
      directions.push_back(pose->second.rotation.transpose() * ray.direction);
      for (const Vector3d& other : directions)
        smallest = std::min(smallest, other.dot(directions.back()));
      const Matrix3d across =
          Matrix3d::Identity() - directions.back() * directions.back().transpose();
      sum += across;
      right += across * origins.back();
    }
    if (std::acos(std::max(-1.0, smallest)) < min_angle_rad) return std::nullopt;
    const Vector3d point = internal::core::solve_ldlt(sum, right);
    for (std::size_t i = 0; i < origins.size(); ++i)
      if (!((point - origins[i]).dot(directions[i]) > 0)) return std::nullopt;
    return point;
  }

  const std::vector<Camera>& cameras_;
  const std::vector<PixelsOfPoints>& images_;
  PointStarts starts_;
  std::vector<int> failed_;  // number of known points when the resection of an image failed
  std::map<int, std::vector<std::pair<int, Ray>>> rays_;  // of each point, with their images
};

/// Median distance of observed and projected points; infinite for points that are not in view.
double median_error_px(const std::vector<Camera>& cameras,
                       const std::vector<PixelsOfPoints>& images, const PointStarts& starts) {
  std::vector<double> errors;
  for (const auto& [image, pose] : starts.cam_from_world)
    for (const auto& [point, pixel] : images[image]) {
      const auto at = starts.points_m.find(point);
      if (at == starts.points_m.end()) continue;
      const auto projected = cameras[image].project(pose * at->second);
      errors.push_back(projected ? cameras[image].difference_px(*projected, pixel).norm()
                                 : infinity);
    }
  return errors.empty() ? infinity : median(std::move(errors));
}

/// Two images and the poses of the second in the frame of the first.
struct StartPair {
  int first = 0, second = 0;
  std::vector<RelativePose> poses;
};

std::optional<StartPair> start_pair(const std::vector<Camera>& cameras,
                                    const std::vector<PixelsOfPoints>& images) {
  std::vector<std::map<int, Vector3d>> bearings(images.size());
  for (std::size_t i = 0; i < images.size(); ++i)
    for (const auto& [point, pixel] : images[i])
      if (const auto bearing = cameras[i].unproject(pixel)) bearings[i][point] = *bearing;
  std::vector<std::tuple<int, int, int>> pairs;  // minus the number of common points, images
  for (int i = 0; i < static_cast<int>(images.size()); ++i)
    for (int k = 0; k < i; ++k) {
      int common = 0;
      for (const auto& [point, bearing] : bearings[i]) common += bearings[k].count(point) > 0;
      if (common >= min_intersected) pairs.emplace_back(-common, i, k);
    }
  std::sort(pairs.begin(), pairs.end());
  if (pairs.size() > max_pairs) pairs.resize(max_pairs);
  std::optional<StartPair> best;
  for (const auto& [common, i, k] : pairs) {
    Eigen::Matrix3Xd first(3, -common), second(3, -common);
    Index n = 0;
    for (const auto& [point, bearing] : bearings[i])
      if (const auto other = bearings[k].find(point); other != bearings[k].end()) {
        first.col(n) = other->second;
        second.col(n++) = bearing;
      }
    std::vector<RelativePose> poses = relative_orientation(first, second);
    poses.erase(
        std::remove_if(poses.begin(), poses.end(),
                       [](const RelativePose& pose) { return pose.intersected < min_intersected; }),
        poses.end());
    if (!poses.empty() && (!best || poses[0].intersected > best->poses[0].intersected))
      best = StartPair{k, i, std::move(poses)};
  }
  return best;
}

}  // namespace

PointStarts start_values(const std::vector<Camera>& cameras,
                         const std::vector<PixelsOfPoints>& images, PointStarts known) {
  require_sizes(cameras, images);
  return GrowingStart(cameras, images, std::move(known)).run();
}

std::vector<PointStarts> free_starts(const std::vector<Camera>& cameras,
                                     const std::vector<PixelsOfPoints>& images) {
  require_sizes(cameras, images);
  const std::optional<StartPair> pair = start_pair(cameras, images);
  if (!pair) return {};
  std::vector<std::pair<double, PointStarts>> found;
  std::size_t most = 0;
  for (const RelativePose& pose : pair->poses) {
    PointStarts starts = start_values(
        cameras, images, {{{pair->first, Rigid3()}, {pair->second, pose.second_from_first}}, {}});
    most = std::max(most, starts.cam_from_world.size());
    const double error_px = median_error_px(cameras, images, starts);
    found.emplace_back(error_px, std::move(starts));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<PointStarts> best;
  for (auto& [error_px, starts] : found)
    if (starts.cam_from_world.size() == most) best.push_back(std::move(starts));
  return best;
}

}  // namespace occ
