// SPDX-License-Identifier: Apache-2.0
// Measured luminous intensity distributions, and the emission profiles made of them.
#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include <memory>

#include "casters.hpp"
#include "fields.hpp"
#include "libocc/radiometry/emission_profile.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

using Distribution = PhotometricDistribution;
using ProfileState = py::typing::Tuple<Distribution>;
using Directions = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

const std::array<Word<OpeningShape>, 4> opening_words{{{"point", OpeningShape::point},
                                                       {"rectangle", OpeningShape::rectangle},
                                                       {"ellipse", OpeningShape::ellipse},
                                                       {"sideways", OpeningShape::sideways}}};

const auto tilt_fields = std::make_tuple(
    field("geometry", &LampTilt::geometry, "lamp-to-luminaire geometry of LM-63: 1, 2 or 3"),
    field("tilt_rad", &LampTilt::tilt_rad, "tilts of the luminaire, ascending [rad]"),
    field("factors", &LampTilt::factors, "factors on the intensities, one per tilt"));

const auto distribution_fields = std::make_tuple(
    field("file", &Distribution::file, "path of the file; empty without one"),
    field("source_format", &Distribution::source_format,
          "`LM-63-1986` to `LM-63-2019`, or `EULUMDAT`"),
    field("keywords", &Distribution::keywords, "(keyword, text) in the order of the file"),
    required_field("vertical_rad", &Distribution::vertical_rad,
                   "(v,) gamma, ascending: 0 is the luminaire's axis [rad]"),
    required_field("horizontal_rad", &Distribution::horizontal_rad,
                   "(h,) C planes, ascending from 0, below 2 pi; only 0 for a rotationally "
                   "symmetric distribution [rad]"),
    required_field("intensities_cd", &Distribution::intensities_cd,
                   "(v, h) intensities with all factors of the file [cd]"),
    field("opening", &Distribution::opening, "shape of the luminous opening"),
    field("size_m", &Distribution::size_m,
          "(2,) size of the opening along C = 0 and along C = 90 degrees [m]"),
    field("height_m", &Distribution::height_m, "height of the opening [m]"),
    field("lamp_lm", &Distribution::lamp_lm,
          "rated flux of all lamps [lm]; None for absolute photometry"),
    field("input_w", &Distribution::input_w, "electrical power [W]"),
    field("tilt", &Distribution::tilt, "LampTilt of LM-63; not applied to the intensities"),
    field("output_ratio", &Distribution::output_ratio, "EULUMDAT: light output ratio, 0 to 1"),
    field("downward_ratio", &Distribution::downward_ratio,
          "EULUMDAT: downward flux fraction, 0 to 1"));

/// Replaces a property that would be a list by one that is an array.
void define_array(py::object& cls, const char* name, std::vector<double> Distribution::*member) {
  const py::handle property(reinterpret_cast<PyObject*>(&PyProperty_Type));
  const py::object listed = cls.attr(name);
  const py::cpp_function getter(
      [member](const Distribution& d) {
        return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(
            (d.*member).data(), static_cast<Eigen::Index>((d.*member).size())));
      },
      py::is_method(cls));
  cls.attr(name) = property(getter, py::none(), py::none(), listed.attr("__doc__"));
}

py::object density(const EmissionProfile& profile, const py::array_t<double>& directions) {
  const bool one = directions.ndim() == 1;
  if (!(one || directions.ndim() == 2) || directions.shape(directions.ndim() - 1) != 3)
    throw py::value_error("directions must be of shape (3,) or (n, 3), got " +
                          py::cast<std::string>(py::repr(directions.attr("shape"))));
  const auto rows = directions.attr("reshape")(-1, 3).cast<Directions>();
  Eigen::VectorXd densities(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    densities[i] = profile.density(rows.row(i).transpose().normalized());
  if (one) return py::float_(densities[0]);
  return py::cast(densities);
}

}  // namespace

void define_photometric(py::module_& m) {
  define_enum(m, "OpeningShape", "Shape of a luminous opening.", opening_words);
  define_documented<LampTilt>(m, "LampTilt", "Output of a lamp against the luminaire's tilt.",
                              tilt_fields);
  define_documented<Distribution>(
      m, "PhotometricDistribution",
      "A luminous intensity distribution in C-gamma coordinates (CIE 121).", distribution_fields);
  py::object cls = m.attr("PhotometricDistribution");
  define_array(cls, "vertical_rad", &Distribution::vertical_rad);
  define_array(cls, "horizontal_rad", &Distribution::horizontal_rad);
  cls.attr("flux_lm") = py::cpp_function(
      &Distribution::flux_lm, py::name("flux_lm"), py::is_method(cls),
      "Returns the luminous flux [lm]: the integral of the intensities over the sphere.");

  py::class_<EmissionProfile, std::shared_ptr<EmissionProfile>>(
      m, "EmissionProfile",
      R"(Emission of a lamp by direction, interpolated from a PhotometricDistribution.

distribution: a PhotometricDistribution, or the path of an LM-63 or EULUMDAT file.
Raises: ValueError for a distribution without light at gamma < 90 degrees, and as read_photometry().)")
      .def(py::init([](const std::shared_ptr<const EmissionProfile>& profile) {
             if (!profile) throw py::type_error("distribution must not be None");
             return std::make_shared<EmissionProfile>(profile->distribution());
           }),
           py::arg("distribution"))
      .def("density", &density, py::arg("directions"),
           R"(Returns the radiant intensity over the power of the lit hemisphere [1/sr].

directions: (3,) or (n, 3), of any length, along (x_axis, x_axis x normal, normal) of the lamp.)")
      .def_property_readonly("distribution", &EmissionProfile::distribution,
                             "PhotometricDistribution.")
      .def_property_readonly("depends_on_c", &EmissionProfile::depends_on_c,
                             "False for a rotationally symmetric distribution.")
      .def_property_readonly("equivalent_order", &EmissionProfile::equivalent_order,
                             "Order of the Lambertian lamp with the same mean cosine.")
      .def("__repr__",
           [](const EmissionProfile& profile) {
             const Distribution& d = profile.distribution();
             return "<EmissionProfile: " +
                    (d.file.empty() ? std::string("no file") : "'" + d.file + "'") + ", " +
                    std::to_string(d.vertical_rad.size()) + " x " +
                    std::to_string(d.horizontal_rad.size()) + " intensities>";
           })
      .def(py::pickle([](const EmissionProfile& profile)
                          -> ProfileState { return py::make_tuple(profile.distribution()); },
                      [](const ProfileState& state) {
                        return std::make_shared<EmissionProfile>(state[0].cast<Distribution>());
                      }));
  m.def(
      "read_photometry",
      [](const std::filesystem::path& path) { return reading(path, &read_photometry); },
      py::arg("path"),
      R"(Reads a luminous intensity distribution from an IES LM-63 or EULUMDAT (.ldt) file.

Returns: PhotometricDistribution. Raises: FileNotFoundError or OSError when the file cannot be
  opened; ValueError naming file, line, item and value.)");
}

}  // namespace occ::python
