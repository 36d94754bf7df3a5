// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/network_layout.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "libocc/camera/internal/parameter_values.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::network {

namespace {

constexpr Index batch_columns = 192;  // large enough for the matrix product to run at full speed

/// Used observations of each point and each body.
struct TargetObservations {
  std::vector<std::vector<int>> of_point, of_body;

  explicit TargetObservations(const Network& network)
      : of_point(network.points.size()), of_body(network.bodies.size()) {
    for (std::size_t i = 0; i < network.observations.size(); ++i) {
      const ImageObservation& observation = network.observations[i];
      if (!observation.used) continue;
      (observation.target.body < 0 ? of_point[observation.target.point]
                                   : of_body[observation.target.body])
          .push_back(static_cast<int>(i));
    }
  }
};

/// Number of different images of some observations; counting stops at three.
std::size_t count_images(const Network& network, const std::vector<int>& observations) {
  std::vector<int> images;
  for (const int i : observations) {
    const int image = network.observations[i].image;
    if (std::find(images.begin(), images.end(), image) == images.end()) images.push_back(image);
    if (images.size() == 3) break;
  }
  return images.size();
}

/// Three corners determine a body of known size; four corners in two images one of unknown size.
bool determines_body(const Network& network, const NetworkBody& body,
                     const std::vector<int>& observations) {
  const std::size_t images = count_images(network, observations);
  const std::size_t needed = body.scale_free ? 4 : 3;
  return observations.size() >= needed && images >= (body.scale_free ? 2U : 1U);
}

void find_determined(const Network& network, const TargetObservations& observed,
                     NetworkLayout& layout) {
  std::vector<char> controlled_point(network.points.size()), controlled_body(network.bodies.size());
  for (const ControlPoint& control : network.control)
    if (control.used)
      (control.target.body < 0 ? controlled_point[control.target.point]
                               : controlled_body[control.target.body]) = 1;
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    const std::size_t images = count_images(network, observed.of_point[i]);
    layout.determined_point.push_back(network.points[i].fixed || controlled_point[i] ||
                                      images >= 2);
  }
  for (std::size_t i = 0; i < network.bodies.size(); ++i) {
    const NetworkBody& body = network.bodies[i];
    layout.determined_body.push_back(body.fixed ||
                                     determines_body(network, body, observed.of_body[i]) ||
                                     (controlled_body[i] && !observed.of_body[i].empty()));
  }
}

void assign_reduced_offsets(const Network& network, NetworkLayout& layout) {
  std::vector<char> camera_used(network.cameras.size()), mount_used(network.mounts.size()),
      station_used(network.stations.size());
  for (const ImageObservation& observation : network.observations) {
    if (!observation.used || !layout.is_determined(observation.target)) continue;
    const NetworkImage& image = network.images[observation.image];
    camera_used[image.camera] = station_used[image.station] = 1;
    if (image.mount >= 0) mount_used[image.mount] = 1;
  }
  std::vector<char> has_outlines(network.cameras.size());
  for (std::size_t i = 0; i < layout.outline_of.size(); ++i)
    if (layout.outline_of[i] >= 0)
      has_outlines[network.images[network.observations[i].image].camera] = 1;
  for (const ParameterPrior& prior : network.parameter_priors) camera_used[prior.camera] = 1;
  for (const PosePrior& prior : network.pose_priors) station_used[prior.station] = 1;

  Index offset = 0;
  for (std::size_t i = 0; i < network.cameras.size(); ++i) {
    CameraBlock block;
    const std::vector<CameraParameter> parameters = network.cameras[i].camera.parameters();
    if (camera_used[i])
      for (const std::string& name : network.cameras[i].free_parameters)
        if (const auto columns = parameter_columns(parameters, name))
          block.columns.push_back(*columns);
    block.has_growth = has_outlines[i] && network.cameras[i].outline_growth_sigma_px > 0;
    if (block.size() > 0) {
      block.offset = offset;
      offset += block.size();
    }
    layout.cameras.push_back(block);
  }
  for (std::size_t i = 0; i < network.mounts.size(); ++i) {
    const bool unknown = mount_used[i] && !network.mounts[i].fixed;
    layout.mounts.push_back(unknown ? offset : none);
    if (unknown) offset += 6;
  }
  for (std::size_t i = 0; i < network.stations.size(); ++i) {
    const bool unknown = station_used[i] && !network.stations[i].fixed;
    layout.stations.push_back(unknown ? offset : none);
    if (unknown) offset += 6;
  }
  layout.reduced = offset;
}

