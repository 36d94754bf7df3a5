// SPDX-License-Identifier: Apache-2.0
#include "fields.hpp"
#include "libocc/photometry/response.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Recovered = Result<RecoveredResponse>;

auto response_fields() {
  using O = ResponseOptions;
  return std::make_tuple(
      field("method", &O::method, "levels: any curve; basis: curve with few coefficients"),
      field("black_level_dn", &O::black_level_dn, "stored level without light"),
      field("bit_depth", &O::bit_depth, "8 to 16; required for 16-bit images; 0: 8"),
      field("smoothness", &O::smoothness, "Debevec and Malik's lambda for `levels`, at least 1"),
      field("basis_functions", &O::basis_functions, "number of functions of `basis`, 1 to 8"),
      field("max_patches", &O::max_patches, "flat patches used per channel, at least 16"));
}

/// Columns: exposure index, x, y, level, log exposure, residual, sigma.
Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor> residual_rows(const ChannelResponse& c) {
  Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor> rows(
      static_cast<Eigen::Index>(c.residuals.size()), 7);
  Eigen::Index i = 0;
  for (const ResponseResidual& r : c.residuals)
    rows.row(i++) << r.exposure, r.px.x(), r.px.y(), r.level_dn, r.log_exposure, r.residual,
        r.sigma;
  return rows;
}

void define_channel(py::module_& m) {
  using C = ChannelResponse;
  ResultClass<C>(m, "ChannelResponse", R"(The response curve of one channel.

log_exposure is g(level) = ln(light x time), 0 at the middle level, as the scale is arbitrary.)")
      .def_readonly("black_level_dn", &C::black_level_dn, "Stored level without light.")
      .def_readonly("full_scale_dn", &C::full_scale_dn, "Highest stored level.")
      .def_readonly("level_dn", &C::level_dn, "Levels (n,), ascending.")
      .def_readonly("log_exposure", &C::log_exposure, "g at the levels (n,), not decreasing.")
      .def_property_readonly("sigma", &C::sigma, "Standard deviation of log_exposure (n,).")
      .def_readonly("covariance", &C::covariance, "Covariance of log_exposure (n, n).")
      .def_readonly("projected", &C::projected, "Number of levels changed to make the curve rise.")
      .def_readonly("lowest_dn", &C::lowest_dn, "Lowest observed level; extrapolated below.")
      .def_readonly("highest_dn", &C::highest_dn, "Highest observed level; extrapolated above.")
      .def_readonly("coefficients", &C::coefficients,
                    "Coefficients of the basis; empty for `levels`.")
      .def_readonly("coefficient_covariance", &C::coefficient_covariance,
                    "Covariance of the coefficients.")
      .def_readonly("chi2", &C::chi2, "Sum of squared normalised residuals.")
      .def_readonly("dof", &C::dof, "Observations minus parameters.")
      .def_readonly("variance_factor", &C::variance_factor,
                    "Included in covariance; 1 unless chi2 exceeds its 99.9 % quantile.")
      .def_property_readonly(
          "residuals", &residual_rows,
          "Rows (m, 7): image, x, y [px], level [dn], log exposure, residual, sigma.")
      .def(
          "table", &C::table, py::arg("samples") = 1024,
          "Returns stored values 0..1 at evenly spaced linear values, for Sensor(response_table=).")
      .def("__repr__", [](const C& c) {
        return "<ChannelResponse: levels " + value_repr(c.lowest_dn) + " to " +
               value_repr(c.highest_dn) + " seen, chi2 " + value_repr(c.chi2) + " of " +
               std::to_string(c.dof) + ">";
      });
}

Recovered recovered(const std::vector<NumpyImage>& images, const std::vector<double>& exposures_s,
                    const ResponseOptions& options) {
  std::vector<ImageView> views;
  for (const NumpyImage& image : images) views.push_back(image.view);
  py::gil_scoped_release unlocked;
  return recover_response(views, exposures_s, options);
}

}  // namespace

void define_calibrate(py::module_& m) {
  py::native_enum<ResponseMethod>(m, "ResponseMethod", "enum.Enum",
                                  "Representation of a response curve.")
      .value("levels", ResponseMethod::levels)
      .value("basis", ResponseMethod::basis)
      .finalize();
  define_channel(m);
  ResultClass<Recovered> result(m, "RecoveredResponse", "Response curves of a camera's channels.");
  define_result(result);
  result
      .def_property_readonly("channels", value_of(&RecoveredResponse::channels),
                             "ChannelResponse of each channel, in the images' order.")
      .def(
          "sensor",
          [](const Recovered& r, const Sensor& sensor, int samples) {
            return with_response(sensor, r.value, samples);
          },
          py::arg("sensor"), py::arg("samples") = 1024,
          "Returns the sensor with this response as tables. Three channels (red, green, blue) "
          "require a mosaic.")
      .def("__repr__", [](const Recovered& r) {
        return "<RecoveredResponse: " + std::string(to_string(r.status)) + ", channels " +
               std::to_string(r->channels.size()) + ">";
      });

  const auto fields = response_fields();
  define_function(
      m, "recover_response", fields,
      [](ResponseOptions options, const std::vector<NumpyImage>& images,
         const std::vector<double>& exposures_s) {
        return recovered(images, exposures_s, options);
      },
      py::arg("images"), py::arg("exposures_s"), py::kw_only(),
      (R"(Recovers a camera's response from images of a still scene at several exposure times.

Per channel: Debevec and Malik, SIGGRAPH 1997, eq (3), weighted by the estimated noise; or a curve
of a basis (Grossberg and Nayar, CVPR 2003) for two or three exposures.
images: arrays of one shape, (height, width) or (height, width, 3), uint8 or uint16.
exposures_s: exposure time of each [s]; only the ratios matter.
Returns: RecoveredResponse; its status is degenerate when the images do not determine the curve.
Raises: ValueError for inconsistent counts, shapes or times.)" +
       fields_doc(fields, "Options"))
          .c_str());
  define_calibrate_light(m);
}

}  // namespace occ::python
