// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_block.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/precision.hpp"
#include "libocc/survey/internal/shape_fit.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int min_rays = 3;                // two rays of different lamps may meet by chance
constexpr std::size_t max_pairs = 200000;  // of rays that are intersected for one lamp
constexpr double min_parallax_rad = 0.02;
constexpr double ray_gate_px = 1;  // error of an adjusted pose, and of a centre's bias
constexpr double ray_gate_sigmas = 4;

double variance_factor_of(const Adjustment& adjusted) {
  constexpr int min_redundancy = 10;  // sigma0 is then known to 22 %
  const double variance = square(adjusted.sigma0);
  return adjusted.redundancy >= min_redundancy ? variance : std::max(1.0, variance);
}

}  // namespace

LampBlock::LampBlock(const Survey& found, const std::vector<SurveyPicture>& pictures,
                     const Camera& camera, int threads)
    : pictures_(pictures),
      camera_(camera),
      threads_(threads),
      network_(found.adjustment.network),
      variance_factor_(variance_factor_of(found.adjustment)),
      lamp_of_blob_(found.lamp_of_blob),
      warnings_(found.warnings) {
  picture_of_image_.assign(network_.images.size(), -1);
  for (std::size_t i = 0; i < found.image_of_picture.size(); ++i)
    if (found.image_of_picture[i] >= 0)
      picture_of_image_[found.image_of_picture[i]] = static_cast<int>(i);
  for (const SurveyedLamp& surveyed : found.lamps) {
    point_of_lamp_.push_back(static_cast<int>(lamps_.size()));
    BlockLamp lamp;
    lamp.number = surveyed.lamp.id;
    lamp.lamp = surveyed.lamp;
    lamp.has_shape = surveyed.has_shape;
    lamps_.push_back(lamp);
  }
  model_sigma_px_ = model_sigma_px();
  if (add_missed_lamps()) adjust_again();
  update_lamps();
  remove_undetermined();
}

std::vector<RejectedBlob> LampBlock::rejected() const {
  std::vector<RejectedBlob> found;
  for (const ImageObservation& observation : network_.observations) {
    const auto lamp =
        std::find(point_of_lamp_.begin(), point_of_lamp_.end(), observation.target.point);
    if (observation.used || lamp == point_of_lamp_.end()) continue;
    const int index = static_cast<int>(lamp - point_of_lamp_.begin());
    const int picture = picture_of_image_[observation.image];
    const std::vector<int>& lamps = lamp_of_blob_[picture];
    const auto blob = std::find(lamps.begin(), lamps.end(), index);
    if (blob != lamps.end())
      found.push_back({picture, static_cast<int>(blob - lamps.begin()), index});
  }
  return found;
}

std::optional<Rigid3> LampBlock::pose(int picture) const {
  const auto image = std::find(picture_of_image_.begin(), picture_of_image_.end(), picture);
  if (image == picture_of_image_.end()) return std::nullopt;
  return network_.cam_from_world(static_cast<int>(image - picture_of_image_.begin()));
}

double LampBlock::model_sigma_px() const {
  std::vector<double> variances;
  for (const ImageObservation& observation : network_.observations) {
    const int picture = picture_of_image_[observation.image];
    const std::vector<int>& lamps = lamp_of_blob_[picture];
    const auto blob = std::find(lamps.begin(), lamps.end(), observation.target.point);
    if (observation.target.point < 0 || blob == lamps.end()) continue;
    const Blob& seen = pictures_[picture].blobs[blob - lamps.begin()];
    variances.push_back(square(observation.sigma_px.x()) -
                        std::max(0.0, seen.covariance_px2(0, 0)));
  }
  return std::sqrt(std::max(0.0, median(std::move(variances))));
}