/// Outlines that are unknown: those of unknown points with an observation that is used.
void assign_outlines(const Network& network, NetworkLayout& layout) {
  layout.point_sizes.assign(network.points.size(), 3);
  if (network.outlines.empty()) return;
  layout.outline_of.assign(network.observations.size(), -1);
  for (std::size_t i = 0; i < network.outlines.size(); ++i) {
    const int index = network.outlines[i].observation;
    const ImageObservation& observation = network.observations[index];
    const NetworkPoint& point = network.points[observation.target.point];
    if (!observation.used || point.fixed || !layout.is_determined(observation.target)) continue;
    layout.outline_of[index] = static_cast<int>(i);
    layout.point_sizes[observation.target.point] = 3 + unknowns_of(*point.outline);
  }
}

/// Changes an outline by its unknowns.
void move_outline(const Eigen::Ref<const Eigen::VectorXd>& step, NetworkOutline& outline) {
  const int rotations = rotations_of(outline);
  outline.world_from_outline =
      so3_exp(rotation_axes(outline) * step.head(rotations)) * outline.world_from_outline;
  outline.size_m[0] *= std::exp(step[rotations]);
  outline.size_m[1] *= std::exp(step[step.size() - 1]);
}

ImageBlock image_block(const NetworkLayout& layout, const NetworkImage& image) {
  ImageBlock block;
  const auto add = [&](Index offset, int size) {
    if (offset == none) return -1;
    block.offset[block.segments] = offset;
    block.size[block.segments++] = size;
    block.width += size;
    return block.width - size;
  };
  const CameraBlock& camera = layout.cameras[image.camera];
  add(camera.offset, camera.size());
  if (image.mount >= 0) block.mount_column = add(layout.mounts[image.mount], 6);
  block.station_column = add(layout.stations[image.station], 6);
  return block;
}

/// Adds points and bodies at the ends of measured distances to the reduced unknowns.
void assign_distance_targets(const Network& network, NetworkLayout& layout) {
  const auto add = [&](const Target& target) {
    if (!layout.is_determined(target)) return;
    const bool fixed =
        target.body < 0 ? network.points[target.point].fixed : network.bodies[target.body].fixed;
    Index& offset = target.body < 0 ? layout.points[target.point] : layout.bodies[target.body];
    if (fixed || offset != none) return;
    offset = layout.reduced;
    layout.reduced += layout.size_of(target);
  };
  for (const DistanceObservation& distance : network.distances) {
    if (!distance.used || !layout.is_determined(distance.from) ||
        !layout.is_determined(distance.to))
      continue;
    add(distance.from);
    add(distance.to);
  }
}

std::vector<int> images_of(const Network& network, const Group& group) {
  std::vector<int> images;
  for (const int i : group.observations) images.push_back(network.observations[i].image);
  std::sort(images.begin(), images.end());
  images.erase(std::unique(images.begin(), images.end()), images.end());
  return images;
}

void add_groups(const Network& network, TargetObservations& observed, NetworkLayout& layout) {
  const auto add = [&](const Target& block, bool fixed, bool determined,
                       std::vector<int>& observations) {
    if (!determined) return;
    if (!fixed && layout.offset_of(block) == none)
      layout.groups.push_back({block, 0, layout.size_of(block), std::move(observations)});
    else
      layout.direct.insert(layout.direct.end(), observations.begin(), observations.end());
  };
  for (std::size_t i = 0; i < network.points.size(); ++i)
    add(Target::of_point(static_cast<int>(i)), network.points[i].fixed, layout.determined_point[i],
        observed.of_point[i]);
  for (std::size_t i = 0; i < network.bodies.size(); ++i)
    add(Target::of_corner(static_cast<int>(i), 0), network.bodies[i].fixed,
        layout.determined_body[i], observed.of_body[i]);
  std::sort(layout.direct.begin(), layout.direct.end());
}

void mark_rows(const NetworkLayout& layout, const std::vector<int>& images, std::vector<char>& rows,
               Index& count) {
  for (const int image : images) {
    const ImageBlock& block = layout.images[image];
    for (int s = 0; s < block.segments; ++s)
      for (Index k = block.offset[s]; k < block.offset[s] + block.size[s]; ++k)
        if (!rows[k]) {
          rows[k] = 1;
          ++count;
        }
  }
}

