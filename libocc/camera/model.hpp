// SPDX-License-Identifier: Apache-2.0
// The interface of a camera model. Each model has a header of its own with equation, domain and
// source: pinhole.hpp, fisheye.hpp, double_sphere.hpp, rotating_line.hpp. `Camera` (camera.hpp)
// holds one model of any kind and documents the functions.
//
// A new model needs: an enumerator of CameraKind and its name (model.cpp); a class derived from
// CameraModel with the functions that are pure virtual here; a factory in Camera; its keys in
// scene/camera_reader.cpp, camera_writer.cpp and cli/room_file.py; its factory, enumerator, repr
// and pickling in python/src/camera.cpp; a row in the table of camera_models_test.cpp, which
// checks derivatives and inverses; and, to calibrate it, an entry in calibrate_camera.py and
// cli/calibration/run.py.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

struct RotatingLine;

enum class CameraKind { pinhole, fisheye, double_sphere, rotating_line, rotating_line_first_order };

LIBOCC_API const char* name_of(CameraKind kind);

/// One number of a camera model.
struct CameraParameter {
  std::string name;
  std::string unit;  ///< "px", "rad", "m" or "1"
  double value = 0;
  bool is_length = false;  ///< a length in the scene, which scales with the scene
};

/// The camera matrix K as a map from the plane z = 1 to pixels.
struct CameraMatrix {
  double fx, fy, cx, cy, skew;  ///< [px]

  Eigen::Vector2d to_px(const Eigen::Vector2d& p) const {
    return {fx * p.x() + skew * p.y() + cx, fy * p.y() + cy};
  }
  Eigen::Vector2d from_px(const Eigen::Vector2d& px) const {
    const double y = (px.y() - cy) / fy;
    return {(px.x() - cx - skew * y) / fx, y};
  }
  Eigen::Matrix2d d_px() const {  ///< d to_px / d point
    Eigen::Matrix2d d;
    d << fx, skew, 0, fy;
    return d;
  }
  Eigen::Matrix2d d_plane() const {  ///< d from_px / d pixel
    Eigen::Matrix2d d;
    d << 1 / fx, -skew / (fx * fy), 0, 1 / fy;
    return d;
  }
};

class LIBOCC_API CameraModel {
 public:
  static constexpr int max_parameters = 20;
  using PointJacobian = Eigen::Matrix<double, 2, 3>;  ///< d pixel / d point
  using PixelJacobian = Eigen::Matrix<double, 3, 2>;  ///< d bearing / d pixel
  using ParameterJacobian =                           ///< d pixel / d parameters
      Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, max_parameters>;
  using Pointer = std::shared_ptr<const CameraModel>;

  virtual ~CameraModel();

  CameraKind kind() const { return kind_; }
  int width() const { return width_; }
  int height() const { return height_; }
  const CameraMatrix& matrix() const { return matrix_; }
  const std::vector<double>& distortion() const { return distortion_; }
  double period_px() const { return period_px_; }

  virtual std::vector<CameraParameter> parameters() const = 0;
  virtual int parameter_count() const = 0;
  virtual Pointer with_parameters(const Eigen::VectorXd& values) const = 0;

  /// Pixel of a point in the camera frame [m], or nothing outside the domain. Jacobians may be
  /// null.
  virtual std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point,
                                                 PointJacobian* d_point,
                                                 ParameterJacobian* d_parameters) const = 0;
  /// Unit bearing of a finite pixel, or nothing outside the domain. `jacobian` may be null.
  virtual std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                                   PixelJacobian* jacobian) const = 0;
  virtual double max_angle_rad() const = 0;

  // Defaults: one projection centre, and a pupil that follows the ray.
  virtual bool is_central() const { return true; }
  virtual Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const;  ///< start of a pixel's ray
  virtual double depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const;

  // Variants of this model; null if the model has no distortion, seam or line.
  virtual Pointer without_distortion() const { return nullptr; }
  virtual Pointer with_seam_at(double /*column*/) const { return nullptr; }
  virtual const RotatingLine* line() const { return nullptr; }

 protected:
  CameraModel(CameraKind kind, int width, int height, const CameraMatrix& matrix,
              std::vector<double> distortion = {});
  /// Throws std::invalid_argument for a size or matrix that is not allowed; see Camera's factories.
  void require_size_and_matrix() const;

  CameraKind kind_;
  int width_, height_;
  CameraMatrix matrix_;
  std::vector<double> distortion_;
  double period_px_ = std::numeric_limits<double>::infinity();
};

}  // namespace occ
