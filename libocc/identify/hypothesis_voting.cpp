// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/hypothesis_voting.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace occ::internal::identify {

using namespace internal::core;

namespace {

// Number of neighbours of a lamp that are combined with it. The map region in view contains about
// `blobs` lamps; a lamp at its border has all of them on one side, hence the factor of 2.
std::size_t max_neighbours(std::size_t blobs) { return std::clamp<std::size_t>(2 * blobs, 16, 24); }

void put(const Eigen::Vector3d& from, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

std::size_t padded(std::size_t count) { return (count + max_lanes - 1) / max_lanes * max_lanes; }

// Returns the blobs outside the assignment. extra(bearing) is the variance of the predicted
// direction.
template <std::size_t count, class Extra>
std::vector<RemainingBlob> remaining_blobs(const AssignmentProblem& problem,
                                           const std::array<int, count>& assigned,
                                           const Extra& extra, std::vector<int>& observations) {
  std::vector<RemainingBlob> remaining;
  observations.clear();
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
    if (std::find(assigned.begin(), assigned.end(), s) != assigned.end()) continue;
    RemainingBlob blob;
    put(problem.observation(s).bearing, blob.bearing);
    blob.sigma2 =
        static_cast<float>(direction_variance(problem, s) + extra(problem.observation(s).bearing));
    remaining.push_back(blob);
    observations.push_back(s);
  }
  return remaining;
}

TripleInput triple_input(const AssignmentProblem& problem, const std::array<int, 3>& observations) {
  TripleInput blobs{};
  const auto chord2 = [&](std::size_t i, std::size_t j) {
    return static_cast<float>((problem.observation(observations[i]).bearing -
                               problem.observation(observations[j]).bearing)
                                  .squaredNorm());
  };
  const auto noise2 = [&](std::size_t i, std::size_t j) {
    return static_cast<float>(direction_variance(problem, observations[i]) +
                              direction_variance(problem, observations[j]));
  };
  for (std::size_t i = 0; i < 3; ++i)
    put(problem.observation(observations[i]).bearing, blobs.bearing[i]);
  blobs.chords = {chord2(0, 1), chord2(0, 2), chord2(1, 2)};
  blobs.noise2[0] = noise2(0, 1);
  blobs.noise2[1] = noise2(0, 2);
  blobs.noise2[2] = noise2(1, 2);
  return blobs;
}

// Limit of n . x below which a lamp counts as visible, with its position x and normal n in the
// camera frame. Cones narrower than a half space are checked during verification; wider cones have
// no limit.
float lit_below(const MapPoint& map_point) {
  return map_point.cone_cos < 0 ? std::numeric_limits<float>::infinity() : 0.0F;
}

// Minimum cosine between the normal of a lamp and that of a plane for which the lamp is visible
// from one side of the plane only. Lamps of a scene count as visible within 75 degrees.
double one_sided(const AssignmentProblem& problem, const MapPoint& map_point) {
  constexpr double flat = 0.966, never = 2;  // cosine of 15 degrees; larger than any cosine
  if (problem.scene) return flat;
  if (map_point.cone_cos < 0) return never;
  return std::min(1 - 1e-9, std::sqrt(1 - map_point.cone_cos * map_point.cone_cos));
}

}  // namespace

HypothesisVoting::Depths HypothesisVoting::depths_of(int observation, int map_point) const {
  const DistanceRange range =
      distances_m(problem_.observation(observation), problem_.map_point(map_point));
  return {static_cast<float>(range.low / unit_m_), static_cast<float>(range.high / unit_m_)};
}

void HypothesisVoting::Table::resize(std::size_t size) {
  for (std::size_t k = 0; k < 3; ++k) {
    second_position[k].resize(size);
    third_position[k].resize(size);
  }
  second.resize(size);
  third.resize(size);
}

void HypothesisVoting::Table::copy(std::size_t from, const Table& other, std::size_t to) {
  for (std::size_t k = 0; k < 3; ++k) {
    second_position[k][to] = other.second_position[k][from];
    third_position[k][to] = other.third_position[k][from];
  }
  second[to] = other.second[from];
  third[to] = other.third[from];
}

LampPositions HypothesisVoting::Table::positions() const {
  return {{second_position[0].data(), second_position[1].data(), second_position[2].data()},
          {third_position[0].data(), third_position[1].data(), third_position[2].data()}};
}

