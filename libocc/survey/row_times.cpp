// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/row_times.hpp"

#include <cmath>
#include <optional>

namespace occ::internal::survey {
namespace {

using Eigen::Vector2d;

/// Position and exposure time of a point of a picture.
struct TimedPoint {
  Vector2d px;
  double time_s;
};

class RowTimes {
 public:
  RowTimes(const std::vector<SurveyPicture>& pictures, double row_time_s, int width, int height)
      : pictures_(pictures), row_time_s_(row_time_s), middle_(0.5 * (height - 1)) {
    // An eighth of the width between neighbours is a fast motion, and less than the distance of
    // lamps in most pictures.
    max_step_px_ = width / 8.0;
  }

  /// Velocity of a blob [px/s]; nothing if no neighbour shows it.
  std::optional<Vector2d> velocity_of_blob(int picture, int blob) const {
    return velocity(
        picture,
        [&](int other) -> std::optional<TimedPoint> {
          const int partner = partner_of(picture, blob, other);
          if (partner < 0) return std::nullopt;
          return timed(other, pictures_[other].blobs[partner].centroid_px);
        },
        pictures_[picture].blobs[blob].centroid_px);
  }

  /// Velocity of the centre of a tag.
  std::optional<Vector2d> velocity_of_tag(int picture, const AprilTag& tag) const {
    return velocity(
        picture,
        [&](int other) -> std::optional<TimedPoint> {
          for (const AprilTag& same : pictures_[other].tags)
            if (same.id == tag.id && same.family == tag.family) return timed(other, same.centre_px);
          return std::nullopt;
        },
        tag.centre_px);
  }

  Vector2d shift(const Vector2d& px, const Vector2d& velocity) const {
    return -velocity * row_time_s_ * (px.y() - middle_);
  }

 private:
  TimedPoint timed(int picture, const Vector2d& px) const {
    return {px, *pictures_[picture].time_s + row_time_s_ * (px.y() - middle_)};
  }

  template <class Find>
  std::optional<Vector2d> velocity(int picture, const Find& find, const Vector2d& px) const {
    std::vector<TimedPoint> points;
    for (const int other : {picture - 1, picture + 1}) {
      if (other < 0 || other >= static_cast<int>(pictures_.size()) || !pictures_[other].time_s)
        continue;
      if (const auto found = find(other)) points.push_back(*found);
    }
    if (points.size() == 1) points.push_back(timed(picture, px));
    if (points.size() < 2 || points[0].time_s == points[1].time_s) return std::nullopt;
    return Vector2d((points[1].px - points[0].px) / (points[1].time_s - points[0].time_s));
  }

  int nearest(const Vector2d& px, int picture) const {
    int best = -1;
    double distance = max_step_px_;
    const std::vector<Blob>& blobs = pictures_[picture].blobs;
    for (std::size_t b = 0; b < blobs.size(); ++b)
      if ((blobs[b].centroid_px - px).norm() < distance) {
        distance = (blobs[b].centroid_px - px).norm();
        best = static_cast<int>(b);
      }
    return best;
  }

  /// The blob of another picture of which this one is the nearest, and the reverse; -1: none.
  int partner_of(int picture, int blob, int other) const {
    const Vector2d& px = pictures_[picture].blobs[blob].centroid_px;
    const int partner = nearest(px, other);
    if (partner < 0) return -1;
    return nearest(pictures_[other].blobs[partner].centroid_px, picture) == blob ? partner : -1;
  }

  const std::vector<SurveyPicture>& pictures_;
  double row_time_s_, middle_, max_step_px_ = 0;
};

void move(Blob& blob, const RowTimes& rows, const Vector2d& velocity) {
  for (RimPoint& point : blob.rim) point.px += rows.shift(point.px, velocity);
  for (Vector2d& corner : blob.corners_px) corner += rows.shift(corner, velocity);
  blob.ellipse.centre_px += rows.shift(blob.ellipse.centre_px, velocity);
  blob.centroid_px += rows.shift(blob.centroid_px, velocity);
}

}  // namespace

std::vector<SurveyPicture> without_rolling_shutter(std::vector<SurveyPicture> pictures,
                                                   double row_time_s, int width, int height,
                                                   std::vector<std::string>& notes) {
  const std::vector<SurveyPicture> before = pictures;
  const RowTimes rows(before, row_time_s, width, height);
  int unmoved = 0;
  for (int i = 0; i < static_cast<int>(pictures.size()); ++i) {
    SurveyPicture& picture = pictures[i];
    if (!picture.time_s) {
      unmoved += static_cast<int>(picture.blobs.size());
      continue;
    }
    for (int b = 0; b < static_cast<int>(picture.blobs.size()); ++b) {
      const auto velocity = rows.velocity_of_blob(i, b);
      if (velocity)
        move(picture.blobs[b], rows, *velocity);
      else
        ++unmoved;
    }
    for (AprilTag& tag : picture.tags)
      if (const auto velocity = rows.velocity_of_tag(i, tag)) {
        for (Vector2d& corner : tag.corners_px) corner += rows.shift(corner, *velocity);
        tag.centre_px += rows.shift(tag.centre_px, *velocity);
      }
  }
  if (unmoved > 0)
    notes.push_back("the rolling shutter is not corrected for " + std::to_string(unmoved) +
                    " blobs, which no neighbouring picture with a time shows");
  return pictures;
}

}  // namespace occ::internal::survey
