// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/known_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/network/measure_points.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Vector3d;
using Corners = Eigen::Matrix<double, 3, 4>;

constexpr double min_corner_sigma_px = 0.03;  // errors of print and flatness, beyond the noise

/// Corners of a tag of side 1 in its frame, in the order of AprilTag::corners_px.
Corners unit_corners() {
  Corners corners;
  corners << -0.5, 0.5, 0.5, -0.5,  //
      -0.5, -0.5, 0.5, 0.5,         //
      0, 0, 0, 0;
  return corners;
}

double perimeter(const Corners& corners) {
  double sum = 0;
  for (Eigen::Index k = 0; k < 4; ++k) sum += (corners.col(k) - corners.col((k + 1) % 4)).norm();
  return sum;
}

Rigid3 pose_of(const Corners& corners) {
  const Vector3d middle = corners.rowwise().mean();
  const Corners centred = corners.colwise() - middle;
  const Eigen::Matrix3d product = centred * unit_corners().transpose();
  return {nearest_rotation(product), middle};
}

}  // namespace

PlacedTags::PlacedTags(const std::vector<SurveyPicture>& pictures, const LampMap& map,
                       const Camera& camera, std::vector<std::string>& notes) {
  if (std::all_of(pictures.begin(), pictures.end(),
                  [](const auto& one) { return one.tags.empty(); }))
    return;
  Network network;
  network.cameras.push_back({"camera", camera, {}});
  std::map<int, std::vector<ImageObservation>> seen;
  std::map<int, int> images;
  for (const PlacedPicture& placed : map.placed) {
    const SurveyPicture& picture = pictures[placed.picture];
    const int image = network.add_image(picture.name, 0, placed.cam_from_map);
    for (const AprilTag& tag : picture.tags) {
      const auto is_same = [&](const AprilTag& other) { return other.id == tag.id; };
      if (std::count_if(picture.tags.begin(), picture.tags.end(), is_same) > 1) {
        notes.push_back("tag " + std::to_string(tag.id) + " in " + picture.name +
                        " left out: its id occurs more than once");
        continue;
      }
      ++images[tag.id];
      for (int corner = 0; corner < 4; ++corner) {
        ImageObservation observation;
        observation.image = image;
        observation.target = Target::of_corner(0, corner);
        observation.pixel = tag.corners_px[corner];
        observation.sigma_px =
            (tag.covariance_px2[corner].diagonal().array().max(0.0) + square(min_corner_sigma_px))
                .sqrt();
        seen[tag.id].push_back(observation);
      }
    }
  }
  for (auto& [id, observations] : seen) {
    std::vector<std::vector<PointObservation>> points(4);
    for (const ImageObservation& o : observations)
      points[o.target.corner].push_back({o.image, o.pixel, o.sigma_px});
    const Measurement measured = measure_points(network, points);
    Tag4 tag;
    tag.id = id;
    bool is_measured = images[id] >= 2;
    for (Eigen::Index k = 0; k < 4 && is_measured; ++k) {
      const MeasuredPoint& point = measured.points[static_cast<std::size_t>(k)];
      is_measured = point.status == Status::ok;
      tag.corners.col(k) = point.position_m;
    }
    if (!is_measured) {
      notes.push_back("tag " + std::to_string(id) + " left out: " +
                      (images[id] < 2 ? "only one picture shows it" : "its rays are parallel"));
      continue;
    }
    tag.observations = std::move(observations);
    tags_.push_back(std::move(tag));
  }
}

std::optional<double> PlacedTags::scale(double size_m) const {
  if (tags_.empty()) return std::nullopt;
  std::vector<double> ratios;
  for (const Tag4& tag : tags_) {
    ratios.push_back(4 * size_m / perimeter(tag.corners));
  }
  return median(std::move(ratios));
}

double PlacedTags::scale_sigma() const {
  constexpr double edge_sigma_px = 0.02;  // common to all pictures: response, blur, print
  std::vector<double> sides;
  for (const Tag4& tag : tags_)
    for (std::size_t i = 0; i + 3 < tag.observations.size(); i += 4)
      sides.push_back(std::sqrt(0.5) *
                      (tag.observations[i].pixel - tag.observations[i + 2].pixel).norm());
  return sides.empty() ? 0 : 2 * edge_sigma_px / median(std::move(sides));
}

std::string tag_name(int id) { return "tag " + std::to_string(id); }

void PlacedTags::add_to(KnownLengths& lengths, std::optional<double> size_m) const {
  for (const Tag4& tag : tags_) {
    NetworkBody body;
    body.name = tag_name(tag.id);
    body.scale_free = !size_m;
    body.corners_m = size_m.value_or(1) * unit_corners();
    if (!size_m) body.scale = perimeter(tag.corners) / 4;
    body.world_from_body = pose_of(tag.corners);
    const int index = static_cast<int>(lengths.bodies.size());
    lengths.bodies.push_back(body);
    for (ImageObservation observation : tag.observations) {
      observation.target.body = index;
      lengths.tag_observations.push_back(observation);
    }
  }
}

std::optional<Radii> radii_of(const std::vector<std::optional<Lamp>>& shapes,
                              const std::vector<int>& lamps) {
  std::vector<double> radii, sigmas;
  for (const int lamp : lamps)
    if (shapes[lamp] && shapes[lamp]->shape == LampShape::disc) {
      radii.push_back(shapes[lamp]->radius_m);
      sigmas.push_back(shapes[lamp]->size_sigma);
    }
  if (radii.empty()) return std::nullopt;
  const auto [smallest, largest] = std::minmax_element(radii.begin(), radii.end());
  return Radii{median(radii), *smallest, *largest, median(sigmas)};
}

std::optional<std::pair<double, double>> scale_by_odometry(
    const std::vector<SurveyPicture>& pictures, const LampMap& map, double path_sigma) {
  std::vector<const PlacedPicture*> placed;
  for (const PlacedPicture& picture : map.placed)
    if (pictures[picture.picture].odometry_m) placed.push_back(&picture);
  std::stable_sort(placed.begin(), placed.end(),
                   [](const auto* a, const auto* b) { return a->picture < b->picture; });
  std::vector<double> driven, mapped;
  double product = 0, squares = 0;
  for (std::size_t i = 1; i < placed.size(); ++i) {
    driven.push_back(
        (*pictures[placed[i]->picture].odometry_m - *pictures[placed[i - 1]->picture].odometry_m)
            .norm());
    mapped.push_back((placed[i]->cam_from_map.origin_in_source() -
                      placed[i - 1]->cam_from_map.origin_in_source())
                         .norm());
    product += driven.back() * mapped.back();
    squares += square(mapped.back());
  }
  if (!(product > 0) || !(squares > 0)) return std::nullopt;
  const double scale = product / squares;
  double residuals = 0;
  for (std::size_t i = 0; i < driven.size(); ++i)
    residuals += square(driven[i] - scale * mapped[i]);
  const double dof = std::max(1.0, static_cast<double>(driven.size()) - 1);
  return std::pair(scale, std::hypot(path_sigma, std::sqrt(residuals / dof / squares) / scale));
}

}  // namespace occ::internal::survey