HypothesisVoting::HypothesisVoting(const AssignmentProblem& problem, Covisibility& covisibility,
                                   SizeConsistency& sizes)
    : problem_(problem),
      covisibility_(covisibility),
      sizes_(sizes),
      simd_(widest_simd()),
      neighbours_(problem.map_points.size()) {
  const Camera& c = *problem.camera;
  frustum_ = {static_cast<float>((-0.5 - c.cx_px()) / c.fx_px()),
              static_cast<float>((c.width() - 0.5 - c.cx_px()) / c.fx_px()),
              static_cast<float>((-0.5 - c.cy_px()) / c.fy_px()),
              static_cast<float>((c.height() - 0.5 - c.cy_px()) / c.fy_px()), !c.is_pinhole()};
  const std::vector<MapPoint>& map_points = problem.map_points;
  const std::size_t remaining = map_points.size() - 1;
  combined_ = std::min(remaining, max_neighbours(problem.observations.size()));
  const std::size_t kept = std::min(remaining, 3 * combined_ / 2);
  std::vector<std::pair<double, int>> by_distance(map_points.size());
  const auto distance = [&](std::size_t a, std::size_t b) {
    const double apart_m = (map_points[b].centre - map_points[a].centre).norm();
    const bool together = covisibility_.pair(static_cast<int>(a), static_cast<int>(b));
    return together ? apart_m
                    : apart_m + 3 * problem_.size_m;  // pairs that are not covisible come last
  };
  double spacing_m = 0;
  for (std::size_t a = 0; a < map_points.size(); ++a) {
    for (std::size_t b = 0; b < map_points.size(); ++b)
      by_distance[b] = {distance(a, b), static_cast<int>(b)};
    by_distance[a].first = std::numeric_limits<double>::infinity();
    const auto end = by_distance.begin() + static_cast<std::ptrdiff_t>(kept);
    std::partial_sort(by_distance.begin(), end, by_distance.end());
    for (auto it = by_distance.begin(); it != end; ++it)
      neighbours_[a].map_points.push_back(it->second);
    spacing_m += by_distance[std::min<std::size_t>(2, kept - 1)].first;
  }
  unit_m_ = spacing_m / static_cast<double>(map_points.size());
  for (std::size_t a = 0; a < map_points.size(); ++a)
    for (const int b : neighbours_[a].map_points) {
      const MapPoint& map_point = problem.map_point(b);
      NearLamp lamp;
      put((map_point.centre - map_points[a].centre) / unit_m_, lamp.position);
      put(map_point.normal, lamp.normal);
      lamp.lit_below = lit_below(map_point);
      lamp.blur = static_cast<float>(std::pow(map_point.radius_m / unit_m_, 2));
      neighbours_[a].lamps.push_back(lamp);
    }
}

bool HypothesisVoting::neighbours_truncated() const {
  return combined_ + 1 < problem_.map_points.size();
}

ScoringInput HypothesisVoting::scoring_input(int first, const std::vector<int>& observations,
                                             const std::vector<RemainingBlob>& remaining) {
  const Neighbours& near = neighbours_[first];
  allowed_.clear();
  for (const int t : near.map_points)
    for (const int s : observations) allowed_.push_back(problem_.allows(s, t));
  ScoringInput input{};
  input.lamps = near.lamps.data();
  input.lamp_count = static_cast<int>(near.lamps.size());
  input.remaining = remaining.data();
  input.remaining_count = static_cast<int>(remaining.size());
  input.allowed = allowed_.data();
  input.gate2 = static_cast<float>(std::pow(problem_.options->gate_sigma, 2));
  input.frustum = frustum_;
  return input;
}