void close_batch(const std::vector<char>& rows, Index count, NetworkLayout& layout, Batch& batch) {
  if (count < layout.reduced) {
    batch.position.assign(rows.size(), none);
    for (std::size_t k = 0; k < rows.size(); ++k)
      if (rows[k]) {
        batch.position[k] = static_cast<Index>(batch.rows.size());
        batch.rows.push_back(static_cast<Index>(k));
      }
  }
  layout.batches.push_back(batch);
}

/// Sorts the groups by the images that observe them and divides them into batches. A batch ends
/// when it has batch_columns, or when all its images together have more than 1.5 times the unknowns
/// of the next group's images.
void make_batches(const Network& network, NetworkLayout& layout) {
  std::vector<std::vector<int>> images;
  for (const Group& group : layout.groups) images.push_back(images_of(network, group));
  std::vector<std::size_t> order(layout.groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return images[a] < images[b]; });
  std::vector<Group> groups;
  for (const std::size_t k : order) groups.push_back(std::move(layout.groups[k]));
  layout.groups = std::move(groups);

  const std::size_t n = static_cast<std::size_t>(layout.reduced);
  Batch batch;
  std::vector<char> rows(n, 0);
  Index count = 0;
  for (std::size_t g = 0; g < layout.groups.size(); ++g) {
    std::vector<char> images_rows(n, 0), both = rows;
    Index images_count = 0, both_count = count;
    const std::vector<int>& seen_in = images[order[g]];
    mark_rows(layout, seen_in, both, both_count);
    if (batch.columns > 0 && both_count > count)
      mark_rows(layout, seen_in, images_rows, images_count);
    const bool grows = batch.columns > 0 && both_count > count && 2 * both_count > 3 * images_count;
    if (grows || batch.columns + layout.groups[g].size > batch_columns) {
      batch.last = g;
      close_batch(rows, count, layout, batch);
      batch = {};
      batch.first = g;
      std::fill(both.begin(), both.end(), char{0});
      both_count = 0;
      mark_rows(layout, seen_in, both, both_count);
    }
    rows.swap(both);
    count = both_count;
    batch.columns += layout.groups[g].size;
  }
  if (batch.columns > 0) {
    batch.last = layout.groups.size();
    close_batch(rows, count, layout, batch);
  }
}

void assign_group_offsets(NetworkLayout& layout) {
  layout.total = layout.reduced;
  for (Group& group : layout.groups) {
    group.offset = layout.total;
    layout.total += group.size;
    (group.block.body < 0 ? layout.points[group.block.point] : layout.bodies[group.block.body]) =
        group.offset;
  }
}

}  // namespace

NetworkState::NetworkState(const Network& network) {
  for (const NetworkCamera& camera : network.cameras) {
    cameras.push_back(camera.camera);
    growths.push_back(camera.outline_growth_px);
  }
  if (!network.outlines.empty())
    for (const NetworkPoint& point : network.points)
      outlines.push_back(point.outline.value_or(NetworkOutline()));
  for (const NetworkStation& station : network.stations)
    stations.push_back(station.station_from_world);
  for (const NetworkMount& mount : network.mounts) mounts.push_back(mount.cam_from_station);
  for (const NetworkPoint& point : network.points) points.push_back(point.position_m);
  for (const NetworkBody& body : network.bodies) {
    bodies.push_back(body.world_from_body);
    scales.push_back(body.scale);
  }
}

void NetworkState::write_to(Network& network) const {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    network.cameras[i].camera = cameras[i];
    network.cameras[i].outline_growth_px = growths[i];
  }
  for (std::size_t i = 0; i < outlines.size(); ++i)
    if (network.points[i].outline) {
      network.points[i].outline = outlines[i];
      Eigen::Matrix3d& rotation = network.points[i].outline->world_from_outline;
      rotation = nearest_rotation(rotation);
    }
  for (std::size_t i = 0; i < stations.size(); ++i)
    network.stations[i].station_from_world = {nearest_rotation(stations[i].rotation),
                                              stations[i].translation};
  for (std::size_t i = 0; i < mounts.size(); ++i)
    network.mounts[i].cam_from_station = {nearest_rotation(mounts[i].rotation),
                                          mounts[i].translation};
  for (std::size_t i = 0; i < points.size(); ++i) network.points[i].position_m = points[i];
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    network.bodies[i].world_from_body = {nearest_rotation(bodies[i].rotation),
                                         bodies[i].translation};
    network.bodies[i].scale = scales[i];
  }
}

