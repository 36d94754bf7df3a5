// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/shape_ballot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::identify {
namespace {

constexpr double horizon = 0.1;  // sine of the elevation below which a place is hardly known
constexpr double one_m = 1;      // lamps are taken to be so far above the camera at least

// The similarity that takes three points to others best.
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

/// Three blobs in the order of a triangle's corners, and how far others may be off.
struct ShapeBallot::Trio {
  std::array<int, 3> sightings;
  std::array<Complex, 3> at;
  std::vector<int> others;
  std::vector<double> reach;  ///< of each other, in the plane one above the camera
  double relative = 0;        ///< error of the pose, see PriorGate
  int side = 0;
};

ShapeBallot::ShapeBallot(const AssignmentProblem& problem, const LampTable& table)
    : problem_(problem),
      table_(table),
      cam_from_upright_(cam_from_upright(problem)),
      gate_(problem, cam_from_upright_) {
  const Camera& camera = *problem.camera;
  image_area_ = camera.width() * camera.height() / (camera.fx_px() * camera.fy_px());
  const double gravity = problem.options->prior->gravity_sigma_rad;
  for (const BearingObservation& s : problem.sightings) {
    const Eigen::Vector3d upright = cam_from_upright_.transpose() * s.bearing;
    Levelled l;
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

bool ShapeBallot::knows_neighbours_only() const {
  return table_.count() > static_cast<std::size_t>(LampTable::neighbours) + 1;
}

// Of a triangle's shape, its longest side being the first: of blobs, gravity and uneven heights.
double ShapeBallot::shape_error(const std::array<const Levelled*, 3>& c) const {
  const Complex shape = shape_of(c[0]->at, c[1]->at, c[2]->at);
  const double side2 = std::norm(c[1]->at - c[0]->at);
  double variance = 0;
  for (const Levelled* corner : c) {
    const double uneven = table_.thickness_m() / one_m * std::abs(corner->at);
    variance += (corner->sigma * corner->sigma + uneven * uneven) / side2;
  }
  for (std::size_t way = 0; way < 2; ++way)
    variance +=
        std::norm(shape_of(c[0]->tilted[way], c[1]->tilted[way], c[2]->tilted[way]) - shape);
  return std::sqrt(variance);
}

// Of the place where the three say that another blob's lamp is, heights one.
double ShapeBallot::place_error(const Trio& trio, int sighting) const {
  const Levelled& other = levelled_[sighting];
  std::array<const Levelled*, 3> c;
  double mean2 = 0, spread2 = 0;
  const Complex middle = (trio.at[0] + trio.at[1] + trio.at[2]) / 3.0;
  for (std::size_t i = 0; i < 3; ++i) {
    c[i] = &levelled_[trio.sightings[i]];
    mean2 += c[i]->sigma * c[i]->sigma / 3;
    spread2 += std::norm(c[i]->at - middle);
  }
  double variance =
      other.sigma * other.sigma + mean2 * (1.0 / 3 + 2 * std::norm(other.at - middle) / spread2);
  const double uneven = table_.thickness_m() / one_m * std::abs(other.at);
  variance += uneven * uneven;
  for (std::size_t way = 0; way < 2; ++way) {
    const Similarity back = fit({c[0]->tilted[way], c[1]->tilted[way], c[2]->tilted[way]}, trio.at);
    variance += std::norm(back(other.tilted[way]) - other.at);
  }
  return std::sqrt(variance);
}

void ShapeBallot::judge(const Trio& trio, const std::array<int, 3>& lamps, int least,
                        std::vector<Vote>& votes) {
  for (std::size_t i = 0; i < 3; ++i)
    if (!problem_.may_be(trio.sightings[i], lamps[i])) return;
  const Similarity map =
      fit(trio.at, {table_.place(lamps[0]), table_.place(lamps[1]), table_.place(lamps[2])});
  const double height = std::abs(map.scale);  // of the lamps' plane over the camera
  const Complex turn = std::conj(map.scale) / (trio.side * height);
  const Eigen::Vector3d place =
      Eigen::Vector3d(map.shift.real(), map.shift.imag(), table_.height_m() - trio.side * height) -
      problem_.origin;
  const MapPoint& first = problem_.target(lamps[0]);
  const double distance_m = (place - first.centre).norm();
  if (!(first.normal.dot(place - first.centre) > 0) ||
      !gate_.allows(place, turn.real(), turn.imag(), distance_m, trio.relative))
    return;
  turnout_.poses += 1;
  turnout_.visible += std::max(0.0, table_.lamps_per_m2() * height * height * image_area_ - 3);
  Vote vote;
  for (std::size_t i = 0; i < trio.others.size(); ++i) {
    const int sighting = trio.others[i];
    const int lamp = table_.lamp_near(map(levelled_[sighting].at), height * trio.reach[i]);
    vote.further += lamp >= 0 && problem_.may_be(sighting, lamp);
  }
  if (vote.further < least) return;
  for (std::size_t i = 0; i < 3; ++i) vote.naming.push_back({trio.sightings[i], lamps[i]});
  Eigen::Matrix3d about_vertical;
  about_vertical << turn.real(), -turn.imag(), 0, turn.imag(), turn.real(), 0, 0, 0, 1;
  vote.pose.rotation = cam_from_upright_ * about_vertical;
  vote.pose.translation = -(vote.pose.rotation * place);
  votes.push_back(std::move(vote));
}

// Every order of the blobs that may be that of a triangle's corners in the table.
void ShapeBallot::of_three(const std::array<int, 3>& sightings, int least,
                           std::vector<Vote>& votes) {
  const auto& [a, b, c] = sightings;
  const auto levelled = [&](int s) { return &levelled_[s]; };
  const int side = levelled(a)->side;
  if (side == 0 || levelled(b)->side != side || levelled(c)->side != side) return;
  const double gate = problem_.options->gate_sigma;
  std::array<int, 3> order = sightings;
  std::sort(order.begin(), order.end());
  do {
    Trio trio{order, {}, {}, {}, 0, side};
    for (std::size_t i = 0; i < 3; ++i) trio.at[i] = levelled(order[i])->at;
    const Complex shape = shape_of(trio.at[0], trio.at[1], trio.at[2]);
    const double error =
        gate * shape_error({levelled(order[0]), levelled(order[1]), levelled(order[2])});
    if (!(error < 1) || shape.real() > 0.5 + error || std::abs(shape) > 1 + error ||
        std::abs(shape - 1.0) > 1 + error)
      continue;
    trio.relative = 2 * problem_.options->prior->gravity_sigma_rad + error / gate;
    for (int s = 0; s < static_cast<int>(levelled_.size()); ++s) {
      if (s == a || s == b || s == c || levelled(s)->side != side) continue;
      trio.others.push_back(s);
      trio.reach.push_back(gate * place_error(trio, s));
    }
    table_.visit_alike(shape, error, [&](const LampTable::Triangle& t) {
      turnout_.namings += 1;
      judge(trio, t.lamps, least, votes);
    });
  } while (std::next_permutation(order.begin(), order.end()));
}

}  // namespace occ::internal::identify