// Lamps that face the same side are visible from that side only. Three of them therefore have a
// fixed orientation in the image (+-1; 0 if noise hides it), which excludes half of all
// assignments. For lamps that are not coplanar this holds within 75 degrees of their normals.
std::size_t HypothesisVoting::add_assignments(const std::array<int, 3>& observations, int first,
                                              int image_orientation) {
  constexpr double same = 1 - 1e-9;
  const double flat = one_sided(problem_, problem_.map_point(first));
  const Neighbours& near = neighbours_[first];
  const std::size_t count = combined_;
  assignments_.resize(padded(count * count));
  third_permitted_.resize(count);
  for (std::size_t c = 0; c < count; ++c) {
    const Pair third{observations[2], near.map_points[c]};
    third_permitted_[c] = problem_.allows(third.observation, third.map_point) &&
                          sizes_.permits({observations[0], first}, third);
  }
  const Eigen::Vector3d& normal = problem_.map_point(first).normal;
  std::size_t n = 0;
  for (std::size_t b = 0; b < count; ++b) {
    const MapPoint& second = problem_.map_point(near.map_points[b]);
    const Pair pair{observations[1], near.map_points[b]};
    if (!problem_.allows(pair.observation, pair.map_point) ||
        !sizes_.permits({observations[0], first}, pair))
      continue;
    const bool same_side = second.normal.dot(normal) > same;
    const Eigen::Vector3d e1 = second.centre - problem_.map_point(first).centre;
    for (std::size_t c = 0; c < count; ++c) {
      if (b == c || !third_permitted_[c] ||
          !sizes_.permits(pair, {observations[2], near.map_points[c]}))
        continue;
      if (!covisibility_.triple(first, near.map_points[b], near.map_points[c])) continue;
      const MapPoint& third = problem_.map_point(near.map_points[c]);
      if (same_side && image_orientation != 0) {
        const Eigen::Vector3d across = e1.cross(third.centre - problem_.map_point(first).centre);
        const double facing = across.dot(normal);
        if ((facing > 0) == (image_orientation > 0) &&
            facing * facing > flat * flat * across.squaredNorm() && third.normal.dot(normal) > same)
          continue;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        assignments_.second_position[k][n] = near.lamps[b].position[k];
        assignments_.third_position[k][n] = near.lamps[c].position[k];
      }
      assignments_.second[n] = static_cast<int>(b);
      assignments_.third[n] = static_cast<int>(c);
      ++n;
    }
  }
  for (std::size_t i = n; n > 0 && i < padded(n); ++i) assignments_.copy(n - 1, assignments_, i);
  return n;
}

// Fills the last lanes with copies of the last pose.
void HypothesisVoting::pad_poses(std::size_t count) {
  for (std::size_t i = count; count > 0 && i < padded(count); ++i) {
    batch_.copy(count - 1, batch_, i);
    for (std::vector<float>& parameter : parameters_) parameter[i] = parameter[count - 1];
  }
  inliers_.resize(padded(count));
  visible_.resize(padded(count));
}

// Collects all valid solutions that agree with the sizes of the blobs, without gaps.
std::size_t HypothesisVoting::add_poses(const std::array<int, 3>& observations, int first,
                                        std::size_t assignments) {
  const std::vector<int>& near = neighbours_[first].map_points;
  const Depths first_depths = depths_of(observations[0], first);
  second_depths_.clear();
  third_depths_.clear();
  for (std::size_t b = 0; b < combined_; ++b) {
    second_depths_.push_back(depths_of(observations[1], near[b]));
    third_depths_.push_back(depths_of(observations[2], near[b]));
  }
  const std::size_t stride = padded(assignments);
  batch_.resize(padded(4 * assignments));
  for (auto& parameter : parameters_) parameter.resize(batch_.second.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < assignments; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t from = k * stride + i;
      if (valid_[from] == 0 || !first_depths.contain(depths_[0][from]) ||
          !second_depths_[assignments_.second[i]].contain(depths_[1][from]) ||
          !third_depths_[assignments_.third[i]].contain(depths_[2][from]))
        continue;
      batch_.copy(i, assignments_, n);
      for (std::size_t d = 0; d < 3; ++d) parameters_[d][n] = depths_[d][from];
      ++n;
    }
  pad_poses(n);
  return n;
}

bool HypothesisVoting::accept(std::size_t pose, int min_inliers) {
  statistics_.poses += 1;
  statistics_.visible += visible_[pose];
  return inliers_[pose] >= min_inliers;
}

Rigid3 HypothesisVoting::pose_of_triple(const std::array<int, 3>& observations,
                                        const std::array<int, 3>& map_points,
                                        std::size_t pose) const {
  Eigen::Matrix3d in_cam, in_map;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    in_cam.col(column) =
        problem_.observation(observations[i]).bearing * (unit_m_ * parameters_[i][pose]);
    in_map.col(column) = problem_.map_point(map_points[i]).centre;
  }
  const auto frame = [](const Eigen::Matrix3d& corners) {
    const Eigen::Vector3d side = corners.col(1) - corners.col(0);
    Eigen::Matrix3d axes;
    axes.col(0) = side.normalized();
    axes.col(2) = side.cross(Eigen::Vector3d(corners.col(2) - corners.col(0))).normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    return axes;
  };
  const Eigen::Matrix3d rotation = frame(in_cam) * frame(in_map).transpose();
  return {rotation, in_cam.rowwise().mean() - rotation * in_map.rowwise().mean()};
}

PoseBatch HypothesisVoting::pose_batch() const {
  return {{parameters_[0].data(), parameters_[1].data(), parameters_[2].data()},
          batch_.positions(),
          batch_.second.data(),
          batch_.third.data()};
}