std::vector<LampBlock::Ray> LampBlock::rays_without_lamp() const {
  std::vector<Ray> rays;
  for (std::size_t image = 0; image < picture_of_image_.size(); ++image) {
    const int picture = picture_of_image_[image];
    const Rigid3 world_from_cam = network_.cam_from_world(static_cast<int>(image)).inverse();
    for (std::size_t b = 0; b < pictures_[picture].blobs.size(); ++b) {
      const Blob& blob = pictures_[picture].blobs[b];
      if (lamp_of_blob_[picture][b] >= 0 || blob.cut_by_border || blob.merged) continue;
      Eigen::Matrix<double, 3, 2> jacobian;
      const auto bearing = camera_.unproject(blob.centroid_px, &jacobian);
      if (!bearing) continue;
      const double px = ray_gate_px + ray_gate_sigmas * std::sqrt(blob.covariance_px2.trace());
      rays.push_back({static_cast<int>(image), static_cast<int>(b), world_from_cam.translation,
                      world_from_cam.rotation * *bearing, px * jacobian.norm() / std::sqrt(2.0)});
    }
  }
  return rays;
}

/// The nearest ray of each image within the gate, if these are enough of the images that should
/// show the point; its position by least squares.
LampBlock::Intersection LampBlock::supported(const Vector3d& at,
                                             const std::vector<Ray>& rays) const {
  Intersection found;
  double nearest = infinity;
  for (const Ray& ray : rays) {
    const Vector3d arm = at - ray.origin;
    const double along = arm.dot(ray.direction);
    if (!(along > 0)) continue;
    const double off = (arm - along * ray.direction).norm() / along;
    if (off > ray.sigma_rad) continue;
    if (found.rays.empty() || found.rays.back().image != ray.image) {
      found.rays.push_back(ray);
      nearest = off;
    } else if (off < nearest) {
      found.rays.back() = ray;
      nearest = off;
    }
  }
  if (static_cast<int>(found.rays.size()) < min_rays) return {};
  int in_view = 0;
  for (std::size_t image = 0; image < picture_of_image_.size(); ++image) {
    const auto px = camera_.project(network_.cam_from_world(static_cast<int>(image)) * at);
    in_view += px && camera_.contains(*px);
  }
  if (3 * static_cast<int>(found.rays.size()) < in_view) return {};
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Ray& ray : found.rays) {
    const Matrix3d across = Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    const double weight = 1 / square(ray.sigma_rad * (at - ray.origin).norm());
    normal += weight * across;
    right += weight * across * ray.origin;
  }
  found.position = core::inverse<Matrix3d>(normal) * right;
  if (!found.position.allFinite()) return {};
  return found;
}

LampBlock::Intersection LampBlock::best_intersection(const std::vector<Ray>& rays) const {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (rays[i].image != rays[j].image) pairs.emplace_back(i, j);
  const std::size_t step = 1 + pairs.size() / max_pairs;
  Intersection best;
  for (std::size_t p = 0; p < pairs.size(); p += step) {
    const Ray &a = rays[pairs[p].first], &b = rays[pairs[p].second];
    const double cosine = a.direction.dot(b.direction);
    const double sine2 = 1 - square(cosine);
    if (sine2 < square(min_parallax_rad)) continue;
    const Vector3d base = b.origin - a.origin;
    const double s = (base.dot(a.direction) - cosine * base.dot(b.direction)) / sine2;
    const double t = (cosine * base.dot(a.direction) - base.dot(b.direction)) / sine2;
    if (!(s > 0) || !(t > 0)) continue;
    const Vector3d on_a = a.origin + s * a.direction, on_b = b.origin + t * b.direction;
    if ((on_a - on_b).norm() > s * a.sigma_rad + t * b.sigma_rad) continue;
    Intersection next = supported(0.5 * (on_a + on_b), rays);
    if (next.rays.size() > best.rays.size()) best = std::move(next);
  }
  if (best.rays.empty()) return best;
  Intersection refined = supported(best.position, rays);
  return refined.rays.size() >= best.rays.size() ? refined : best;
}

