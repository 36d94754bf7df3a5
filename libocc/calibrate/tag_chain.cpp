// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/internal/tag_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace occ::internal::calibrate {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double gate_part = 0.01;  // of the image's size: how far off is wrong, before calibration
constexpr int pairs_tried = 6;

}  // namespace

TagChain::TagChain(std::vector<Matrix3Xd> corners, std::vector<const Camera*> cameras,
                   std::vector<TagView> views)
    : corners_(std::move(corners)),
      cameras_(std::move(cameras)),
      views_(std::move(views)),
      of_image_(cameras_.size()),
      of_tag_(corners_.size()),
      poses_(cameras_.size()),
      places_(corners_.size()) {
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
    const bool known = std::find(shared.begin(), shared.end(), tag) != shared.end();
    if (!known && view(b, tag) != nullptr) shared.push_back(tag);
  }
  return shared;
}

double TagChain::rms_px(const TagView& view, const Rigid3& cam_from_tag) const {
  const Matrix2Xd off =
      pose_residuals(corners_[view.tag], view.px, *cameras_[view.image], cam_from_tag);
  return off.allFinite() ? std::sqrt(off.colwise().squaredNorm().mean()) : infinity;
}

// From 1 for a perfect fit to 0 for none (Geman, McClure).
double TagChain::likely(const TagView& view, const Rigid3& cam_from_tag) const {
  const Camera& camera = *cameras_[view.image];
  const double gate = gate_part * std::min(camera.width(), 4 * camera.height());
  const double part = rms_px(view, cam_from_tag) / gate;
  return std::isfinite(part) ? 1 / (1 + part * part) : 0;
}

TagChain::PairStart TagChain::relative_pose(int a, int b) const {
  PairStart best;
  best.a = a;
  best.b = b;
  const std::vector<int> shared = shared_tags(a, b);
  const auto score = [&](const Rigid3& b_from_a) {
    double sum = 0;
    for (const int tag : shared) {
      double most = 0;
      for (const TagSighting& seen : view(a, tag)->sightings)
        most = std::max(most, likely(*view(b, tag), b_from_a * seen.cam_from_tag));
      for (const TagSighting& seen : view(b, tag)->sightings)
        most = std::max(most, likely(*view(a, tag), b_from_a.inverse() * seen.cam_from_tag));
      sum += most;
    }
    return sum;
  };
  constexpr std::size_t max_tried = 30;
  const std::size_t stride = 1 + shared.size() / max_tried;
  for (std::size_t i = 0; i < shared.size(); i += stride) {
    const int tag = shared[i];
    for (const TagSighting& in_a : view(a, tag)->sightings)
      for (const TagSighting& in_b : view(b, tag)->sightings) {
        const Rigid3 b_from_a = in_b.cam_from_tag * in_a.cam_from_tag.inverse();
        const double agree = score(b_from_a);
        if (agree > best.agree) {
          best.agree = agree;
          best.b_from_a = b_from_a;
        }
      }
  }
  return best;
}

bool TagChain::link(const std::vector<int>& images) {
  // Pairs by how many tags they share; relative poses of the most promising only.
  std::vector<std::pair<int, std::pair<int, int>>> pairs;
  for (const int a : images)
    for (const int b : images) {
      if (b <= a) continue;
      const int shared = static_cast<int>(shared_tags(a, b).size());
      if (shared > 0) pairs.push_back({-shared, {a, b}});
    }
  if (pairs.empty()) return false;
  std::sort(pairs.begin(), pairs.end());
  PairStart start;
  for (std::size_t i = 0; i < pairs.size() && i < pairs_tried; ++i) {
    const PairStart one = relative_pose(pairs[i].second.first, pairs[i].second.second);
    if (one.agree > start.agree) start = one;
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
      failed.assign(cameras_.size(), false);  // it may have hung what those lacked
    } else {
      failed[next] = true;
    }
  }
  return true;
}

int TagChain::next_image(const std::vector<int>& images, const std::vector<bool>& failed) const {
  int best = -1;
  double most = 0;
  constexpr double seen_once = 0.2;  // a tag that hangs by one image's word
  for (const int image : images) {
    const auto k = static_cast<std::size_t>(image);
    if (poses_[k] || failed[k]) continue;
    double worth = 0;
    for (const int i : of_image_[k]) {
      const TagPlace& place = places_[views_[i].tag];
      if (place.world_from_tag) worth += place.views > 1 ? 1 : seen_once;
    }
    if (worth > most) {
      most = worth;
      best = image;
    }
  }
  return best;
}

