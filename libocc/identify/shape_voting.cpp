// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/shape_voting.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::identify {
namespace {

constexpr double horizon = 0.1;  // sine of the elevation below which a position is too inaccurate
constexpr double one_m = 1;      // assumed minimum height of the lamps above the camera

// Least-squares similarity between three points.
struct Similarity {
  Complex scale, shift;
  Complex operator()(const Complex& u) const { return shift + scale * u; }
};

Similarity fit(const std::array<Complex, 3>& from, const std::array<Complex, 3>& to) {
  const Complex middle_from = (from[0] + from[1] + from[2]) / 3.0,
                middle_to = (to[0] + to[1] + to[2]) / 3.0;
  Complex moment = 0;
  double spread = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    moment += std::conj(from[i] - middle_from) * (to[i] - middle_to);
    spread += std::norm(from[i] - middle_from);
  }
  const Complex scale = moment / spread;
  return {scale, middle_to - scale * middle_from};
}

Complex level(const Eigen::Vector3d& upright) {
  return {upright.x() / upright.z(), upright.y() / upright.z()};
}

}  // namespace

/// Three blobs in the order of a triangle's corners, and the gates of the remaining blobs.
struct ShapeVoting::LevelledTriple {
  std::array<int, 3> observations;
  std::array<Complex, 3> at;
  std::vector<int> others;
  std::vector<double> reach;  ///< gate radius of each remaining blob, in the plane at unit distance
  double relative = 0;        ///< error of the pose, see PriorGate::allows
  int side = 0;
};

ShapeVoting::ShapeVoting(const AssignmentProblem& problem, const LampTable& table)
    : problem_(problem),
      table_(table),
      cam_from_upright_(cam_from_upright(problem)),
      gate_(problem, cam_from_upright_) {
  const Camera& camera = *problem.camera;
  image_area_ = camera.width() * camera.height() / (camera.fx_px() * camera.fy_px());
  const double gravity = problem.options->prior->gravity_sigma_rad;
  for (const BearingObservation& s : problem.observations) {
    const Eigen::Vector3d upright = cam_from_upright_.transpose() * s.bearing;
    LevelledBlob l;
    if (std::abs(upright.z()) > horizon) {
      l.side = upright.z() > 0 ? 1 : -1;
      l.at = level(upright);
      l.tilted = {level(so3_exp({gravity, 0, 0}) * upright),
                  level(so3_exp({0, gravity, 0}) * upright)};
      l.sigma = s.sigma_rad * (1 + std::norm(l.at));
    }
    levelled_.push_back(l);
  }
}

bool ShapeVoting::neighbours_truncated() const {
  return table_.count() > static_cast<std::size_t>(LampTable::neighbours) + 1;
}

// Standard deviation of a triangle's shape, with the longest side first: errors of blobs, gravity
// and heights.
double ShapeVoting::shape_error(const std::array<const LevelledBlob*, 3>& c) const {
  const Complex shape = shape_of(c[0]->at, c[1]->at, c[2]->at);
  const double side2 = std::norm(c[1]->at - c[0]->at);
  double variance = 0;
  for (const LevelledBlob* corner : c) {
    const double uneven = table_.thickness_m() / one_m * std::abs(corner->at);
    variance += (corner->sigma * corner->sigma + uneven * uneven) / side2;
  }
  for (std::size_t axis = 0; axis < 2; ++axis)
    variance +=
        std::norm(shape_of(c[0]->tilted[axis], c[1]->tilted[axis], c[2]->tilted[axis]) - shape);
  return std::sqrt(variance);
}

// Standard deviation of the position predicted for another blob, at unit height.
double ShapeVoting::position_error(const LevelledTriple& triple, int observation) const {
  const LevelledBlob& other = levelled_[observation];
  std::array<const LevelledBlob*, 3> c;
  double mean2 = 0, spread2 = 0;
  const Complex middle = (triple.at[0] + triple.at[1] + triple.at[2]) / 3.0;
  for (std::size_t i = 0; i < 3; ++i) {
    c[i] = &levelled_[triple.observations[i]];
    mean2 += c[i]->sigma * c[i]->sigma / 3;
    spread2 += std::norm(c[i]->at - middle);
  }
  double variance =
      other.sigma * other.sigma + mean2 * (1.0 / 3 + 2 * std::norm(other.at - middle) / spread2);
  const double uneven = table_.thickness_m() / one_m * std::abs(other.at);
  variance += uneven * uneven;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Similarity back =
        fit({c[0]->tilted[axis], c[1]->tilted[axis], c[2]->tilted[axis]}, triple.at);
    variance += std::norm(back(other.tilted[axis]) - other.at);
  }
  return std::sqrt(variance);
}