// Orientation of the three blobs in the image, see add_assignments.
int HypothesisVoting::image_orientation(const std::array<int, 3>& observations) const {
  Eigen::Matrix3d f;
  double noise = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    f.col(static_cast<Eigen::Index>(i)) = problem_.observation(observations[i]).bearing;
    noise += std::sqrt(direction_variance(problem_, observations[i]));
  }
  const double reach = std::max((f.col(1) - f.col(0)).norm(), (f.col(2) - f.col(0)).norm());
  const double volume = f.determinant();
  if (!(std::abs(volume) > problem_.options->gate_sigma * noise * reach)) return 0;
  return volume > 0 ? 1 : -1;
}

void HypothesisVoting::solve(const TripleInput& blobs, std::size_t assignments) {
  const std::size_t stride = padded(assignments);
  for (auto& depth : depths_) depth.resize(4 * stride);
  valid_.resize(4 * stride);
  solve_triples_for_cpu(simd_)(
      blobs, assignments_.positions(), static_cast<int>(stride),
      {{depths_[0].data(), depths_[1].data(), depths_[2].data()}, valid_.data()});
}

void HypothesisVoting::score_triples(const std::array<int, 3>& observations, int min_inliers,
                                     std::vector<ScoredPose>& candidates) {
  TripleInput blobs = triple_input(problem_, observations);
  const int orientation = image_orientation(observations);
  std::vector<int> rest;
  const std::vector<RemainingBlob> remaining =
      remaining_blobs(problem_, observations, CommonRotation(problem_, observations), rest);
  for (const int a : problem_.observation(observations[0]).lamps) {
    if (problem_.out_of_time()) return;
    put(problem_.map_point(a).normal, blobs.first_normal);
    blobs.first_lit_below = lit_below(problem_.map_point(a));
    const std::size_t assignments = add_assignments(observations, a, orientation);
    statistics_.assignments += static_cast<int>(assignments);
    if (assignments == 0) continue;
    solve(blobs, assignments);
    const std::size_t count = add_poses(observations, a, assignments);
    score_triples_for_cpu(simd_)(blobs, scoring_input(a, rest, remaining), pose_batch(),
                                 static_cast<int>(padded(count)),
                                 {inliers_.data(), visible_.data()});
    const std::vector<int>& near = neighbours_[a].map_points;
    for (std::size_t i = 0; i < count; ++i) {
      if (!accept(i, min_inliers)) continue;
      const std::array<int, 3> map_points{a, near[batch_.second[i]], near[batch_.third[i]]};
      ScoredPose candidate;
      for (std::size_t k = 0; k < 3; ++k)
        candidate.assignment.push_back({observations[k], map_points[k]});
      candidate.pose = pose_of_triple(observations, map_points, i);
      candidate.inliers = inliers_[i];
      candidates.push_back(std::move(candidate));
    }
  }
}