bool LampBlock::add_missed_lamps() {
  bool added = false;
  std::vector<Ray> rays = rays_without_lamp();
  while (true) {
    const Intersection found = best_intersection(rays);
    if (found.rays.empty()) return added;
    added = true;
    const int point = static_cast<int>(network_.points.size());
    network_.points.push_back({"new point " + std::to_string(point), found.position, false});
    const int index = static_cast<int>(lamps_.size());
    for (const Ray& ray : found.rays) {
      const int picture = picture_of_image_[ray.image];
      const Blob& blob = pictures_[picture].blobs[ray.blob];
      lamp_of_blob_[picture][ray.blob] = index;
      ImageObservation observation;
      observation.image = ray.image;
      observation.target = Target::of_point(point);
      observation.pixel = blob.centroid_px;
      observation.sigma_px =
          (blob.covariance_px2.diagonal().array().max(0.0) + square(model_sigma_px_)).sqrt();
      network_.observations.push_back(observation);
      const auto is_used = [&](const Ray& other) {
        return other.image == ray.image && other.blob == ray.blob;
      };
      rays.erase(std::remove_if(rays.begin(), rays.end(), is_used), rays.end());
    }
    BlockLamp lamp;
    lamp.lamp.shape = LampShape::point;
    lamp.lamp.centre_m = found.position;
    lamps_.push_back(lamp);
    point_of_lamp_.push_back(point);
  }
}

Vector2d LampBlock::centre_correction(const BlockLamp& lamp, const Rigid3& pose) const {
  if (!lamp.has_shape) return Vector2d::Zero();
  const auto centre = camera_.project(pose * lamp.lamp.centre_m);
  const auto image_centre = project_lamp_centre(lamp.lamp, pose, camera_);
  if (!centre || !image_centre) return Vector2d::Zero();
  return camera_.difference_px(*centre, *image_centre);
}

void LampBlock::adjust_again() {
  const Network before = network_;
  std::vector<bool> has_rim(network_.observations.size(), false);  // its centre is that of the rim
  for (const OutlineObservation& rim : network_.outlines) has_rim[rim.observation] = true;
  AdjustOptions options;
  options.threads = threads_;
  for (int round = 0; round < 2; ++round) {  // the second has centres corrected by the shapes
    update_lamps();
    for (std::size_t i = 0; i < network_.observations.size(); ++i) {
      ImageObservation& observation = network_.observations[i];
      const int picture = picture_of_image_[observation.image];
      const std::vector<int>& lamps = lamp_of_blob_[picture];
      const auto lamp =
          std::find(point_of_lamp_.begin(), point_of_lamp_.end(), observation.target.point);
      if (lamp == point_of_lamp_.end()) continue;
      const int index = static_cast<int>(lamp - point_of_lamp_.begin());
      const auto blob = std::find(lamps.begin(), lamps.end(), index);
      if (blob == lamps.end()) continue;
      observation.used = true;
      if (has_rim[i]) continue;
      observation.pixel =
          pictures_[picture].blobs[blob - lamps.begin()].centroid_px +
          centre_correction(lamps_[index], network_.cam_from_world(observation.image));
    }
    const Result<Adjustment> adjusted = adjust(network_, options);
    if (!adjusted.ok()) {
      warnings_.push_back("lamps without a match between pictures are not adjusted: " +
                          adjusted.message);
      network_ = before;
      return;
    }
    network_ = adjusted->network;
    variance_factor_ = variance_factor_of(*adjusted);
  }
}