Network without_observations(const Network& network) {
  Network copy;
  copy.cameras = network.cameras;
  copy.stations = network.stations;
  copy.mounts = network.mounts;
  copy.images = network.images;
  copy.points = network.points;
  copy.bodies = network.bodies;
  return copy;
}

Eigen::Matrix3Xd rotation_axes(const NetworkOutline& outline) {
  if (!outline.is_round) return Eigen::Matrix3d::Identity();
  return outline.world_from_outline.leftCols<2>();
}

bool NetworkLayout::is_determined(const Target& target) const {
  return target.body < 0 ? determined_point[target.point] : determined_body[target.body];
}

NetworkLayout layout_of(const Network& network) {
  NetworkLayout layout;
  TargetObservations observed(network);
  find_determined(network, observed, layout);
  layout.points.assign(network.points.size(), none);
  layout.bodies.assign(network.bodies.size(), none);
  assign_outlines(network, layout);
  for (const NetworkBody& body : network.bodies)
    layout.body_sizes.push_back(body.scale_free ? 7 : 6);
  assign_reduced_offsets(network, layout);
  for (const NetworkImage& image : network.images)
    layout.images.push_back(image_block(layout, image));
  assign_distance_targets(network, layout);
  add_groups(network, observed, layout);
  make_batches(network, layout);
  assign_group_offsets(layout);
  return layout;
}

Eigen::Vector3d target_position(const Network& network, const NetworkState& state,
                                const Target& target) {
  if (target.body < 0) return state.points[target.point];
  const int body = target.body;
  return state.bodies[body] *
         Eigen::Vector3d(state.scales[body] * network.bodies[body].corners_m.col(target.corner));
}

Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_group> target_jacobian(
    const Network& network, const NetworkLayout& layout, const NetworkState& state,
    const Target& target) {
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, max_group> jacobian(
      3, layout.size_of(target));
  if (target.body < 0) {
    jacobian.setIdentity();
    return jacobian;
  }
  const Eigen::Vector3d arm =
      target_position(network, state, target) - state.bodies[target.body].translation;
  jacobian.leftCols<3>() = -skew(arm);
  jacobian.middleCols<3>(3).setIdentity();
  if (jacobian.cols() == 7) jacobian.col(6) = arm;
  return jacobian;
}

std::optional<NetworkState> apply_step(const NetworkLayout& layout, const NetworkState& state,
                                       const Eigen::VectorXd& step) {
  NetworkState next = state;
  for (std::size_t i = 0; i < next.cameras.size(); ++i) {
    const CameraBlock& block = layout.cameras[i];
    if (block.offset == none) continue;
    if (block.has_growth) next.growths[i] += step[block.offset + block.size() - 1];
    if (block.columns.empty()) continue;
    Eigen::VectorXd values = camera::parameter_values(state.cameras[i]);
    for (std::size_t k = 0; k < block.columns.size(); ++k) {
      const auto [column, tied] = block.columns[k];
      const double change = step[block.offset + static_cast<Index>(k)];
      if (tied >= 0) values[tied] *= 1 + change / values[column];
      values[column] += change;
    }
    try {
      next.cameras[i] = state.cameras[i].with_parameters(values);
    } catch (const std::invalid_argument&) {
      return std::nullopt;
    }
  }
  const auto move_poses = [&](const std::vector<Index>& offsets, std::vector<Rigid3>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (offsets[i] != none) poses[i] = perturb(poses[i], step.segment<6>(offsets[i]));
  };
  move_poses(layout.mounts, next.mounts);
  move_poses(layout.stations, next.stations);
  for (std::size_t i = 0; i < next.points.size(); ++i)
    if (layout.points[i] != none) {
      next.points[i] += step.segment<3>(layout.points[i]);
      if (layout.point_sizes[i] > 3)
        move_outline(step.segment(layout.points[i] + 3, layout.point_sizes[i] - 3),
                     next.outlines[i]);
    }
  for (std::size_t i = 0; i < next.bodies.size(); ++i) {
    const Index offset = layout.bodies[i];
    if (offset == none) continue;
    next.bodies[i].rotation = so3_exp(step.segment<3>(offset)) * next.bodies[i].rotation;
    next.bodies[i].translation += step.segment<3>(offset + 3);
    if (layout.body_sizes[i] == 7) next.scales[i] *= std::exp(step[offset + 6]);
  }
  return next;
}

}  // namespace occ::internal::network
