// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/ballot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace occ::internal::identify {

using namespace internal::core;

namespace {

// Of a lamp, for `blobs` blobs in the image: the convex part of the map that is in view holds about
// so many lamps, and a lamp at its border has them on one side only.
std::size_t max_neighbours(std::size_t blobs) { return std::clamp<std::size_t>(2 * blobs, 16, 24); }

void put(const Eigen::Vector3d& from, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

double largest_variance(const Eigen::Matrix2d& m) {
  const double mean = 0.5 * m.trace(), half = 0.5 * (m(0, 0) - m(1, 1));
  return mean + std::hypot(half, m(0, 1));
}

double variance(const AssignmentProblem& problem, int sighting) {
  const BearingObservation& s = problem.sighting(sighting);
  return largest_variance(s.covariance) + s.parallax_rad * s.parallax_rad;
}

std::size_t padded(std::size_t count) { return (count + max_lanes - 1) / max_lanes * max_lanes; }

// Blobs other than those named, with what those add to the error of a predicted direction: `extra`
// of the bearing.
template <std::size_t count, class Extra>
std::vector<Other> others_of(const AssignmentProblem& problem, const std::array<int, count>& named,
                             const Extra& extra, std::vector<int>& sightings) {
  std::vector<Other> others;
  sightings.clear();
  for (int s = 0; s < static_cast<int>(problem.sightings.size()); ++s) {
    if (std::find(named.begin(), named.end(), s) != named.end()) continue;
    Other other;
    put(problem.sighting(s).bearing, other.bearing);
    other.sigma2 = static_cast<float>(variance(problem, s) + extra(problem.sighting(s).bearing));
    others.push_back(other);
    sightings.push_back(s);
  }
  return others;
}

NamedTriples named_triples(const AssignmentProblem& problem, const std::array<int, 3>& sightings) {
  NamedTriples blobs{};
  const auto chord2 = [&](std::size_t i, std::size_t j) {
    return static_cast<float>(
        (problem.sighting(sightings[i]).bearing - problem.sighting(sightings[j]).bearing)
            .squaredNorm());
  };
  const auto noise2 = [&](std::size_t i, std::size_t j) {
    return static_cast<float>(variance(problem, sightings[i]) + variance(problem, sightings[j]));
  };
  for (std::size_t i = 0; i < 3; ++i) put(problem.sighting(sightings[i]).bearing, blobs.bearing[i]);
  blobs.chords = {chord2(0, 1), chord2(0, 2), chord2(1, 2)};
  blobs.noise2[0] = noise2(0, 1);
  blobs.noise2[1] = noise2(0, 2);
  blobs.noise2[2] = noise2(1, 2);
  return blobs;
}

/// By which three bearings, their angles apart, turn as one, seen at another.
class CommonTurn {
 public:
  CommonTurn(const AssignmentProblem& problem, const std::array<int, 3>& sightings) {
    for (const int s : sightings) {
      middle_ += problem.sighting(s).bearing / 3;
      mean2_ += variance(problem, s) / 3;
    }
    for (const int s : sightings) spread2_ += (problem.sighting(s).bearing - middle_).squaredNorm();
  }
  double operator()(const Eigen::Vector3d& bearing) const {
    return mean2_ * (1.0 / 3 + (bearing - middle_).squaredNorm() / spread2_);
  }

 private:
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  double mean2_ = 0, spread2_ = 0;
};

// Below this n . x, of a lamp at x with the normal n, both in the camera's frame, a vote takes it
// for visible: cones inside the half space are looked at with the winners, wider ones are not told.
float lit_below(const MapPoint& target) {
  return target.cone_cos < 0 ? std::numeric_limits<float>::infinity() : 0.0F;
}

// The least cosine between the normals of a lamp and of a plane with which the lamp is seen from
// one side of the plane only; a lamp of a scene is taken to be seen within 75 degrees.
double one_sided(const AssignmentProblem& problem, const MapPoint& target) {
  constexpr double flat = 0.966, never = 2;  // cosine of 15 degrees
  if (problem.scene) return flat;
  if (target.cone_cos < 0) return never;
  return std::min(1 - 1e-9, std::sqrt(1 - target.cone_cos * target.cone_cos));
}

}  // namespace

void Ballot::Table::resize(std::size_t size) {
  for (std::size_t k = 0; k < 3; ++k) {
    second_place[k].resize(size);
    third_place[k].resize(size);
  }
  second.resize(size);
  third.resize(size);
}

void Ballot::Table::copy(std::size_t from, const Table& other, std::size_t to) {
  for (std::size_t k = 0; k < 3; ++k) {
    second_place[k][to] = other.second_place[k][from];
    third_place[k][to] = other.third_place[k][from];
  }
  second[to] = other.second[from];
  third[to] = other.third[from];
}

Places Ballot::Table::places() const {
  return {{second_place[0].data(), second_place[1].data(), second_place[2].data()},
          {third_place[0].data(), third_place[1].data(), third_place[2].data()}};
}

Ballot::Ballot(const AssignmentProblem& problem, SeenTogether& together)
    : problem_(problem),
      together_(together),
      simd_(widest_simd()),
      neighbours_(problem.targets.size()) {
  const Camera& c = *problem.camera;
  frustum_ = {static_cast<float>((-0.5 - c.cx_px()) / c.fx_px()),
              static_cast<float>((c.width() - 0.5 - c.cx_px()) / c.fx_px()),
              static_cast<float>((-0.5 - c.cy_px()) / c.fy_px()),
              static_cast<float>((c.height() - 0.5 - c.cy_px()) / c.fy_px()), !c.is_pinhole()};
  const std::vector<MapPoint>& targets = problem.targets;
  const std::size_t others = targets.size() - 1;
  named_ = std::min(others, max_neighbours(problem.sightings.size()));
  const std::size_t kept = std::min(others, 3 * named_ / 2);
  std::vector<std::pair<double, int>> by_distance(targets.size());
  const auto distance = [&](std::size_t a, std::size_t b) {
    const double apart_m = (targets[b].centre - targets[a].centre).norm();
    const bool together = together_.pair(static_cast<int>(a), static_cast<int>(b));
    return together ? apart_m : apart_m + 3 * problem_.size_m;  // these come last
  };
  double spacing_m = 0;
  for (std::size_t a = 0; a < targets.size(); ++a) {
    for (std::size_t b = 0; b < targets.size(); ++b)
      by_distance[b] = {distance(a, b), static_cast<int>(b)};
    by_distance[a].first = std::numeric_limits<double>::infinity();
    const auto end = by_distance.begin() + static_cast<std::ptrdiff_t>(kept);
    std::partial_sort(by_distance.begin(), end, by_distance.end());
    for (auto it = by_distance.begin(); it != end; ++it)
      neighbours_[a].targets.push_back(it->second);
    spacing_m += by_distance[std::min<std::size_t>(2, kept - 1)].first;
  }
  unit_m_ = spacing_m / static_cast<double>(targets.size());
  for (std::size_t a = 0; a < targets.size(); ++a)
    for (const int b : neighbours_[a].targets) {
      const MapPoint& target = problem.target(b);
      NearLamp lamp;
      put((target.centre - targets[a].centre) / unit_m_, lamp.place);
      put(target.normal, lamp.normal);
      lamp.lit_below = lit_below(target);
      lamp.blur = static_cast<float>(std::pow(target.radius_m / unit_m_, 2));
      neighbours_[a].lamps.push_back(lamp);
    }
}

bool Ballot::knows_neighbours_only() const { return named_ + 1 < problem_.targets.size(); }

Jury Ballot::jury(int first, const std::vector<int>& sightings, const std::vector<Other>& others) {
  const Neighbours& near = neighbours_[first];
  may_be_.clear();
  for (const int t : near.targets)
    for (const int s : sightings) may_be_.push_back(problem_.may_be(s, t));
  Jury jury{};
  jury.lamps = near.lamps.data();
  jury.lamp_count = static_cast<int>(near.lamps.size());
  jury.others = others.data();
  jury.other_count = static_cast<int>(others.size());
  jury.may_be = may_be_.data();
  jury.gate2 = static_cast<float>(std::pow(problem_.options->gate_sigma, 2));
  jury.frustum = frustum_;
  return jury;
}

// Lamps that face the same side are seen from that side, so three of them run the same way round in
// the image: +-1, or 0 where noise hides it. That takes half of all namings away. For lamps not in
// one plane it holds as long as they are not seen at more than 75 degrees from their normals.
std::size_t Ballot::add_namings(const std::array<int, 3>& sightings, int first, int image_turn) {
  constexpr double same = 1 - 1e-9;
  const double flat = one_sided(problem_, problem_.target(first));
  const Neighbours& near = neighbours_[first];
  const std::size_t count = named_;
  namings_.resize(padded(count * count));
  const Eigen::Vector3d& normal = problem_.target(first).normal;
  std::size_t n = 0;
  for (std::size_t b = 0; b < count; ++b) {
    const MapPoint& second = problem_.target(near.targets[b]);
    if (!problem_.may_be(sightings[1], near.targets[b])) continue;
    const bool same_side = second.normal.dot(normal) > same;
    const Eigen::Vector3d e1 = second.centre - problem_.target(first).centre;
    for (std::size_t c = 0; c < count; ++c) {
      if (b == c || !problem_.may_be(sightings[2], near.targets[c])) continue;
      if (!together_.triple(first, near.targets[b], near.targets[c])) continue;
      const MapPoint& third = problem_.target(near.targets[c]);
      if (same_side && image_turn != 0) {
        const Eigen::Vector3d across = e1.cross(third.centre - problem_.target(first).centre);
        const double facing = across.dot(normal);
        if ((facing > 0) == (image_turn > 0) &&
            facing * facing > flat * flat * across.squaredNorm() && third.normal.dot(normal) > same)
          continue;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        namings_.second_place[k][n] = near.lamps[b].place[k];
        namings_.third_place[k][n] = near.lamps[c].place[k];
      }
      namings_.second[n] = static_cast<int>(b);
      namings_.third[n] = static_cast<int>(c);
      ++n;
    }
  }
  for (std::size_t i = n; n > 0 && i < padded(n); ++i) namings_.copy(n - 1, namings_, i);
  return n;
}

// The last lanes repeat the last pose.
void Ballot::pad_poses(std::size_t count) {
  for (std::size_t i = count; count > 0 && i < padded(count); ++i) {
    judged_.copy(count - 1, judged_, i);
    for (std::vector<float>& parameter : parameters_) parameter[i] = parameter[count - 1];
  }
  further_.resize(padded(count));
  visible_.resize(padded(count));
}

// Puts all valid sets of distances in line.
std::size_t Ballot::add_poses(std::size_t namings) {
  const std::size_t stride = padded(namings);
  judged_.resize(padded(4 * namings));
  for (auto& parameter : parameters_) parameter.resize(judged_.second.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < namings; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      if (valid_[k * stride + i] == 0) continue;
      judged_.copy(i, namings_, n);
      for (std::size_t d = 0; d < 3; ++d) parameters_[d][n] = depths_[d][k * stride + i];
      ++n;
    }
  pad_poses(n);
  return n;
}

bool Ballot::counts(std::size_t pose, int least) {
  turnout_.poses += 1;
  turnout_.visible += visible_[pose];
  return further_[pose] >= least;
}

Rigid3 Ballot::pose_of_three(const std::array<int, 3>& sightings, const std::array<int, 3>& targets,
                             std::size_t pose) const {
  Eigen::Matrix3d in_cam, in_map;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    in_cam.col(column) = problem_.sighting(sightings[i]).bearing * (unit_m_ * parameters_[i][pose]);
    in_map.col(column) = problem_.target(targets[i]).centre;
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

Judged Ballot::judged() const {
  return {{parameters_[0].data(), parameters_[1].data(), parameters_[2].data()},
          judged_.places(),
          judged_.second.data(),
          judged_.third.data()};
}

// How the three run round in the image, as add_namings takes it.
int Ballot::image_turn(const std::array<int, 3>& sightings) const {
  Eigen::Matrix3d f;
  double noise = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    f.col(static_cast<Eigen::Index>(i)) = problem_.sighting(sightings[i]).bearing;
    noise += std::sqrt(variance(problem_, sightings[i]));
  }
  const double reach = std::max((f.col(1) - f.col(0)).norm(), (f.col(2) - f.col(0)).norm());
  const double turn = f.determinant();
  if (!(std::abs(turn) > problem_.options->gate_sigma * noise * reach)) return 0;
  return turn > 0 ? 1 : -1;
}

void Ballot::solve(const NamedTriples& blobs, std::size_t namings) {
  const std::size_t stride = padded(namings);
  for (auto& depth : depths_) depth.resize(4 * stride);
  valid_.resize(4 * stride);
  solve_triples_for_cpu(simd_)(
      blobs, namings_.places(), static_cast<int>(stride),
      {{depths_[0].data(), depths_[1].data(), depths_[2].data()}, valid_.data()});
}

void Ballot::of_three(const std::array<int, 3>& sightings, int least, std::vector<Vote>& votes) {
  NamedTriples blobs = named_triples(problem_, sightings);
  const int turn = image_turn(sightings);
  std::vector<int> rest;
  const std::vector<Other> others =
      others_of(problem_, sightings, CommonTurn(problem_, sightings), rest);
  for (const int a : problem_.sighting(sightings[0]).lamps) {
    put(problem_.target(a).normal, blobs.first_normal);
    blobs.first_lit_below = lit_below(problem_.target(a));
    const std::size_t namings = add_namings(sightings, a, turn);
    turnout_.namings += static_cast<int>(namings);
    if (namings == 0) continue;
    solve(blobs, namings);
    const std::size_t count = add_poses(namings);
    judge_triples_for_cpu(simd_)(blobs, jury(a, rest, others), judged(),
                                 static_cast<int>(padded(count)),
                                 {further_.data(), visible_.data()});
    const std::vector<int>& near = neighbours_[a].targets;
    for (std::size_t i = 0; i < count; ++i) {
      if (!counts(i, least)) continue;
      const std::array<int, 3> targets{a, near[judged_.second[i]], near[judged_.third[i]]};
      Vote vote;
      for (std::size_t k = 0; k < 3; ++k) vote.naming.push_back({sightings[k], targets[k]});
      vote.pose = pose_of_three(sightings, targets, i);
      vote.further = further_[i];
      votes.push_back(std::move(vote));
    }
  }
}

// As pose/internal/upright_p2p.hpp: the side between two lamps is in the plane of their bearings,
// which leaves two headings, each with a place. What else the prior knows, such as the camera's
// height, leaves few of these.
std::size_t Ballot::add_headings(const std::array<int, 2>& sightings, int first,
                                 const PriorGate& gate, double relative) {
  constexpr double nearly_real = 1.02, min_horizontal = 1e-6;
  const Neighbours& near = neighbours_[first];
  judged_.resize(padded(2 * named_));
  for (auto& parameter : parameters_) parameter.resize(judged_.second.size());
  const Eigen::Matrix3d upright = cam_from_upright(problem_).transpose();
  const Eigen::Vector3d f0 = upright * problem_.sighting(sightings[0]).bearing;
  const Eigen::Vector3d f1 = upright * problem_.sighting(sightings[1]).bearing;
  const Eigen::Vector3d n = f0.cross(f1);
  const double n2 = n.squaredNorm();
  const Eigen::Vector3d& normal = problem_.target(first).normal;
  const double below = lit_below(problem_.target(first));
  std::size_t count = 0;
  for (std::size_t b = 0; b < named_; ++b) {
    if (!problem_.may_be(sightings[1], near.targets[b])) continue;
    if (!together_.pair(first, near.targets[b])) continue;
    const Eigen::Vector3d side =
        (problem_.target(first).centre - problem_.target(near.targets[b]).centre) / unit_m_;
    const double cosine = n.head<2>().dot(side.head<2>());
    const double sine = n.y() * side.x() - n.x() * side.y();
    const double reach2 = cosine * cosine + sine * sine, level = n.z() * side.z();
    if (!(reach2 > min_horizontal * min_horizontal * n2 * side.squaredNorm()) ||
        level * level > nearly_real * reach2)
      continue;
    const double off = std::sqrt(std::max(0.0, reach2 - level * level));
    for (const double way : {off, -off}) {
      const double c = (-level * cosine - way * sine) / reach2;
      const double s = (-level * sine + way * cosine) / reach2;
      const Eigen::Vector3d turned(c * side.x() - s * side.y(), s * side.x() + c * side.y(),
                                   side.z());
      const double d0 = turned.cross(f1).dot(n), d1 = turned.cross(f0).dot(n);
      const Eigen::Vector3d lit(c * normal.x() - s * normal.y(), s * normal.x() + c * normal.y(),
                                normal.z());
      if (!(d0 > 0 && d1 > 0 && lit.dot(f0) < below)) continue;
      if (!gate.is_open()) {
        const double distance_m = unit_m_ * d0 / n2;
        const Eigen::Vector3d seen(c * f0.x() + s * f0.y(), c * f0.y() - s * f0.x(), f0.z());
        if (!gate.allows(problem_.target(first).centre - distance_m * seen, c, s, distance_m,
                         relative))
          continue;
      }
      parameters_[0][count] = static_cast<float>(d0 / n2);
      parameters_[1][count] = static_cast<float>(c);
      parameters_[2][count] = static_cast<float>(s);
      judged_.second[count] = static_cast<int>(b);
      judged_.third[count] = -1;
      ++count;
    }
  }
  pad_poses(count);
  return count;
}

void Ballot::of_two(const std::array<int, 2>& sightings, int least, std::vector<Vote>& votes) {
  const Eigen::Matrix3d from_upright = cam_from_upright(problem_);
  const Eigen::Vector3d f0 = problem_.sighting(sightings[0]).bearing;
  const Eigen::Vector3d f1 = problem_.sighting(sightings[1]).bearing;
  const Eigen::Vector3d middle = 0.5 * (f0 + f1);
  const double mean2 = 0.5 * (variance(problem_, sightings[0]) + variance(problem_, sightings[1]));
  const double apart2 = (f0 - f1).squaredNorm();
  const double gravity2 = std::pow(problem_.options->prior->gravity_sigma_rad, 2);
  const PriorGate gate(problem_, from_upright);
  const double relative = 2 * std::sqrt(gravity2) + std::sqrt(2 * mean2 / apart2);
  std::vector<int> rest;
  // Turned and scaled as the two are; tilted by the error of gravity about them.
  std::vector<Other> others = others_of(
      problem_, sightings,
      [&](const Eigen::Vector3d& bearing) {
        const double away2 = (bearing - middle).squaredNorm();
        return mean2 * (0.5 + 4 * away2 / apart2) + 2 * gravity2 * away2;
      },
      rest);
  for (Other& other : others) {
    const Eigen::Vector3d bearing(other.bearing[0], other.bearing[1], other.bearing[2]);
    put(from_upright.transpose() * bearing, other.bearing);
  }
  float first_bearing[3], to_camera[9];
  put(from_upright.transpose() * f0, first_bearing);
  for (int row = 0; row < 3; ++row) put(from_upright.row(row).transpose(), to_camera + 3 * row);
  for (const int a : problem_.sighting(sightings[0]).lamps) {
    const std::size_t count = add_headings(sightings, a, gate, relative);
    turnout_.namings += static_cast<int>(named_);
    Jury jury_of_a = jury(a, rest, others);
    jury_of_a.to_camera = to_camera;
    judge_pairs_for_cpu(simd_)(first_bearing, jury_of_a, judged(), static_cast<int>(padded(count)),
                               {further_.data(), visible_.data()});
    for (std::size_t i = 0; i < count; ++i) {
      if (!counts(i, least)) continue;
      const double c = parameters_[1][i], s = parameters_[2][i];
      Eigen::Matrix3d turn;
      turn << c, -s, 0, s, c, 0, 0, 0, 1;
      Vote vote;
      const int b = neighbours_[a].targets[judged_.second[i]];
      vote.naming = {{sightings[0], a}, {sightings[1], b}};
      vote.pose.rotation = from_upright * turn;
      vote.pose.translation =
          unit_m_ * parameters_[0][i] * f0 - vote.pose.rotation * problem_.target(a).centre;
      vote.further = further_[i];
      votes.push_back(std::move(vote));
    }
  }
}

}  // namespace occ::internal::identify
