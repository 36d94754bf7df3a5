// SPDX-License-Identifier: Apache-2.0
// Pose clustering (generalised Hough transform): the poses of all namings of many blob triples are
// counted in cells of position and rotation; each true triple adds one to the cell of the true
// pose, chance spreads over all others. Cells overlap by half, so that a cluster on a border is
// whole in one of them. Stockman, "Object recognition and localization via pose clustering", CVGIP
// 40, 1987.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

constexpr double cell_of_neighbours = 0.25;  // of the lamps' typical spacing
constexpr double cell_rad = 0.15;
constexpr std::size_t max_triples = 24, max_cells = 50;

using Cell = std::array<int, 6>;  // position; rotation vector

// One of the 2 x 2 shifts of the grid: of positions, of rotations.
Cell cell_of(const Rigid3& pose, double cell_m, int shift) {
  const Eigen::Vector3d eye = pose.origin_in_source() / cell_m;
  const Eigen::AngleAxisd turn(pose.rotation);
  const Eigen::Vector3d rotation = turn.angle() * turn.axis() / cell_rad;
  Cell cell;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    cell[k] = static_cast<int>(std::floor(eye[i] + 0.5 * (shift & 1)));
    cell[k + 3] = static_cast<int>(std::floor(rotation[i] + 0.5 * (shift >> 1)));
  }
  return cell;
}

double spacing_m(const AssignmentProblem& problem) {
  double sum = 0;
  for (const MapPoint& a : problem.targets) {
    double nearest = 2 * problem.size_m;
    for (const MapPoint& b : problem.targets)
      if (&a != &b) nearest = std::min(nearest, (a.centre - b.centre).norm());
    sum += nearest;
  }
  return sum / static_cast<double>(problem.targets.size());
}

}  // namespace

void Search::cluster() {
  Ballot ballot(problem_, together_);
  TripleOrder order(problem_);
  if (ballot.knows_neighbours_only()) order.prefer_neighbours(problem_);
  std::vector<Vote> votes;
  turnout_.emplace();
  for (std::size_t i = 0; i < max_triples && !cut_short_; ++i) {
    const auto triple = order.next(order.blobs() - 3);
    if (!triple) break;
    ballot.of_three(triple->sightings, 1, votes);
    turnout_ = ballot.turnout();
    cut_short_ = spent() >= problem_.options->max_hypotheses;
  }
  const double cell_m = cell_of_neighbours * spacing_m(problem_);
  std::map<Cell, std::vector<std::size_t>> cells[4];
  for (std::size_t i = 0; i < votes.size(); ++i)
    for (int shift = 0; shift < 4; ++shift)
      cells[shift][cell_of(votes[i].pose, cell_m, shift)].push_back(i);
  std::vector<const std::vector<std::size_t>*> fullest;
  for (const auto& grid : cells)
    for (const auto& [cell, members] : grid) fullest.push_back(&members);
  std::stable_sort(fullest.begin(), fullest.end(),
                   [](const auto* a, const auto* b) { return a->size() > b->size(); });
  if (fullest.size() > max_cells) fullest.resize(max_cells);
  for (const auto* members : fullest)
    for (const std::size_t i : *members)
      if (!known(votes[i])) consider(votes[i]);
  tried_ = spent();
}

}  // namespace occ::internal::identify
