// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/start_network.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <sstream>

#include "libocc/calibrate/internal/tag_chain.hpp"
#include "libocc/core/internal/name_list.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/scene/tag.hpp"

namespace occ {

using namespace internal::calibrate;
namespace {

std::string list(const std::vector<std::string>& names) {
  return internal::core::name_list(names, 8);
}

double size_of(int id, const StartOptions& options) {
  const auto other = options.other_sizes_m.find(id);
  return other == options.other_sizes_m.end() ? options.tag_size_m : other->second;
}

/// Views of all images; tags are numbered by ascending id.
struct Views {
  std::vector<int> ids;
  std::vector<TagView> all;
};

/// True when a panorama that overlaps itself shows one tag several times.
bool same_position(const std::vector<const AprilTag*>& tags, const Camera& camera) {
  constexpr double max_px = 5;
  return std::isfinite(camera.period_px()) &&
         std::all_of(tags.begin(), tags.end(), [&](const AprilTag* tag) {
           return camera.difference_px(tag->centre_px, tags.front()->centre_px).norm() < max_px;
         });
}

Views collect(const std::vector<NetworkCamera>& cameras, const std::vector<TagImage>& images,
              const StartOptions& options, std::vector<std::string>& warnings) {
  Views views;
  std::map<int, int> numbers;
  for (const TagImage& image : images)
    for (const AprilTag& tag : image.tags) numbers[tag.id] = 0;
  for (auto& [id, number] : numbers) {
    number = static_cast<int>(views.ids.size());
    views.ids.push_back(id);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Camera& camera = cameras[images[i].camera].camera;
    std::map<int, std::vector<const AprilTag*>> by_id;
    for (const AprilTag& tag : images[i].tags) by_id[tag.id].push_back(&tag);
    for (const auto& [id, tags] : by_id) {
      const std::string name = "tag " + std::to_string(id) + " in " + images[i].name;
      if (tags.size() > 1 && !same_position(tags, camera)) {
        warnings.push_back(name + " left out: its id occurs " + std::to_string(tags.size()) +
                           " times");
        continue;
      }
      for (const AprilTag* tag : tags) {
        TagView view;
        view.image = static_cast<int>(i);
        view.tag = numbers[id];
        view.px.resize(2, 4);
        double variance = 0;
        for (int k = 0; k < 4; ++k) {
          view.px.col(k) = tag->corners_px[k];
          variance += tag->covariance_px2[k].trace() / 8;
        }
        view.sigma_px = std::sqrt(variance);
        view.hypotheses = tag_pose_hypotheses(*tag, size_of(id, options), camera);
        if (view.hypotheses.empty())
          warnings.push_back(name + " left out: outside the camera's domain");
        else
          views.all.push_back(std::move(view));
      }
    }
  }
  return views;
}

/// Blocks of images that are connected by common tags, largest block first.
std::vector<std::vector<int>> blocks_of(const Views& views, std::size_t images) {
  std::vector<int> root(images + views.ids.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (const TagView& view : views.all)
    root[find(static_cast<int>(images) + view.tag)] = find(view.image);
  std::map<int, std::vector<int>> by_root;
  for (std::size_t i = 0; i < images; ++i)
    by_root[find(static_cast<int>(i))].push_back(static_cast<int>(i));
  std::vector<std::vector<int>> blocks;
  for (auto& [key, members] : by_root) blocks.push_back(std::move(members));
  std::stable_sort(blocks.begin(), blocks.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return blocks;
}

/// Tags whose size, estimated from the posed images, contradicts the sizes of the other tags.
std::vector<WrongSize> wrong_sizes(const TagChain& chain, const Views& views,
                                   const StartOptions& options) {
  std::vector<double> scales;
  std::map<int, BodyFit> fits;
  for (std::size_t t = 0; t < views.ids.size(); ++t) {
    const BodyFit fit = chain.scale_of(static_cast<int>(t));
    constexpr double max_sigma = 0.1;  // relative, for residuals of 1 px
    if (!(fit.scale_sigma < max_sigma)) continue;
    fits[static_cast<int>(t)] = fit;
    scales.push_back(fit.scale);
  }
  std::vector<WrongSize> wrong;
  constexpr std::size_t min_tags = 4;  // with fewer, the wrong one cannot be identified
  if (scales.size() < min_tags) return wrong;
  const double median_scale = median(scales);
  for (const auto& [tag, fit] : fits) {
    const double ratio = fit.scale / median_scale;
    if (std::abs(std::log(ratio)) > std::log1p(options.size_tolerance))
      wrong.push_back({views.ids[tag], ratio * size_of(views.ids[tag], options)});
  }
  return wrong;
}

void add_observations(const AprilTag& tag, int image, int body, Network& network) {
  for (int k = 0; k < 4; ++k) {
    ImageObservation observation;
    observation.image = image;
    observation.target = Target::of_corner(body, k);
    observation.pixel = tag.corners_px[k];
    observation.sigma_px = tag.covariance_px2[k].diagonal().cwiseSqrt();
    network.observations.push_back(observation);
  }
}

Network network_of(const TagChain& chain, const Views& views,
                   const std::vector<NetworkCamera>& cameras, const std::vector<TagImage>& images,
                   const StartOptions& options, NetworkStart& start) {
  Network network;
  network.cameras = cameras;
  std::map<int, int> image_at, body_at;  // by image, by id
  for (std::size_t i = 0; i < images.size(); ++i)
    if (const auto& pose = chain.cams_from_world()[i])
      image_at[static_cast<int>(i)] = network.add_image(images[i].name, images[i].camera, *pose);
  std::set<int> free(options.free_sizes.begin(), options.free_sizes.end());
  for (const WrongSize& wrong : start.wrong_sizes) free.insert(wrong.tag);
  std::vector<std::string> observed_once;
  for (std::size_t t = 0; t < views.ids.size(); ++t) {
    const TagPlacement& placement = chain.placements()[t];
    const int id = views.ids[t];
    if (!placement.world_from_tag) continue;
    if (placement.views < 2) {
      observed_once.push_back(std::to_string(id));
      continue;
    }
    NetworkBody body;
    body.name = "tag " + std::to_string(id);
    body.corners_m = tag_corners(size_of(id, options));
    body.world_from_body = *placement.world_from_tag;
    body.scale_free = free.count(id) > 0;
    for (const WrongSize& wrong : start.wrong_sizes)
      if (wrong.tag == id) body.scale = wrong.size_m / size_of(id, options);
    body_at[id] = static_cast<int>(network.bodies.size());
    network.bodies.push_back(std::move(body));
  }
  if (!observed_once.empty())
    start.warnings.push_back("tags that only one image observes are left out: " +
                             list(observed_once));
  for (const TagView& view : views.all) {
    const auto image = image_at.find(view.image);
    const auto body = body_at.find(views.ids[view.tag]);
    if (image == image_at.end() || body == body_at.end()) continue;
    for (const AprilTag& tag : images[view.image].tags)
      if (tag.id == body->first && tag.corners_px[0] == Eigen::Vector2d(view.px.col(0)))
        add_observations(tag, image->second, body->second, network);
  }
  return network;
}

std::vector<std::string> names_of(const std::vector<int>& block,
                                  const std::vector<TagImage>& images) {
  std::vector<std::string> names;
  for (const int i : block) names.push_back(images[i].name);
  return names;
}

}  // namespace

void StartOptions::validate() const {
  require(tag_size_m > 0 && std::isfinite(tag_size_m), "tag_size_m", tag_size_m, "positive");
  for (const auto& [id, size] : other_sizes_m)
    require(size > 0 && std::isfinite(size), "other_sizes_m[" + std::to_string(id) + "]", size,
            "positive");
  require(size_tolerance > 0 && std::isfinite(size_tolerance), "size_tolerance", size_tolerance,
          "positive");
}

Result<NetworkStart> start_network(const std::vector<NetworkCamera>& cameras,
                                   const std::vector<TagImage>& images,
                                   const StartOptions& options) {
  options.validate();
  for (const TagImage& image : images)
    require(image.camera >= 0 && image.camera < static_cast<int>(cameras.size()),
            "image " + image.name + ": camera", image.camera, "an index of a camera");
  Result<NetworkStart> result;
  NetworkStart& start = result.value;
  const Views views = collect(cameras, images, options, start.warnings);
  const std::vector<std::vector<int>> blocks = blocks_of(views, images.size());
  for (const std::vector<int>& block : blocks) start.blocks.push_back(names_of(block, images));
  std::vector<Eigen::Matrix3Xd> corners;
  for (const int id : views.ids) corners.push_back(tag_corners(size_of(id, options)));
  std::vector<const Camera*> image_cameras;
  for (const TagImage& image : images) image_cameras.push_back(&cameras[image.camera].camera);
  TagChain chain(corners, image_cameras, views.all);
  if (images.size() < 2 || blocks.front().size() < 2 || !chain.connect(blocks.front())) {
    result.status = Status::too_few_lamps;
    result.message = images.size() < 2
                         ? "two images are required, got " + std::to_string(images.size())
                         : "no two images share a tag";
    return result;
  }
  constexpr int refinements = 2;
  for (int i = 0; i < refinements; ++i) chain.refine_all();
  start.wrong_sizes = wrong_sizes(chain, views, options);
  for (const WrongSize& wrong : start.wrong_sizes) {
    std::ostringstream text;
    text << "tag " << wrong.tag << ": a side of " << size_of(wrong.tag, options)
         << " m was given, but it is " << wrong.size_m
         << " m relative to the other tags; its size is free";
    start.warnings.push_back(text.str());
  }
  start.network = network_of(chain, views, cameras, images, options, start);
  std::vector<std::string> without_pose;
  for (const int i : blocks.front())
    if (!chain.cams_from_world()[i]) without_pose.push_back(images[i].name);
  if (!without_pose.empty()) {
    result.status = Status::degenerate;
    result.message = "no pose was found for " + list(without_pose);
  }
  if (blocks.size() > 1) {
    result.status = Status::degenerate;
    result.message =
        "the images form " + std::to_string(blocks.size()) + " blocks that share no tag:";
    for (std::size_t b = 0; b < blocks.size(); ++b)
      result.message += (b == 0 ? " " : "; ") + list(start.blocks[b]);
  }
  return result;
}

}  // namespace occ