void ShapeVoting::score(const LevelledTriple& triple, const std::array<int, 3>& lamps,
                        int min_inliers, std::vector<ScoredPose>& candidates) {
  for (std::size_t i = 0; i < 3; ++i)
    if (!problem_.allows(triple.observations[i], lamps[i])) return;
  const Similarity map = fit(
      triple.at, {table_.position(lamps[0]), table_.position(lamps[1]), table_.position(lamps[2])});
  const double height = std::abs(map.scale);  // of the lamp plane above the camera
  const Complex heading = std::conj(map.scale) / (triple.side * height);
  const Eigen::Vector3d position = Eigen::Vector3d(map.shift.real(), map.shift.imag(),
                                                   table_.height_m() - triple.side * height) -
                                   problem_.origin;
  const MapPoint& first = problem_.map_point(lamps[0]);
  const double distance_m = (position - first.centre).norm();
  if (!(first.normal.dot(position - first.centre) > 0) ||
      !gate_.allows(position, heading.real(), heading.imag(), distance_m, triple.relative))
    return;
  statistics_.poses += 1;
  statistics_.visible += std::max(0.0, table_.lamps_per_m2() * height * height * image_area_ - 3);
  ScoredPose candidate;
  for (std::size_t i = 0; i < triple.others.size(); ++i) {
    const int observation = triple.others[i];
    const int lamp = table_.lamp_near(map(levelled_[observation].at), height * triple.reach[i]);
    candidate.inliers += lamp >= 0 && problem_.allows(observation, lamp);
  }
  if (candidate.inliers < min_inliers) return;
  for (std::size_t i = 0; i < 3; ++i)
    candidate.assignment.push_back({triple.observations[i], lamps[i]});
  Eigen::Matrix3d about_vertical;
  about_vertical << heading.real(), -heading.imag(), 0, heading.imag(), heading.real(), 0, 0, 0, 1;
  candidate.pose.rotation = cam_from_upright_ * about_vertical;
  candidate.pose.translation = -(candidate.pose.rotation * position);
  candidates.push_back(std::move(candidate));
}

// Tries every order of the blobs in which they can be the corners of a triangle in the table.
void ShapeVoting::score_triples(const std::array<int, 3>& observations, int min_inliers,
                                std::vector<ScoredPose>& candidates) {
  const auto& [a, b, c] = observations;
  const auto levelled = [&](int s) { return &levelled_[s]; };
  const int side = levelled(a)->side;
  if (side == 0 || levelled(b)->side != side || levelled(c)->side != side) return;
  const double gate = problem_.options->gate_sigma;
  std::array<int, 3> order = observations;
  std::sort(order.begin(), order.end());
  do {
    if (problem_.out_of_time()) return;
    LevelledTriple triple{order, {}, {}, {}, 0, side};
    for (std::size_t i = 0; i < 3; ++i) triple.at[i] = levelled(order[i])->at;
    const Complex shape = shape_of(triple.at[0], triple.at[1], triple.at[2]);
    const double error =
        gate * shape_error({levelled(order[0]), levelled(order[1]), levelled(order[2])});
    if (!(error < 1) || shape.real() > 0.5 + error || std::abs(shape) > 1 + error ||
        std::abs(shape - 1.0) > 1 + error)
      continue;
    triple.relative = 2 * problem_.options->prior->gravity_sigma_rad + error / gate;
    for (int s = 0; s < static_cast<int>(levelled_.size()); ++s) {
      if (s == a || s == b || s == c || levelled(s)->side != side) continue;
      triple.others.push_back(s);
      triple.reach.push_back(gate * position_error(triple, s));
    }
    table_.visit_similar(shape, error, [&](const LampTable::Triangle& t) {
      statistics_.assignments += 1;
      score(triple, t.lamps, min_inliers, candidates);
    });
  } while (std::next_permutation(order.begin(), order.end()));
}

}  // namespace occ::internal::identify