// As in pose/internal/upright_p2p.hpp: the vector between two lamps lies in the plane of their
// bearings, which leaves two headings, each with one position. The remaining data of the prior,
// such as the camera's height, reject most of these.
std::size_t HypothesisVoting::add_headings(const std::array<int, 2>& observations, int first,
                                           const PriorGate& gate, double relative) {
  constexpr double nearly_real = 1.02, min_horizontal = 1e-6;
  const Neighbours& near = neighbours_[first];
  batch_.resize(padded(2 * combined_));
  for (auto& parameter : parameters_) parameter.resize(batch_.second.size());
  const Eigen::Matrix3d upright = cam_from_upright(problem_).transpose();
  const Eigen::Vector3d f0 = upright * problem_.observation(observations[0]).bearing;
  const Eigen::Vector3d f1 = upright * problem_.observation(observations[1]).bearing;
  const Eigen::Vector3d n = f0.cross(f1);
  const double n2 = n.squaredNorm();
  const Eigen::Vector3d& normal = problem_.map_point(first).normal;
  const double below = lit_below(problem_.map_point(first));
  const Depths first_depths = depths_of(observations[0], first);
  std::size_t count = 0;
  for (std::size_t b = 0; b < combined_; ++b) {
    if (!problem_.allows(observations[1], near.map_points[b])) continue;
    if (!covisibility_.pair(first, near.map_points[b])) continue;
    const Depths second_depths = depths_of(observations[1], near.map_points[b]);
    const Eigen::Vector3d side =
        (problem_.map_point(first).centre - problem_.map_point(near.map_points[b]).centre) /
        unit_m_;
    const double cosine = n.head<2>().dot(side.head<2>());
    const double sine = n.y() * side.x() - n.x() * side.y();
    const double reach2 = cosine * cosine + sine * sine, level = n.z() * side.z();
    if (!(reach2 > min_horizontal * min_horizontal * n2 * side.squaredNorm()) ||
        level * level > nearly_real * reach2)
      continue;
    const double off = std::sqrt(std::max(0.0, reach2 - level * level));
    for (const double root : {off, -off}) {
      const double c = (-level * cosine - root * sine) / reach2;
      const double s = (-level * sine + root * cosine) / reach2;
      const Eigen::Vector3d rotated(c * side.x() - s * side.y(), s * side.x() + c * side.y(),
                                    side.z());
      const double d0 = rotated.cross(f1).dot(n), d1 = rotated.cross(f0).dot(n);
      const Eigen::Vector3d lit(c * normal.x() - s * normal.y(), s * normal.x() + c * normal.y(),
                                normal.z());
      if (!(d0 > 0 && d1 > 0 && lit.dot(f0) < below)) continue;
      if (!first_depths.contain(d0 / n2) || !second_depths.contain(d1 / n2)) continue;
      if (!gate.is_open()) {
        const double distance_m = unit_m_ * d0 / n2;
        const Eigen::Vector3d bearing(c * f0.x() + s * f0.y(), c * f0.y() - s * f0.x(), f0.z());
        if (!gate.allows(problem_.map_point(first).centre - distance_m * bearing, c, s, distance_m,
                         relative))
          continue;
      }
      parameters_[0][count] = static_cast<float>(d0 / n2);
      parameters_[1][count] = static_cast<float>(c);
      parameters_[2][count] = static_cast<float>(s);
      batch_.second[count] = static_cast<int>(b);
      batch_.third[count] = -1;
      ++count;
    }
  }
  pad_poses(count);
  return count;
}

void HypothesisVoting::score_pairs(const std::array<int, 2>& observations, int min_inliers,
                                   std::vector<ScoredPose>& candidates) {
  const Eigen::Matrix3d from_upright = cam_from_upright(problem_);
  const Eigen::Vector3d f0 = problem_.observation(observations[0]).bearing;
  const Eigen::Vector3d f1 = problem_.observation(observations[1]).bearing;
  const PriorGate gate(problem_, from_upright);
  const double mean2 = 0.5 * (direction_variance(problem_, observations[0]) +
                              direction_variance(problem_, observations[1]));
  const double relative = 2 * problem_.options->prior->gravity_sigma_rad +
                          std::sqrt(2 * mean2 / (f0 - f1).squaredNorm());
  std::vector<int> rest;
  std::vector<RemainingBlob> remaining =
      remaining_blobs(problem_, observations, UprightPrediction(problem_, observations), rest);
  for (RemainingBlob& blob : remaining) {
    const Eigen::Vector3d bearing(blob.bearing[0], blob.bearing[1], blob.bearing[2]);
    put(from_upright.transpose() * bearing, blob.bearing);
  }
  float first_bearing[3], to_camera[9];
  put(from_upright.transpose() * f0, first_bearing);
  for (int row = 0; row < 3; ++row) put(from_upright.row(row).transpose(), to_camera + 3 * row);
  for (const int a : problem_.observation(observations[0]).lamps) {
    if (problem_.out_of_time()) return;
    const std::size_t count = add_headings(observations, a, gate, relative);
    statistics_.assignments += static_cast<int>(combined_);
    ScoringInput input = scoring_input(a, rest, remaining);
    input.to_camera = to_camera;
    score_pairs_for_cpu(simd_)(first_bearing, input, pose_batch(), static_cast<int>(padded(count)),
                               {inliers_.data(), visible_.data()});
    for (std::size_t i = 0; i < count; ++i) {
      if (!accept(i, min_inliers)) continue;
      const double c = parameters_[1][i], s = parameters_[2][i];
      Eigen::Matrix3d about_vertical;
      about_vertical << c, -s, 0, s, c, 0, 0, 0, 1;
      ScoredPose candidate;
      const int b = neighbours_[a].map_points[batch_.second[i]];
      candidate.assignment = {{observations[0], a}, {observations[1], b}};
      candidate.pose.rotation = from_upright * about_vertical;
      candidate.pose.translation =
          unit_m_ * parameters_[0][i] * f0 - candidate.pose.rotation * problem_.map_point(a).centre;
      candidate.inliers = inliers_[i];
      candidates.push_back(std::move(candidate));
    }
  }
}

}  // namespace occ::internal::identify
