// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/internal/tag_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/math.hpp"

namespace occ::internal::calibrate {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;

/// Scale of acceptable residuals, as a fraction of the image size: the camera is uncalibrated.
constexpr double gate_fraction = 0.01;
constexpr int max_pairs = 6;  // start pairs that are tried, those with most common tags

}  // namespace

TagChain::TagChain(std::vector<Matrix3Xd> corners, std::vector<const Camera*> cameras,
                   std::vector<TagView> views)
    : corners_(std::move(corners)),
      cameras_(std::move(cameras)),
      views_(std::move(views)),
      of_image_(cameras_.size()),
      of_tag_(corners_.size()),
      poses_(cameras_.size()),
      placements_(corners_.size()) {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    of_image_[views_[i].image].push_back(static_cast<int>(i));
    of_tag_[views_[i].tag].push_back(static_cast<int>(i));
  }
}

const TagView* TagChain::view(int image, int tag) const {
  for (const int i : of_image_[image])
    if (views_[i].tag == tag) return &views_[i];
  return nullptr;
}

std::vector<int> TagChain::shared_tags(int a, int b) const {
  std::vector<int> shared;
  for (const int i : of_image_[a]) {
    const int tag = views_[i].tag;
    const bool counted = std::find(shared.begin(), shared.end(), tag) != shared.end();
    if (!counted && view(b, tag) != nullptr) shared.push_back(tag);
  }
  return shared;
}

double TagChain::rms_px(const TagView& view, const Rigid3& cam_from_tag) const {
  const Matrix2Xd off =
      pose_residuals(corners_[view.tag], view.px, *cameras_[view.image], cam_from_tag);
  return off.allFinite() ? std::sqrt(off.colwise().squaredNorm().mean()) : infinity;
}

/// Score of a fit: 1 for zero residuals, decreasing to 0 (Geman-McClure function).
double TagChain::fit_score(const TagView& view, const Rigid3& cam_from_tag) const {
  const Camera& camera = *cameras_[view.image];
  const double gate = gate_fraction * std::min(camera.width(), 4 * camera.height());
  const double ratio = rms_px(view, cam_from_tag) / gate;
  return std::isfinite(ratio) ? 1 / (1 + ratio * ratio) : 0;
}

TagChain::RelativePose TagChain::relative_pose(int a, int b) const {
  RelativePose best;
  best.a = a;
  best.b = b;
  const std::vector<int> shared = shared_tags(a, b);
  const auto total_score = [&](const Rigid3& b_from_a) {
    double sum = 0;
    for (const int tag : shared) {
      double best_score = 0;
      for (const TagPoseHypothesis& hypothesis : view(a, tag)->hypotheses)
        best_score =
            std::max(best_score, fit_score(*view(b, tag), b_from_a * hypothesis.cam_from_tag));
      for (const TagPoseHypothesis& hypothesis : view(b, tag)->hypotheses)
        best_score = std::max(
            best_score, fit_score(*view(a, tag), b_from_a.inverse() * hypothesis.cam_from_tag));
      sum += best_score;
    }
    return sum;
  };
  constexpr std::size_t max_tried = 30;  // common tags that yield hypotheses
  const std::size_t stride = 1 + shared.size() / max_tried;
  for (std::size_t i = 0; i < shared.size(); i += stride) {
    const int tag = shared[i];
    for (const TagPoseHypothesis& in_a : view(a, tag)->hypotheses)
      for (const TagPoseHypothesis& in_b : view(b, tag)->hypotheses) {
        const Rigid3 b_from_a = in_b.cam_from_tag * in_a.cam_from_tag.inverse();
        const double score = total_score(b_from_a);
        if (score > best.score) {
          best.score = score;
          best.b_from_a = b_from_a;
        }
      }
  }
  return best;
}

bool TagChain::connect(const std::vector<int>& images) {
  // Pairs sorted by the number of common tags.
  std::vector<std::pair<int, std::pair<int, int>>> pairs;
  for (const int a : images)
    for (const int b : images) {
      if (b <= a) continue;
      const int shared = static_cast<int>(shared_tags(a, b).size());
      if (shared > 0) pairs.push_back({-shared, {a, b}});
    }
  if (pairs.empty()) return false;
  std::sort(pairs.begin(), pairs.end());
  RelativePose start;
  for (std::size_t i = 0; i < pairs.size() && i < max_pairs; ++i) {
    const RelativePose candidate = relative_pose(pairs[i].second.first, pairs[i].second.second);
    if (candidate.score > start.score) start = candidate;
  }
  if (start.a < 0) return false;
  poses_[start.a] = Rigid3{};
  poses_[start.b] = start.b_from_a;
  place_tags_of(start.a);
  place_tags_of(start.b);
  pose_image(start.b);
  place_tags_of(start.b);
  std::vector<bool> failed(cameras_.size(), false);
  for (int next = next_image(images, failed); next >= 0; next = next_image(images, failed)) {
    if (pose_image(next)) {
      place_tags_of(next);
      failed.assign(cameras_.size(), false);  // its tags may complete images that failed before
    } else {
      failed[next] = true;
    }
  }
  return true;
}

