// SPDX-License-Identifier: Apache-2.0
// Conversion of images, transforms, priors and rims between C++ and numpy. Pixels are not copied; a
// transform is a 4x4 matrix.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/per_axis.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/radiometry/emission_profile.hpp"
#include "libocc/scene/prior.hpp"

namespace occ::python {

namespace py = pybind11;

/// A view of a numpy array's pixels, and the array that keeps them alive.
struct NumpyImage {
  ImageView view;
  py::object owner;
};

/// View of an array's pixels. Copies them only when the pixels of a row are not adjacent. Throws
/// TypeError or ValueError that states the accepted and the given type and shape.
NumpyImage numpy_image(py::handle object);

/// A numpy array of pixels; its type appears in the signatures.
class PixelArray : public py::array {
 public:
  explicit PixelArray(py::array array) : py::array(std::move(array)) {}
  using py::array::array;
};

/// Moves the image's pixels to a new array: (H, W), or (H, W, C) with colour.
PixelArray to_numpy(Image&& image);

/// Points as the rows of a matrix.
Eigen::MatrixX2d rows_of(const std::vector<Eigen::Vector2d>& points);

/// An image, or the blobs detected in one.
struct ImageOrBlobs {
  std::optional<NumpyImage> image;
  std::vector<Blob> blobs;
};

/// Profile of a file. Throws FileNotFoundError, OSError or ValueError as read_photometry() does.
std::shared_ptr<const EmissionProfile> profile_of_file(const std::filesystem::path& path);

/// Returns true if the object is a list or tuple of Blobs.
bool is_blob_sequence(py::handle object);

}  // namespace occ::python

namespace pybind11::detail {

inline constexpr auto pixels_name = const_name("numpy.typing.NDArray[numpy.uint8 | numpy.uint16]");

template <>
struct handle_type_name<occ::python::PixelArray> {
  static constexpr auto name = pixels_name;
};

template <>
struct type_caster<occ::python::NumpyImage> {
  PYBIND11_TYPE_CASTER(occ::python::NumpyImage, pixels_name);
  bool load(handle source, bool) {
    value = occ::python::numpy_image(source);
    return true;
  }
};

template <>
struct type_caster<occ::python::ImageOrBlobs> {
  PYBIND11_TYPE_CASTER(occ::python::ImageOrBlobs,
                       pixels_name + const_name(" | ") + make_caster<std::vector<occ::Blob>>::name);
  bool load(handle source, bool) {
    if (occ::python::is_blob_sequence(source)) {
      value.blobs = pybind11::cast<std::vector<occ::Blob>>(source);
    } else {
      value.image = occ::python::numpy_image(source);
    }
    return true;
  }
};

template <>
struct type_caster<occ::Rigid3> {
  PYBIND11_TYPE_CASTER(occ::Rigid3, make_caster<Eigen::Matrix4d>::name);
  bool load(handle source, bool) {
    make_caster<Eigen::Matrix4d> matrix;
    if (!matrix.load(source, true))
      throw type_error("a transform must be a 4x4 matrix of numbers, got " +
                       pybind11::cast<std::string>(repr(source)));
    value = occ::Rigid3::from_matrix(cast_op<Eigen::Matrix4d&>(matrix));
    return true;
  }
  static handle cast(const occ::Rigid3& transform, return_value_policy, handle) {
    return pybind11::cast(Eigen::Matrix4d(transform.matrix())).release();
  }
};

template <>
struct type_caster<occ::PerAxis> {
  PYBIND11_TYPE_CASTER(occ::PerAxis, const_name("float | ") + make_caster<Eigen::Vector3d>::name);
  bool load(handle source, bool convert) {
    make_caster<double> number;
    if (number.load(source, convert)) {
      value = occ::PerAxis(cast_op<double>(number));
      return true;
    }
    make_caster<Eigen::Vector3d> vector;
    if (!vector.load(source, convert)) return false;
    value = cast_op<Eigen::Vector3d&>(vector);
    return true;
  }
  static handle cast(const occ::PerAxis& values, return_value_policy, handle) {
    return pybind11::cast(Eigen::Vector3d(values)).release();
  }
};

/// An EmissionProfile, or a distribution or file from which one is made.
template <>
struct type_caster<std::shared_ptr<const occ::EmissionProfile>> {
  PYBIND11_TYPE_CASTER(
      std::shared_ptr<const occ::EmissionProfile>,
      io_name("libocc._core.EmissionProfile | "
              "libocc._core.PhotometricDistribution | os.PathLike[str] | str | None",
              "libocc._core.EmissionProfile | None"));
  bool load(handle source, bool) {
    if (source.is_none()) return true;
    if (isinstance<occ::EmissionProfile>(source)) {
      value = pybind11::cast<std::shared_ptr<occ::EmissionProfile>>(source);
      return true;
    }
    if (isinstance<occ::PhotometricDistribution>(source)) {
      value = std::make_shared<const occ::EmissionProfile>(
          pybind11::cast<const occ::PhotometricDistribution&>(source));
      return true;
    }
    make_caster<std::filesystem::path> path;
    if (!path.load(source, true)) return false;
    value = occ::python::profile_of_file(cast_op<std::filesystem::path&>(path));
    return true;
  }
  static handle cast(const std::shared_ptr<const occ::EmissionProfile>& profile,
                     return_value_policy, handle) {
    if (!profile) return none().release();
    return pybind11::cast(std::const_pointer_cast<occ::EmissionProfile>(profile)).release();
  }
};

template <>
struct type_caster<occ::PriorPose> {
  using Pair = std::pair<occ::Rigid3, occ::Matrix6>;
  PYBIND11_TYPE_CASTER(occ::PriorPose, make_caster<Pair>::name);
  bool load(handle source, bool convert) {
    make_caster<Pair> pair;
    if (!pair.load(source, convert)) return false;
    const Pair loaded = cast_op<Pair>(pair);
    value = {loaded.first, loaded.second};
    return true;
  }
  static handle cast(const occ::PriorPose& pose, return_value_policy, handle) {
    return pybind11::cast(Pair(pose.cam_from_world, pose.covariance)).release();
  }
};

template <>
struct type_caster<std::vector<occ::RimPoint>> {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 5, Eigen::RowMajor>;
  PYBIND11_TYPE_CASTER(std::vector<occ::RimPoint>, make_caster<Rows>::name);
  bool load(handle source, bool convert) {
    make_caster<Rows> rows;
    if (!rows.load(source, convert)) return false;
    const Rows& r = cast_op<Rows&>(rows);
    value.clear();
    for (Eigen::Index i = 0; i < r.rows(); ++i)
      value.push_back({{r(i, 0), r(i, 1)}, {r(i, 2), r(i, 3)}, r(i, 4)});
    return true;
  }
  static handle cast(const std::vector<occ::RimPoint>& rim, return_value_policy, handle) {
    Rows rows(static_cast<Eigen::Index>(rim.size()), 5);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const occ::RimPoint& point = rim[i];
      rows.row(i) << point.px.transpose(), point.normal.transpose(), point.sigma_px;
    }
    return pybind11::cast(rows).release();
  }
};

}  // namespace pybind11::detail
