// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/tag_placement.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

/// Shift and scale that bring points to the range -1 to 1 about their mean.
Matrix3d normalisation(const std::vector<Vector2d>& points) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double size = 0;
  for (const Vector2d& p : points) size = std::max(size, (p - mean).cwiseAbs().maxCoeff());
  Matrix3d to = Matrix3d::Identity();
  to(0, 0) = to(1, 1) = 1 / size;
  to.block<2, 1>(0, 2) = -mean / size;
  return to;
}

Vector2d mapped(const Matrix3d& h, const Vector2d& p) {
  return (h * p.homogeneous()).hnormalized();
}

double side_of(const std::array<Vector2d, 4>& corners) {
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += (corners[(k + 1) % 4] - corners[k]).norm();
  return 0.25 * sum;
}

Vector2d middle_of(const std::array<Vector2d, 4>& corners) {
  return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
}

/// A detected tag that has an id of the board.
struct BoardCandidate {
  std::size_t detected = 0;
  const AprilTag* tag = nullptr;
  const BoardTag* on_board = nullptr;
  Matrix3d px_from_board = Matrix3d::Identity();
};

/// True if the homography of `from` predicts the corners of `to`.
bool predicts(const BoardCandidate& from, const BoardCandidate& to) {
  // The tolerance grows with the distance, since errors of the corners and the lens distortion are
  // extrapolated. A tag of another place is off by more than its side, as tags do not touch.
  constexpr double near = 0.3, per_side = 0.1, max_tolerance = 0.5;
  const double sides =
      (middle_of(to.on_board->corners_m) - middle_of(from.on_board->corners_m)).norm() /
      side_of(from.on_board->corners_m);
  const double tolerance_px =
      std::min(near + per_side * sides, max_tolerance) * side_of(to.tag->corners_px);
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d at = from.px_from_board * to.on_board->corners_m[k].homogeneous();
    // Beyond the horizon of the homography the sign of the third coordinate changes.
    const Eigen::Vector3d own = from.px_from_board * from.on_board->corners_m[k].homogeneous();
    if (!(at.z() * own.z() > 0) ||
        !((at.hnormalized() - to.tag->corners_px[k]).norm() < tolerance_px))
      return false;
  }
  return true;
}

/// Sets of candidates that are linked by agreement, the largest first.
std::vector<std::vector<std::size_t>> linked_sets(const std::vector<BoardCandidate>& candidates) {
  std::vector<std::size_t> set_of(candidates.size());
  std::iota(set_of.begin(), set_of.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (set_of[i] != i) i = set_of[i] = set_of[set_of[i]];
    return i;
  };
  for (std::size_t i = 0; i < candidates.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (candidates[i].on_board == candidates[k].on_board || root(i) == root(k)) continue;
      if (predicts(candidates[i], candidates[k]) && predicts(candidates[k], candidates[i]))
        set_of[root(i)] = root(k);
    }
  std::map<std::size_t, std::vector<std::size_t>> by_root;
  for (std::size_t i = 0; i < candidates.size(); ++i) by_root[root(i)].push_back(i);
  std::vector<std::vector<std::size_t>> sets;
  for (auto& [first, members] : by_root) sets.push_back(std::move(members));
  std::stable_sort(sets.begin(), sets.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return sets;
}

/// Ids that two sets have in common.
std::vector<int> common_ids(const std::vector<BoardCandidate>& candidates,
                            const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  std::set<int> of_a, common;
  for (const std::size_t i : a) of_a.insert(candidates[i].tag->id);
  for (const std::size_t i : b)
    if (of_a.count(candidates[i].tag->id) > 0) common.insert(candidates[i].tag->id);
  return {common.begin(), common.end()};
}

std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace

std::string id_list(const std::vector<int>& ids) {
  constexpr std::size_t max_shown = 8;
  const std::size_t shown = ids.size() > max_shown + 1 ? max_shown : ids.size();
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) {
    const bool last = i + 1 == ids.size();
    text += (i == 0 ? "" : last ? " and " : ", ") + std::to_string(ids[i]);
  }
  return shown < ids.size() ? text + " and " + std::to_string(ids.size() - shown) + " more" : text;
}

