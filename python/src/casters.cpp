// SPDX-License-Identifier: Apache-2.0
#include "casters.hpp"

#include <algorithm>
#include <memory>

#include "module.hpp"

namespace occ::python {
namespace {

std::string got(const py::array& array) {
  return "got " + py::cast<std::string>(py::str(array.dtype())) + " of shape " +
         py::cast<std::string>(py::str(array.attr("shape")));
}

bool rows_are_packed(const py::array& array, int channels) {
  const py::ssize_t item = array.itemsize();
  if (array.ndim() == 3 && array.strides(2) != item) return false;
  const py::ssize_t pixel = item * channels;
  return array.strides(1) == pixel && array.strides(0) >= pixel * array.shape(1);
}

template <class T>
py::array array_over(std::vector<T>&& pixels, const std::vector<py::ssize_t>& shape) {
  auto owned = std::make_unique<std::vector<T>>(std::move(pixels));
  const T* data = owned->data();
  py::capsule keeper(owned.get(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  owned.release();
  return py::array_t<T>(shape, data, keeper);
}

}  // namespace

NumpyImage numpy_image(py::handle object) {
  const std::string wanted =
      "image must be a numpy array of uint8 or uint16 with shape (height, width), (height, width, "
      "3) or (height, width, 4), ";
  if (!py::isinstance<py::array>(object))
    throw py::type_error(wanted + "got " +
                         py::cast<std::string>(py::str(py::type::of(object).attr("__name__"))));
  auto array = py::reinterpret_borrow<py::array>(object);
  const bool is_u8 = array.dtype().equal(py::dtype::of<std::uint8_t>());
  const bool is_u16 = array.dtype().equal(py::dtype::of<std::uint16_t>());
  if (!is_u8 && !is_u16) throw py::type_error(wanted + got(array));
  const auto ndim = array.ndim();
  const int channels = ndim == 3 ? static_cast<int>(std::min<py::ssize_t>(array.shape(2), 5)) : 1;
  const bool shaped = (ndim == 2 || ndim == 3) && array.size() > 0 &&
                      (channels == 1 || channels == 3 || channels == 4);
  if (!shaped) throw py::value_error(wanted + got(array));
  if (array.shape(0) > 1'000'000 || array.shape(1) > 1'000'000)
    throw py::value_error("image must have at most 1000000 rows and columns, " + got(array));
  constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;  // of 16-bit values
  if (!rows_are_packed(array, channels) || (array.flags() & aligned) == 0)
    array = py::array::ensure(array, py::array::c_style | aligned);

  NumpyImage image;
  image.view.data = array.data();
  image.view.height = static_cast<int>(array.shape(0));
  image.view.width = static_cast<int>(array.shape(1));
  image.view.channels = channels;
  image.view.type = is_u8 ? PixelType::u8 : PixelType::u16;
  image.view.row_bytes = static_cast<std::size_t>(array.strides(0));
  image.owner = std::move(array);
  return image;
}

PixelArray to_numpy(Image&& image) {
  std::vector<py::ssize_t> shape{image.height, image.width};
  if (image.channels > 1) shape.push_back(image.channels);
  return PixelArray(image.type == PixelType::u8 ? array_over(std::move(image.u8), shape)
                                                : array_over(std::move(image.u16), shape));
}

Eigen::MatrixX2d rows_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::MatrixX2d rows(static_cast<Eigen::Index>(points.size()), 2);
  for (std::size_t i = 0; i < points.size(); ++i)
    rows.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return rows;
}

bool is_blob_sequence(py::handle object) {
  if (!py::isinstance<py::list>(object) && !py::isinstance<py::tuple>(object)) return false;
  for (const auto& item : py::reinterpret_borrow<py::sequence>(object))
    if (!py::isinstance<Blob>(item)) return false;
  return true;
}

std::shared_ptr<const EmissionProfile> profile_of_file(const std::filesystem::path& path) {
  return reading(path, [](const std::string& name) {
    return std::make_shared<const EmissionProfile>(read_photometry(name));
  });
}

}  // namespace occ::python
