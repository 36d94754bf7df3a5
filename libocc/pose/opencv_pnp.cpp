// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/opencv_pnp.hpp"

#include <Eigen/Core>
#include <opencv2/calib3d.hpp>

#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/frames.hpp"

namespace occ::internal::pose {

void add_opencv_poses(const PoseProblem& problem, int method, std::vector<Rigid3>& candidates) {
  const std::optional<PinholeFrame> frame = pinhole_frame(problem);
  if (!frame || !problem.points.allFinite()) return;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> image;
  // OpenCV's rotation vectors have the wrong sign at 180 degrees, a likely angle between a camera
  // and a room. Therefore the world is rotated by `generic_rotation`.
  const Rigid3 turned_from_world{generic_rotation(), Eigen::Vector3d::Zero()};
  for (Eigen::Index i = 0; i < problem.points.cols(); ++i) {
    const Eigen::Vector3d point = turned_from_world * problem.points.col(i);
    points.emplace_back(point.x(), point.y(), point.z());
    image.emplace_back(frame->image(0, i), frame->image(1, i));
  }
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solvePnPGeneric(points, image, cv::Matx33d::eye(), cv::noArray(), rotations, translations,
                        false, static_cast<cv::SolvePnPMethod>(method));
  } catch (const cv::Exception&) {  // thrown for layouts that the method does not accept
    return;
  }
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    const cv::Vec3d r = rotations[k], t = translations[k];
    const Rigid3 pose{so3_exp({r[0], r[1], r[2]}), {t[0], t[1], t[2]}};
    candidates.push_back(frame->cam_from_world(pose * turned_from_world));
  }
}

}  // namespace occ::internal::pose