void LampBlock::update_lamps() {
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    BlockLamp& lamp = lamps_[i];
    lamp.lamp.centre_m = network_.points[point_of_lamp_[i]].position_m;
    lamp.pictures.clear();
    std::vector<BlobInPicture> blobs;
    std::vector<LampShapeView> views;
    std::vector<std::size_t> blob_of_view;
    for (std::size_t image = 0; image < picture_of_image_.size(); ++image) {
      const int picture = picture_of_image_[image];
      for (std::size_t b = 0; b < lamp_of_blob_[picture].size(); ++b) {
        if (lamp_of_blob_[picture][b] != static_cast<int>(i)) continue;
        const Blob& blob = pictures_[picture].blobs[b];
        lamp.pictures.push_back(picture);
        blobs.push_back({&blob, network_.cam_from_world(static_cast<int>(image))});
        auto view = lamp_view(blob, static_cast<int>(b), camera_);
        if (!view) continue;
        blob_of_view.push_back(blobs.size() - 1);
        views.push_back(std::move(*view));
      }
    }
    if (!views.empty()) {
      const auto is_disc = [](const LampShapeView& view) { return view.shape == LampShape::disc; };
      const auto discs = std::count_if(views.begin(), views.end(), is_disc);
      const LampShape shape = 2 * discs >= static_cast<std::ptrdiff_t>(views.size())
                                  ? LampShape::disc
                                  : LampShape::rectangle;
      std::vector<ViewInPicture> alike;
      for (std::size_t v = 0; v < views.size(); ++v)
        if (views[v].shape == shape)
          alike.push_back(
              {&views[v], blobs[blob_of_view[v]].blob, blobs[blob_of_view[v]].cam_from_world});
      const ShapeOfViews found = shape_of_views(lamp.lamp.centre_m, shape, alike, camera_);
      lamp.has_shape = found.is_fitted;
      if (found.is_fitted) lamp.lamp = found.lamp;
    }
    lamp.spread_rad = 0;
    for (const BlobInPicture& a : blobs)
      for (const BlobInPicture& b : blobs) {
        const Vector3d to_a = a.cam_from_world.origin_in_source() - lamp.lamp.centre_m;
        const Vector3d to_b = b.cam_from_world.origin_in_source() - lamp.lamp.centre_m;
        lamp.spread_rad =
            std::max(lamp.spread_rad, std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)));
      }
    lamp.light = lamp_light(lamp.lamp, blobs);
    lamp.signal = lamp_signal(blobs);
  }
}

RelativeLight LampBlock::light_as(const Lamp& emitter, int lamp) const {
  Lamp emitting = emitter;
  emitting.centre_m = lamps_[lamp].lamp.centre_m;
  std::vector<BlobInPicture> blobs;
  for (std::size_t image = 0; image < picture_of_image_.size(); ++image) {
    const int picture = picture_of_image_[image];
    for (std::size_t b = 0; b < lamp_of_blob_[picture].size(); ++b)
      if (lamp_of_blob_[picture][b] == lamp)
        blobs.push_back(
            {&pictures_[picture].blobs[b], network_.cam_from_world(static_cast<int>(image))});
  }
  return lamp_light(emitting, blobs);
}

void LampBlock::remove_undetermined() {
  const Result<Precision> known = precision(network_, {}, threads_);
  std::vector<int> index(lamps_.size(), -1);
  std::vector<BlockLamp> kept;
  std::vector<int> points;
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    if (!known.ok() || !known->point(point_of_lamp_[i]).allFinite()) continue;
    index[i] = static_cast<int>(kept.size());
    kept.push_back(lamps_[i]);
    points.push_back(point_of_lamp_[i]);
  }
  lamps_ = std::move(kept);
  point_of_lamp_ = std::move(points);
  for (std::vector<int>& lamps : lamp_of_blob_)
    for (int& lamp : lamps)
      if (lamp >= 0) lamp = index[lamp];
}

void LampBlock::transform(const Similarity& similarity) {
  network_ = transformed(std::move(network_), similarity);
  for (BlockLamp& lamp : lamps_) {
    lamp.lamp.centre_m = similarity * lamp.lamp.centre_m;
    lamp.lamp.normal = similarity.rotation * lamp.lamp.normal;
    lamp.lamp.x_axis = similarity.rotation * lamp.lamp.x_axis;
    lamp.lamp.radius_m *= similarity.scale;
    lamp.lamp.size_m *= similarity.scale;
    if (lamp.light.power) *lamp.light.power *= square(similarity.scale);
  }
}

Eigen::MatrixXd LampBlock::covariance() const {
  std::vector<Target> targets;
  for (const int point : point_of_lamp_) targets.push_back(Target::of_point(point));
  const Result<Precision> known = precision(network_, {}, threads_);
  return variance_factor_ * known->joint(targets);
}

}  // namespace occ::internal::survey