Matrix3d plane_homography(const std::vector<Vector2d>& plane_m, const std::vector<Vector2d>& px) {
  // Linear least squares with h_33 = 1 in normalised coordinates (Hartley, Zisserman, "Multiple
  // view geometry", 2nd edition, sections 4.1.2 and 4.4).
  const Matrix3d from = normalisation(plane_m), to = normalisation(px);
  const auto n = static_cast<Eigen::Index>(plane_m.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * n, 8);
  Eigen::VectorXd b(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector2d p = mapped(from, plane_m[static_cast<std::size_t>(i)]);
    const Vector2d q = mapped(to, px[static_cast<std::size_t>(i)]);
    for (const Eigen::Index axis : {0, 1}) {
      a.block<1, 2>(2 * i + axis, 3 * axis) = p.transpose();
      a(2 * i + axis, 3 * axis + 2) = 1;
      a.block<1, 2>(2 * i + axis, 6) = -q[axis] * p.transpose();
      b[2 * i + axis] = q[axis];
    }
  }
  const Eigen::VectorXd h = core::solve_pivoted_qr(a, b);
  Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return to.inverse() * homography * from;
}

Result<BoardTagPlacement> place_tags(const std::vector<AprilTag>& detected,
                                     const std::vector<BoardTag>& board) {
  Result<BoardTagPlacement> result;
  std::vector<BoardCandidate> candidates;
  const std::string ids = "the board has the ids 0 to " + std::to_string(board.size() - 1);
  for (std::size_t i = 0; i < detected.size(); ++i) {
    const AprilTag& tag = detected[i];
    if (tag.id >= static_cast<int>(board.size())) {
      result.value.foreign_ids.push_back(tag.id);
      continue;
    }
    BoardCandidate candidate{i, &tag, &board[static_cast<std::size_t>(tag.id)], {}};
    candidate.px_from_board = plane_homography(
        {candidate.on_board->corners_m.begin(), candidate.on_board->corners_m.end()},
        {tag.corners_px.begin(), tag.corners_px.end()});
    candidates.push_back(candidate);
  }
  if (candidates.empty()) {
    result.status = Status::too_few_lamps;
    result.message = detected.empty() ? "no tag was detected"
                                      : "no tag of the board was detected: found " +
                                            id_list(result.value.foreign_ids) + ", " + ids;
    return result;
  }
  const std::vector<std::vector<std::size_t>> sets = linked_sets(candidates);
  std::set<int> placed;
  for (const std::size_t i : sets[0]) {
    if (!placed.insert(candidates[i].tag->id).second) {
      result.value.misplaced_ids.push_back(candidates[i].tag->id);
      continue;
    }
    result.value.tags.push_back(
        {candidates[i].detected, static_cast<std::size_t>(candidates[i].tag->id)});
  }
  for (std::size_t k = 1; k < sets.size(); ++k)
    for (const std::size_t i : sets[k]) result.value.misplaced_ids.push_back(candidates[i].tag->id);
  std::sort(result.value.misplaced_ids.begin(), result.value.misplaced_ids.end());
  // A loose or misread tag is excluded. Several that fit each other are a second board if their ids
  // occur twice; otherwise, the board has another arrangement, in which rows fit each other.
  constexpr std::size_t min_second = 3;
  bool has_rival = sets.size() > 1 && sets[0].size() == 1;
  for (std::size_t k = 1; k < sets.size() && sets[k].size() >= min_second; ++k) {
    const std::vector<int> twice = common_ids(candidates, sets[0], sets[k]);
    has_rival = has_rival || twice.empty();
    if (twice.size() < min_second) continue;
    result.status = Status::ambiguous;
    result.message = "two boards are in the image: tags " + id_list(twice) + " are visible twice";
    return result;
  }
  constexpr double min_part = 0.7;  // of the tags, if pairs of others fit each other
  has_rival = has_rival || (sets.size() > 1 && sets[1].size() > 1 &&
                            static_cast<double>(sets[0].size()) <
                                min_part * static_cast<double>(candidates.size()));
  if (has_rival) {
    result.status = Status::degenerate;
    result.message = "the tags are arranged in another way than on the board: only " +
                     std::to_string(sets[0].size()) + " of " + counted(candidates.size(), "tag") +
                     " fit; check the numbers of columns and rows, and the ratio of the sizes";
  }
  return result;
}

}  // namespace occ::internal::landmarks