bool TagChain::pose_image(int image) {
  const auto k = static_cast<std::size_t>(image);
  int sure = 0;
  for (const int i : of_image_[k]) sure += places_[views_[i].tag].views > 1;
  constexpr int enough = 3;
  std::vector<const TagView*> used;
  for (const int i : of_image_[k]) {
    const TagView& view = views_[i];
    const TagPlace& place = places_[view.tag];
    if (place.world_from_tag && (sure < enough || place.views > 1)) used.push_back(&view);
  }
  if (used.empty()) return false;
  Matrix3Xd points(3, 4 * static_cast<Eigen::Index>(used.size()));
  Matrix2Xd px(2, points.cols());
  for (std::size_t n = 0; n < used.size(); ++n) {
    const auto tag = static_cast<std::size_t>(used[n]->tag);
    for (int c = 0; c < 4; ++c) {
      const Eigen::Index at = 4 * static_cast<Eigen::Index>(n) + c;
      points.col(at) = *places_[tag].world_from_tag * Eigen::Vector3d(corners_[tag].col(c));
      px.col(at) = used[n]->px.col(c);
    }
  }
  ResectionOptions options;
  options.seed = static_cast<std::uint64_t>(image);
  const Camera& camera = *cameras_[k];
  const Result<Resection> found = resect(points, px, camera, options);
  if (!found.ok()) return false;
  const double gate = gate_part * std::min(camera.width(), 4 * camera.height());
  constexpr double gates = 3;
  if (found->sigma_px > gates * gate) return false;
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
  std::vector<BodyView> seen;
  for (const int i : of_tag_[tag]) {
    const TagView& view = views_[i];
    const auto k = static_cast<std::size_t>(view.image);
    if (poses_[k]) seen.push_back({cameras_[k], *poses_[k], view.px, 1.0});
  }
  return seen;
}

// The sighting that fits all images best, then a fit to all of them.
void TagChain::place_tag(int tag) {
  TagPlace& place = places_[tag];
  const std::vector<int>& all = of_tag_[tag];
  double most = 0;
  std::optional<Rigid3> best;
  std::vector<int> images;
  const auto consider = [&](const Rigid3& world_from_tag) {
    double sum = 0;
    for (const int i : all) {
      const TagView& view = views_[i];
      const auto& pose = poses_[view.image];
      if (pose) sum += likely(view, *pose * world_from_tag);
    }
    if (sum > most) {
      most = sum;
      best = world_from_tag;
    }
  };
  if (place.world_from_tag) consider(*place.world_from_tag);
  for (const int i : all) {
    const TagView& view = views_[i];
    const auto& pose = poses_[view.image];
    if (!pose) continue;
    if (std::find(images.begin(), images.end(), view.image) == images.end())
      images.push_back(view.image);
    for (const TagSighting& seen : view.sightings) consider(pose->inverse() * seen.cam_from_tag);
  }
  if (!best) return;
  // A view that contradicts the others (a gross error) may not bend the fit.
  std::vector<BodyView> agreeing;
  for (const int i : all) {
    const TagView& view = views_[i];
    const auto k = static_cast<std::size_t>(view.image);
    constexpr double min_likely = 0.1;  // three gates
    if (poses_[k] && likely(view, *poses_[k] * *best) > min_likely)
      agreeing.push_back({cameras_[k], *poses_[k], view.px, 1.0});
  }
  place.views = static_cast<int>(images.size());
  place.world_from_tag = best;
  if (agreeing.empty()) return;
  const BodyFit fit = fit_body(corners_[tag], agreeing, *best, false);
  if (!std::isfinite(fit.chi2)) return;
  place.world_from_tag = fit.world_from_body;
  place.rms_px = std::sqrt(fit.chi2 / (4.0 * static_cast<double>(agreeing.size())));
}

void TagChain::sweep() {
  for (std::size_t k = 0; k < poses_.size(); ++k)
    if (poses_[k]) pose_image(static_cast<int>(k));
  for (std::size_t t = 0; t < places_.size(); ++t)
    if (places_[t].world_from_tag) place_tag(static_cast<int>(t));
}

BodyFit TagChain::scale_of(int tag) const {
  const TagPlace& place = places_[tag];
  if (!place.world_from_tag || place.views < 2) return {};
  return fit_body(corners_[tag], body_views(tag), *place.world_from_tag, true);
}

}  // namespace occ::internal::calibrate
