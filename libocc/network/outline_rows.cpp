// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/outline_rows.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Columns of a left perturbation [rotation, translation] that moves the outline with its centre at
/// `centre`; by_rotation and by_centre: derivatives by the outline's rotation and its centre.
void write_pose_columns(const MatrixXd& by_rotation, const MatrixXd& by_centre,
                        const Vector3d& centre, Eigen::Ref<MatrixXd> columns) {
  columns.leftCols<3>() = by_rotation - by_centre * skew(centre);
  columns.rightCols<3>() = by_centre;
}

}  // namespace

OutlineRows outline_rows_of(const Network& network, const NetworkLayout& layout,
                            const NetworkState& state, const OutlineObservation& outline) {
  const ImageObservation& observation = network.observations[outline.observation];
  const NetworkImage& image = network.images[observation.image];
  const ImageBlock& block = layout.images[observation.image];
  const CameraBlock& camera = layout.cameras[image.camera];
  const NetworkOutline& shape = state.outlines[observation.target.point];
  const Rigid3& station = state.stations[image.station];
  const Rigid3* mount = image.mount < 0 ? nullptr : &state.mounts[image.mount];
  const Vector3d in_station = station * state.points[observation.target.point];
  const Vector3d in_cam = mount ? *mount * in_station : in_station;
  const Matrix3d cam_from_station = mount ? mount->rotation : Matrix3d::Identity();
  const Matrix3d cam_from_world = cam_from_station * station.rotation;

  const double ratio = std::sqrt(outline.size_m.prod() / shape.size_m.prod());
  Eigen::Matrix<double, 8, 1> u;
  const Matrix3d& reference = outline.cam_from_outline.rotation;
  const Matrix3d cam_from_outline = cam_from_world * shape.world_from_outline;
  const Vector3d normal = cam_from_outline.col(2);
  const Vector3d turn =
      so3_log(shape.is_round ? shortest_rotation(reference.col(2), normal)
                             : Matrix3d(cam_from_outline * reference.transpose()));
  u.head<3>() = turn;
  u.segment<3>(3) = ratio * in_cam - outline.cam_from_outline.translation;
  u[6] = std::log(shape.size_m[0] / shape.size_m[1] * outline.size_m[1] / outline.size_m[0]);
  u[7] = state.growths[image.camera];

  const Index count = outline.rows.rows();
  MatrixXd by_u(2 + count, 8);  // the displacement of the centre, then the outline
  by_u << outline.centre_rows, outline.rows;
  VectorXd r = by_u * u;
  r.tail(count) += outline.constant;
  Matrix3d turn_by_rotation = so3_left_jacobian(turn).inverse();
  if (shape.is_round) {  // a rotation about the normal is added that keeps the turn the smallest
    const Eigen::RowVector3d spin = reference.col(2).transpose() * turn_by_rotation;
    turn_by_rotation *= Matrix3d::Identity() - normal * spin / spin.dot(normal);
  }
  const MatrixXd by_rotation = by_u.leftCols<3>() * turn_by_rotation;
  const MatrixXd by_centre = ratio * by_u.middleCols<3>(3);
  MatrixXd a = MatrixXd::Zero(2 + count, block.width);
  if (!camera.columns.empty()) {
    const std::vector<CameraParameter> parameters = state.cameras[image.camera].parameters();
    VectorXd change = -outline.camera_parameters;
    for (std::size_t k = 0; k < parameters.size(); ++k)
      change[static_cast<Index>(k)] += parameters[k].value;
    r.tail(count) += outline.by_camera * change;
    for (std::size_t c = 0; c < camera.columns.size(); ++c) {
      const auto [column, tied] = camera.columns[c];
      auto own = a.col(static_cast<Index>(c)).tail(count);
      own = outline.by_camera.col(column);
      if (tied >= 0)
        own += parameters[tied].value / parameters[column].value * outline.by_camera.col(tied);
    }
  }
  if (camera.has_growth) a.col(camera.size() - 1) = by_u.col(7);
  if (block.mount_column >= 0)
    write_pose_columns(by_rotation, by_centre, in_cam, a.middleCols<6>(block.mount_column));
  if (block.station_column >= 0)
    write_pose_columns(by_rotation * cam_from_station, by_centre * cam_from_station, in_station,
                       a.middleCols<6>(block.station_column));

  const int rotations = rotations_of(shape);
  MatrixXd b(2 + count, 3 + unknowns_of(shape));
  b.leftCols<3>() = by_centre * cam_from_world;
  b.middleCols(3, rotations) = by_rotation * cam_from_world * rotation_axes(shape);
  const VectorXd by_size = -by_centre * in_cam;  // logarithm of both sizes
  if (shape.is_round) {
    b.rightCols<1>() = by_size;
  } else {
    b.col(3 + rotations) = 0.5 * by_size + by_u.col(6);
    b.rightCols<1>() = 0.5 * by_size - by_u.col(6);
  }
  return {a.bottomRows(count), b.bottomRows(count), r.tail(count),
          a.topRows(2),        b.topRows(2),        r.head<2>()};
}

void OutlineRows::displace_centre(const Eigen::Vector2d& sigma_px, ObservationRows& rows) const {
  for (int k = 0; k < 2; ++k) {
    rows.r[k] += centre_r[k] / sigma_px[k];
    for (int c = 0; c < rows.width; ++c) rows.a[k][c] += centre_a(k, c) / sigma_px[k];
    for (int c = 0; c < rows.size; ++c) rows.b[k][c] += centre_b(k, c) / sigma_px[k];
  }
}

}  // namespace occ::internal::network
