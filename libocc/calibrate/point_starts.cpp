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
constexpr int min_common = 4;          // points of a relative orientation
constexpr double min_share = 0.7;      // of the largest number of common points of a pair
constexpr std::size_t max_pairs = 40;  // of images whose relative orientation is computed
constexpr std::size_t max_starts = 3;  // of these
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
  double score = 0;
  std::vector<RelativePose> poses;
};

/// The pairs of images with the highest scores.
std::vector<StartPair> start_pairs(const std::vector<Camera>& cameras,
                                   const std::vector<PixelsOfPoints>& images) {
  std::vector<std::map<int, Vector3d>> bearings(images.size());
  for (std::size_t i = 0; i < images.size(); ++i)
    for (const auto& [point, pixel] : images[i])
      if (const auto bearing = cameras[i].unproject(pixel)) bearings[i][point] = *bearing;
  std::vector<std::tuple<int, int, int>> pairs;  // number of common points, images
  int most = 0;
  for (int i = 0; i < static_cast<int>(images.size()); ++i)
    for (int k = 0; k < i; ++k) {
      int common = 0;
      for (const auto& [point, bearing] : bearings[i]) common += bearings[k].count(point) > 0;
      if (common >= min_common) pairs.emplace_back(common, i, k);
      most = std::max(most, common);
    }
  pairs.erase(
      std::remove_if(pairs.begin(), pairs.end(),
                     [&](const auto& pair) { return std::get<0>(pair) < min_share * most; }),
      pairs.end());
  std::vector<StartPair> found;
  const std::size_t tried = std::min(pairs.size(), max_pairs);
  for (std::size_t n = 0; n < tried; ++n) {
    const auto [common, i, k] = pairs[n * pairs.size() / tried];
    Eigen::Matrix3Xd first(3, common), second(3, common);
    Index column = 0;
    for (const auto& [point, bearing] : bearings[i])
      if (const auto other = bearings[k].find(point); other != bearings[k].end()) {
        first.col(column) = other->second;
        second.col(column++) = bearing;
      }
    std::vector<RelativePose> poses = relative_orientation(first, second);
    const auto is_turned_only = [&](const RelativePose& pose) {
      return pose.intersected < std::max<double>(min_common, min_share * common);
    };
    poses.erase(std::remove_if(poses.begin(), poses.end(), is_turned_only), poses.end());
    if (poses.empty()) continue;
    // The angles are limited, because wide ones gain little and common points are lost.
    constexpr double max_angle_rad = 0.5;
    const double score = poses[0].intersected * std::min(poses[0].angle_rad, max_angle_rad);
    found.push_back({k, i, score, std::move(poses)});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const StartPair& a, const StartPair& b) { return a.score > b.score; });
  if (found.size() > max_starts) found.resize(max_starts);
  return found;
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
  struct Found {
    double error_px;
    PointStarts starts;
  };
  std::vector<Found> found;
  for (const StartPair& pair : start_pairs(cameras, images))
    for (const RelativePose& pose : pair.poses) {
      PointStarts starts = start_values(
          cameras, images, {{{pair.first, Rigid3()}, {pair.second, pose.second_from_first}}, {}});
      const double error_px = median_error_px(cameras, images, starts);
      found.push_back({error_px, std::move(starts)});
    }
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    const std::size_t images_a = a.starts.cam_from_world.size();
    const std::size_t images_b = b.starts.cam_from_world.size();
    return images_a != images_b ? images_a > images_b : a.error_px < b.error_px;
  });
  std::vector<PointStarts> sorted;
  for (Found& one : found) sorted.push_back(std::move(one.starts));
  return sorted;
}

}  // namespace occ
