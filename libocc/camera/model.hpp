// SPDX-License-Identifier: Apache-2.0
// The interface of a camera model. Each model has a header of its own with equation, domain and
// source: pinhole.hpp, brown.hpp, fisheye.hpp, double_sphere.hpp, equirectangular.hpp,
// rotating_line.hpp. `Camera` (camera.hpp) holds one model of any kind and documents the functions.
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

/// Camera models; each has a header of its own.
enum class CameraKind {
  pinhole,                    ///< with or without lens distortion
  fisheye,                    ///< Kannala and Brandt
  double_sphere,              ///< Usenko, Demmel and Cremers
  rotating_line,              ///< turntable with a linear array, exact form
  rotating_line_first_order,  ///< additive approximation, for comparison
  brown_forward,              ///< Brown's distortion as a function of ideal coordinates
  brown_backward,             ///< Brown's distortion as a function of measured coordinates
  equirectangular,            ///< full panorama: columns are longitudes, rows latitudes
};

/// The enumerator's name, as in scene files.
LIBOCC_API const char* name_of(CameraKind kind);

/// One number of a camera model.
struct CameraParameter {
  std::string name;        ///< as in scene files, e.g. "fx_px", "k1"
  std::string unit;        ///< "px", "rad", "m" or "1"
  double value = 0;        ///< in the unit above
  bool is_length = false;  ///< a length in the scene, which scales with the scene
};

/// The camera matrix K as a map from the plane z = 1 to pixels.
struct CameraMatrix {
  double fx, fy, cx, cy, skew;  ///< [px]

  /// Pixel of a point on the plane z = 1.
  Eigen::Vector2d to_px(const Eigen::Vector2d& p) const {
    return {fx * p.x() + skew * p.y() + cx, fy * p.y() + cy};
  }
  /// Point on the plane z = 1 of a pixel; inverse of to_px.
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

/// Base class of all models; immutable, so that copies of a Camera share one.
class LIBOCC_API CameraModel {
 public:
  static constexpr int max_parameters = 20;           ///< upper limit of parameter_count()
  using PointJacobian = Eigen::Matrix<double, 2, 3>;  ///< d pixel / d point
  using PixelJacobian = Eigen::Matrix<double, 3, 2>;  ///< d bearing / d pixel
  /// d pixel / d parameters
  using ParameterJacobian =
      Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, max_parameters>;
  using Pointer = std::shared_ptr<const CameraModel>;  ///< shared, because models never change

  virtual ~CameraModel();

  /// Model of the derived class.
  CameraKind kind() const { return kind_; }
  /// Width of the image [px].
  int width() const { return width_; }
  /// Height of the image [px].
  int height() const { return height_; }
  /// Focal lengths, principal point and skew [px].
  const CameraMatrix& matrix() const { return matrix_; }
  /// Distortion coefficients in the model's order; may be empty.
  const std::vector<double>& distortion() const { return distortion_; }
  /// Columns after which the image repeats itself; infinite without repetition [px].
  double period_px() const { return period_px_; }

  /// All numbers of the model, with names and units.
  virtual std::vector<CameraParameter> parameters() const = 0;
  /// Size of parameters(), without building the list.
  virtual int parameter_count() const = 0;
  /// This model with other values, in the order of parameters(). Throws std::invalid_argument for
  /// values that are not allowed.
  virtual Pointer with_parameters(const Eigen::VectorXd& values) const = 0;

  /// Pixel of a point in the camera frame [m], or nothing outside the domain. Jacobians may be
  /// null.
  virtual std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point,
                                                 PointJacobian* d_point,
                                                 ParameterJacobian* d_parameters) const = 0;
  /// Unit bearing of a finite pixel, or nothing outside the domain. `jacobian` may be null.
  virtual std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                                   PixelJacobian* jacobian) const = 0;
  /// Largest angle from the optical axis inside the domain; see Camera::max_angle_rad.
  virtual double max_angle_rad() const = 0;

  // Defaults: one projection centre, and a pupil that follows the ray.
  /// True if all rays meet in the origin of the camera frame.
  virtual bool is_central() const { return true; }
  virtual Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const;  ///< start of a pixel's ray
  /// Distance along the direction of view; see Camera::depth_m. `gradient` may be null.
  virtual double depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const;

  // Variants of this model; null if the model has no distortion, seam or line.
  /// This model without the coefficients of distortion(); null if it has none.
  virtual Pointer without_distortion() const { return nullptr; }
  /// This model with another first column of its image; null if the image does not repeat.
  virtual Pointer with_seam_at(double /*column*/) const { return nullptr; }
  /// Parameters of a rotating line; null for other models.
  virtual const RotatingLine* line() const { return nullptr; }
  /// Numbers of the model that adjustments never change, with names and units; none for most
  /// models.
  virtual std::vector<CameraParameter> constants() const { return {}; }

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
