// SPDX-License-Identifier: Apache-2.0
// Pose clustering (generalised Hough transform; Stockman, "Object recognition and localization via
// pose clustering", CVGIP 40, 1987).
//
// The poses of all assignments of many blob triples are counted in cells of position and rotation.
// Each triple of true lights adds one to the cell of the true pose; wrong poses spread over all
// cells. Four grids are shifted by half a cell, so that a cluster at a cell border is complete in
// another grid.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

constexpr double cell_of_neighbours =
    0.25;  // edge of a position cell, in units of the mean distance of nearest neighbours
constexpr double cell_rad = 0.15;
constexpr std::size_t max_triples = 24, max_cells = 50;

using Cell = std::array<int, 6>;  // position, then rotation vector

// Cell of a pose in one of four grids. Bit 0 of `shift` shifts positions by half a cell, bit 1
// rotations.
Cell cell_of(const Rigid3& pose, double cell_m, int shift) {
  const Eigen::Vector3d eye = pose.origin_in_source() / cell_m;
  const Eigen::AngleAxisd angle_axis(pose.rotation);
  const Eigen::Vector3d rotation = angle_axis.angle() * angle_axis.axis() / cell_rad;
  Cell cell;
  for (int i = 0; i < 3; ++i) {
    cell[i] = static_cast<int>(std::floor(eye[i] + 0.5 * (shift & 1)));
    cell[i + 3] = static_cast<int>(std::floor(rotation[i] + 0.5 * (shift >> 1)));
  }
  return cell;
}

double spacing_m(const AssignmentProblem& problem) {
  double sum = 0;
  for (const MapPoint& a : problem.map_points) {
    double nearest = 2 * problem.size_m;
    for (const MapPoint& b : problem.map_points)
      if (&a != &b) nearest = std::min(nearest, (a.centre - b.centre).norm());
    sum += nearest;
  }
  return sum / static_cast<double>(problem.map_points.size());
}

}  // namespace

void Search::search_by_clustering() {
  HypothesisVoting voting(problem_, covisibility_, sizes_);
  TripleOrder order(problem_);
  if (voting.neighbours_truncated()) order.prefer_neighbours(problem_);
  std::vector<ScoredPose> candidates;
  statistics_.emplace();
  groups_in_all_ = std::min(static_cast<int>(max_triples), order.groups());
  for (std::size_t i = 0; i < max_triples && !cut_short_; ++i) {
    const auto triple = order.next(order.blobs() - 3);
    if (!triple) break;
    voting.score_triples(triple->observations, 1, candidates);
    statistics_ = voting.statistics();
    cut_short_ = reached_limit();
    if (!cut_short_) ++groups_;
  }
  const double cell_m = cell_of_neighbours * spacing_m(problem_);
  std::map<Cell, std::vector<std::size_t>> cells[4];
  for (std::size_t i = 0; i < candidates.size(); ++i)
    for (int shift = 0; shift < 4; ++shift)
      cells[shift][cell_of(candidates[i].pose, cell_m, shift)].push_back(i);
  std::vector<const std::vector<std::size_t>*> fullest;
  for (const auto& grid : cells)
    for (const auto& [cell, members] : grid) fullest.push_back(&members);
  std::stable_sort(fullest.begin(), fullest.end(),
                   [](const auto* a, const auto* b) { return a->size() > b->size(); });
  if (fullest.size() > max_cells) fullest.resize(max_cells);
  for (const auto* members : fullest)
    for (const std::size_t i : *members)
      if (!problem_.out_of_time() && !is_duplicate(candidates[i])) consider(candidates[i]);
  cut_short_ = cut_short_ || problem_.out_of_time();
  tried_ = cost();
}

}  // namespace occ::internal::identify
