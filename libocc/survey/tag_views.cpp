// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/tag_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Vector2d;

constexpr int first_code = std::numeric_limits<int>::min();  // lamps transmit ids from zero
constexpr int max_tags = 1 << 24;
constexpr int points_per_side = 6;

Blob blob_of(const AprilTag& tag) {
  Blob blob;
  blob.lamp_id = first_code + tag.id;
  double variance = 0;
  Vector2d middle = Vector2d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    middle += tag.corners_px[k] / 4;
    variance += tag.covariance_px2[k].trace() / 8;
  }
  for (std::size_t k = 0; k < 4; ++k) {  // clockwise in the image
    const Vector2d &from = tag.corners_px[k], &to = tag.corners_px[(k + 1) % 4];
    blob.corners_px.insert(blob.corners_px.begin(), from);
    Vector2d normal(to.y() - from.y(), from.x() - to.x());
    normal.normalize();
    if (normal.dot(from - middle) < 0) normal = -normal;
    for (int i = 0; i < points_per_side; ++i) {
      RimPoint point;
      point.px = from + (i + 0.5) / points_per_side * (to - from);
      point.normal = normal;
      point.sigma_px = std::sqrt(variance * points_per_side);
      blob.rim.push_back(point);
    }
  }
  const double area = 0.5 * std::abs(cross_2d(tag.corners_px[2] - tag.corners_px[0],
                                              tag.corners_px[3] - tag.corners_px[1]));
  blob.centroid_px = tag.centre_px;
  blob.covariance_px2 = variance / 4 * Eigen::Matrix2d::Identity();
  blob.ellipse.centre_px = middle;
  blob.ellipse.semi_major_px = blob.ellipse.semi_minor_px = std::sqrt(area / pi);
  return blob;
}

}  // namespace

std::optional<int> tag_of(const Blob& blob) {
  if (!blob.lamp_id || *blob.lamp_id >= first_code + max_tags) return std::nullopt;
  return *blob.lamp_id - first_code;
}

std::vector<SurveyPicture> with_tags_as_blobs(std::vector<SurveyPicture> pictures) {
  for (SurveyPicture& picture : pictures) {
    std::map<int, int> counts;
    for (const AprilTag& tag : picture.tags) ++counts[tag.id];
    for (const AprilTag& tag : picture.tags) {
      if (counts[tag.id] > 1 || tag.id < 0 || tag.id >= max_tags) continue;
      picture.blobs.push_back(blob_of(tag));
      if (!picture.tracks.empty()) picture.tracks.push_back(-1);
    }
  }
  return pictures;
}

std::size_t lamp_blobs(const SurveyPicture& picture) {
  return static_cast<std::size_t>(std::count_if(picture.blobs.begin(), picture.blobs.end(),
                                                [](const Blob& blob) { return !tag_of(blob); }));
}

}  // namespace occ::internal::survey
