// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/observation_rows.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

struct Places {
  const NetworkImage& image;
  const Camera& camera;
  const Rigid3& station;
  const Rigid3* mount;  ///< null: the station is the camera

  Places(const Network& network, const NetworkState& state, const ImageObservation& seen)
      : image(network.images[seen.image]),
        camera(state.cameras[image.camera]),
        station(state.stations[image.station]),
        mount(image.mount < 0 ? nullptr : &state.mounts[image.mount]) {}
};

/// How the pixel moves when a point at `x` turns and shifts.
void put_pose(const Eigen::RowVector3d& gradient, const Vector3d& x, double* columns) {
  const Vector3d turn = x.cross(gradient.transpose());
  for (int k = 0; k < 3; ++k) {
    columns[k] = turn[k];
    columns[3 + k] = gradient[k];
  }
}

/// Seen across the seam, or on a second turn, a place lies whole periods from where the camera's
/// columns begin, and a period is 2 pi over the angle per column: the first parameter of a camera
/// that has one.
void add_turns(const Camera& camera, double turns, Camera::ParameterJacobian& d_parameters) {
  constexpr double two_pi = 6.283185307179586;
  const double period = camera.period_px();
  if (turns != 0) d_parameters(0, 0) += turns * period * period / two_pi;
}

}  // namespace

bool residual_of(const Network& network, const NetworkState& state, const ImageObservation& seen,
                 double r[2]) {
  const Places places(network, state, seen);
  Vector3d x = places.station * target_position(network, state, seen.target);
  if (places.mount) x = *places.mount * x;
  const auto pixel = places.camera.project(x);
  if (!pixel || !pixel->allFinite()) return false;
  const Eigen::Vector2d off = places.camera.difference_px(*pixel, seen.pixel);
  for (int k = 0; k < 2; ++k) r[k] = off[k] / seen.sigma_px[k];
  return true;
}

bool rows_of(const Network& network, const NetworkLayout& layout, const NetworkState& state,
             const ImageObservation& seen, ObservationRows& rows) {
  const Places places(network, state, seen);
  const ImageBlock& block = layout.images[seen.image];
  const CameraBlock& camera = layout.cameras[places.image.camera];
  const Vector3d x_in_world = target_position(network, state, seen.target);
  const Vector3d x_in_station = places.station * x_in_world;
  const Vector3d x_in_cam = places.mount ? *places.mount * x_in_station : x_in_station;

  Eigen::Matrix<double, 2, 3> d_point;
  Camera::ParameterJacobian d_parameters;
  const auto pixel =
      places.camera.project(x_in_cam, &d_point, camera.offset == none ? nullptr : &d_parameters);
  if (!pixel || !pixel->allFinite()) return false;
  const Eigen::Vector2d off = places.camera.difference_px(*pixel, seen.pixel);

  const double turns =
      std::round((pixel->x() - seen.pixel.x() - off.x()) / places.camera.period_px());
  if (camera.offset != none) add_turns(places.camera, turns, d_parameters);

  rows.width = block.width;
  rows.size = layout.offset_of(seen.target) == none ? 0 : layout.size_of(seen.target);
  for (int k = 0; k < 2; ++k) {
    const double inverse_sigma = 1 / seen.sigma_px[k];
    rows.r[k] = off[k] * inverse_sigma;
    if (camera.offset != none)
      for (std::size_t c = 0; c < camera.columns.size(); ++c)
        rows.a[k][c] = d_parameters(k, camera.columns[c]) * inverse_sigma;
    const Eigen::RowVector3d by_cam = inverse_sigma * d_point.row(k);
    if (block.mount_column >= 0) put_pose(by_cam, x_in_cam, rows.a[k] + block.mount_column);
    Eigen::RowVector3d by_station = by_cam;
    if (places.mount) by_station = by_cam * places.mount->rotation;
    if (block.station_column >= 0)
      put_pose(by_station, x_in_station, rows.a[k] + block.station_column);
    if (rows.size == 0) continue;
    const Eigen::RowVector3d by_world = by_station * places.station.rotation;
    if (seen.target.body < 0) {
      for (int c = 0; c < 3; ++c) rows.b[k][c] = by_world[c];
      continue;
    }
    const Vector3d arm = x_in_world - state.bodies[seen.target.body].translation;
    put_pose(by_world, arm, rows.b[k]);
    if (rows.size == 7) rows.b[k][6] = by_world.dot(arm);
  }
  return true;
}

}  // namespace occ::internal::network
