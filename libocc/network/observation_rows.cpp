// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/observation_rows.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace occ::internal::network {

namespace {

using Eigen::Vector3d;

/// The image of an observation with its camera, station and mount.
struct ObservationGeometry {
  const NetworkImage& image;
  const Camera& camera;
  const Rigid3& station;
  const Rigid3* mount;  ///< null: the station is the camera

  ObservationGeometry(const Network& network, const NetworkState& state,
                      const ImageObservation& observation)
      : image(network.images[observation.image]),
        camera(state.cameras[image.camera]),
        station(state.stations[image.station]),
        mount(image.mount < 0 ? nullptr : &state.mounts[image.mount]) {}
};

/// Derivative of a pixel coordinate with respect to the left perturbation [rotation, translation]
/// of a point at `x`; `gradient`: derivative with respect to the point.
void write_pose_derivative(const Eigen::RowVector3d& gradient, const Vector3d& x, double* columns) {
  const Vector3d by_rotation = x.cross(gradient.transpose());
  for (int k = 0; k < 3; ++k) {
    columns[k] = by_rotation[k];
    columns[3 + k] = gradient[k];
  }
}

/// Adds the derivative of whole periods to the column's derivative. A point observed across the
/// seam of a panorama, or in a second revolution, has a column that differs by n periods. One
/// period is 2 pi / (angle per column), and the angle per column is the first parameter of such
/// cameras.
void add_period_derivative(const Camera& camera, double periods,
                           Camera::ParameterJacobian& d_parameters) {
  constexpr double two_pi = 6.283185307179586;
  const double period = camera.period_px();
  if (periods != 0) d_parameters(0, 0) += periods * period * period / two_pi;
}

}  // namespace

bool residual_of(const Network& network, const NetworkState& state,
                 const ImageObservation& observation, double r[2]) {
  const ObservationGeometry geometry(network, state, observation);
  Vector3d x = geometry.station * target_position(network, state, observation.target);
  if (geometry.mount) x = *geometry.mount * x;
  const auto pixel = geometry.camera.project(x);
  if (!pixel || !pixel->allFinite()) return false;
  const Eigen::Vector2d residual = geometry.camera.difference_px(*pixel, observation.pixel);
  for (int k = 0; k < 2; ++k) r[k] = residual[k] / observation.sigma_px[k];
  return true;
}

bool rows_of(const Network& network, const NetworkLayout& layout, const NetworkState& state,
             const ImageObservation& observation, ObservationRows& rows) {
  const ObservationGeometry geometry(network, state, observation);
  const ImageBlock& block = layout.images[observation.image];
  const CameraBlock& camera = layout.cameras[geometry.image.camera];
  const Vector3d x_in_world = target_position(network, state, observation.target);
  const Vector3d x_in_station = geometry.station * x_in_world;
  const Vector3d x_in_cam = geometry.mount ? *geometry.mount * x_in_station : x_in_station;

  Eigen::Matrix<double, 2, 3> d_point;
  Camera::ParameterJacobian d_parameters;
  const auto pixel =
      geometry.camera.project(x_in_cam, &d_point, camera.columns.empty() ? nullptr : &d_parameters);
  if (!pixel || !pixel->allFinite()) return false;
  const Eigen::Vector2d residual = geometry.camera.difference_px(*pixel, observation.pixel);

  const double periods =
      std::round((pixel->x() - observation.pixel.x() - residual.x()) / geometry.camera.period_px());
  if (!camera.columns.empty()) add_period_derivative(geometry.camera, periods, d_parameters);

  const double aspect_ratio = geometry.camera.fy_px() / geometry.camera.fx_px();
  rows.width = block.width;
  rows.size = layout.offset_of(observation.target) == none ? 0 : layout.size_of(observation.target);
  for (int k = 0; k < 2; ++k) {
    const double inverse_sigma = 1 / observation.sigma_px[k];
    rows.r[k] = residual[k] * inverse_sigma;
    if (camera.has_growth) rows.a[k][camera.size() - 1] = 0;
    if (!camera.columns.empty())
      for (std::size_t c = 0; c < camera.columns.size(); ++c) {
        const auto [column, tied] = camera.columns[c];
        double derivative = d_parameters(k, column);
        if (tied >= 0) derivative += d_parameters(k, tied) * aspect_ratio;
        rows.a[k][c] = derivative * inverse_sigma;
      }
    const Eigen::RowVector3d by_cam = inverse_sigma * d_point.row(k);
    if (block.mount_column >= 0)
      write_pose_derivative(by_cam, x_in_cam, rows.a[k] + block.mount_column);
    Eigen::RowVector3d by_station = by_cam;
    if (geometry.mount) by_station = by_cam * geometry.mount->rotation;
    if (block.station_column >= 0)
      write_pose_derivative(by_station, x_in_station, rows.a[k] + block.station_column);
    if (rows.size == 0) continue;
    const Eigen::RowVector3d by_world = by_station * geometry.station.rotation;
    if (observation.target.body < 0) {
      for (int c = 0; c < 3; ++c) rows.b[k][c] = by_world[c];
      std::fill(rows.b[k] + 3, rows.b[k] + rows.size, 0.0);  // its outline
      continue;
    }
    const Vector3d lever_arm = x_in_world - state.bodies[observation.target.body].translation;
    write_pose_derivative(by_world, lever_arm, rows.b[k]);
    if (rows.size == 7) rows.b[k][6] = by_world.dot(lever_arm);
  }
  return true;
}

}  // namespace occ::internal::network
