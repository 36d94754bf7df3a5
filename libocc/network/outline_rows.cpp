// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/outline_rows.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/camera/internal/parameter_values.hpp"
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

std::optional<OutlineRows> outline_rows(const Network& network, const NetworkLayout& layout,
                                        const NetworkState& state, int index,
                                        ObservationRows& centre) {
  const OutlineObservation* observed = layout.outline(network, index);
  if (observed == nullptr) return std::nullopt;
  const OutlineObservation& outline = *observed;
  const ImageObservation& observation = network.observations[index];
  const NetworkImage& image = network.images[observation.image];
  const ImageBlock& block = layout.images[observation.image];
  const CameraBlock& free = layout.cameras[image.camera];
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
  if (!free.columns.empty()) {
    const VectorXd parameters = camera::parameter_values(state.cameras[image.camera]);
    r.tail(count) += outline.by_camera * (parameters - outline.camera_parameters);
    for (std::size_t c = 0; c < free.columns.size(); ++c) {
      const auto [column, tied] = free.columns[c];
      auto own = a.col(static_cast<Index>(c)).tail(count);
      own = outline.by_camera.col(column);
      if (tied >= 0) own += parameters[tied] / parameters[column] * outline.by_camera.col(tied);
    }
  }
  if (free.has_growth) a.col(free.size() - 1) = by_u.col(7);
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
  for (int k = 0; k < 2; ++k) {
    centre.r[k] += r[k] / observation.sigma_px[k];
    for (int c = 0; c < centre.width; ++c) centre.a[k][c] += a(k, c) / observation.sigma_px[k];
    for (int c = 0; c < centre.size; ++c) centre.b[k][c] += b(k, c) / observation.sigma_px[k];
  }
  return OutlineRows{a.bottomRows(count), b.bottomRows(count), r.tail(count)};
}

}  // namespace occ::internal::network