int TagChain::next_image(const std::vector<int>& images, const std::vector<bool>& failed) const {
  int best = -1;
  double best_score = 0;
  constexpr double seen_once = 0.2;  // weight of a tag that only one posed image supports
  for (const int image : images) {
    const auto k = static_cast<std::size_t>(image);
    if (poses_[k] || failed[k]) continue;
    double score = 0;
    for (const int i : of_image_[k]) {
      const TagPlacement& placement = placements_[views_[i].tag];
      if (placement.world_from_tag) score += placement.views > 1 ? 1 : seen_once;
    }
    if (score > best_score) {
      best_score = score;
      best = image;
    }
  }
  return best;
}

bool TagChain::pose_image(int image) {
  const auto k = static_cast<std::size_t>(image);
  int reliable_tags = 0;
  for (const int i : of_image_[k]) reliable_tags += placements_[views_[i].tag].views > 1;
  constexpr int min_reliable_tags = 3;
  std::vector<const TagView*> used;
  for (const int i : of_image_[k]) {
    const TagView& view = views_[i];
    const TagPlacement& placement = placements_[view.tag];
    if (placement.world_from_tag && (reliable_tags < min_reliable_tags || placement.views > 1))
      used.push_back(&view);
  }
  if (used.empty()) return false;
  Matrix3Xd points(3, 4 * static_cast<Eigen::Index>(used.size()));
  Matrix2Xd px(2, points.cols());
  for (std::size_t n = 0; n < used.size(); ++n) {
    const auto tag = static_cast<std::size_t>(used[n]->tag);
    for (int c = 0; c < 4; ++c) {
      const Eigen::Index column = 4 * static_cast<Eigen::Index>(n) + c;
      points.col(column) = *placements_[tag].world_from_tag * Eigen::Vector3d(corners_[tag].col(c));
      px.col(column) = used[n]->px.col(c);
    }
  }
  ResectionOptions options;
  options.seed = static_cast<std::uint64_t>(image);
  const Camera& camera = *cameras_[k];
  const Result<Resection> found = resect(points, px, camera, options);
  if (!found.ok()) return false;
  const double gate = gate_fraction * std::min(camera.width(), 4 * camera.height());
  constexpr double max_gates = 3;
  if (found->sigma_px > max_gates * gate) return false;
  poses_[k] = found->cam_from_world;
  return true;
}

void TagChain::place_tags_of(int image) {
  std::vector<int> done;
  for (const int i : of_image_[image]) {
    const int tag = views_[i].tag;
    if (std::find(done.begin(), done.end(), tag) != done.end()) continue;
    done.push_back(tag);
    place_tag(tag);
  }
}

std::vector<BodyView> TagChain::body_views(int tag) const {
  std::vector<BodyView> posed;
  for (const int i : of_tag_[tag]) {
    const TagView& view = views_[i];
    const auto k = static_cast<std::size_t>(view.image);
    if (poses_[k]) posed.push_back({cameras_[k], *poses_[k], view.px, 1.0});
  }
  return posed;
}

/// Chooses the pose hypothesis that fits all posed images best, then fits the tag to these images.
void TagChain::place_tag(int tag) {
  TagPlacement& placement = placements_[tag];
  const std::vector<int>& all = of_tag_[tag];
  double best_score = 0;
  std::optional<Rigid3> best;
  std::vector<int> images;
  const auto consider = [&](const Rigid3& world_from_tag) {
    double sum = 0;
    for (const int i : all) {
      const TagView& view = views_[i];
      const auto& pose = poses_[view.image];
      if (pose) sum += fit_score(view, *pose * world_from_tag);
    }
    if (sum > best_score) {
      best_score = sum;
      best = world_from_tag;
    }
  };
  if (placement.world_from_tag) consider(*placement.world_from_tag);
  for (const int i : all) {
    const TagView& view = views_[i];
    const auto& pose = poses_[view.image];
    if (!pose) continue;
    if (std::find(images.begin(), images.end(), view.image) == images.end())
      images.push_back(view.image);
    for (const TagPoseHypothesis& hypothesis : view.hypotheses)
      consider(pose->inverse() * hypothesis.cam_from_tag);
  }
  if (!best) return;
  // Exclude views that contradict the others (gross errors).
  std::vector<BodyView> consistent_views;
  for (const int i : all) {
    const TagView& view = views_[i];
    const auto k = static_cast<std::size_t>(view.image);
    constexpr double min_score = 0.1;  // residuals of three gates
    if (poses_[k] && fit_score(view, *poses_[k] * *best) > min_score)
      consistent_views.push_back({cameras_[k], *poses_[k], view.px, 1.0});
  }
  placement.views = static_cast<int>(images.size());
  placement.world_from_tag = best;
  if (consistent_views.empty()) return;
  const BodyFit fit = fit_body(corners_[tag], consistent_views, *best, false);
  if (!std::isfinite(fit.chi2)) return;
  placement.world_from_tag = fit.world_from_body;
  placement.rms_px = std::sqrt(fit.chi2 / (4.0 * static_cast<double>(consistent_views.size())));
}

void TagChain::refine_all() {
  for (std::size_t k = 0; k < poses_.size(); ++k)
    if (poses_[k]) pose_image(static_cast<int>(k));
  for (std::size_t t = 0; t < placements_.size(); ++t)
    if (placements_[t].world_from_tag) place_tag(static_cast<int>(t));
}

BodyFit TagChain::scale_of(int tag) const {
  const TagPlacement& placement = placements_[tag];
  if (!placement.world_from_tag || placement.views < 2) return {};
  return fit_body(corners_[tag], body_views(tag), *placement.world_from_tag, true);
}

}  // namespace occ::internal::calibrate
