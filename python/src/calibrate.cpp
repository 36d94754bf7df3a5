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
      field("method", &O::method, "levels: any curve; basis: of few coefficients"),
      field("black_level_dn", &O::black_level_dn, "stored level without light"),
      field("bit_depth", &O::bit_depth, "8 to 16; 0: 8, which 16-bit images must say otherwise"),
      field("smoothness", &O::smoothness, "of `levels`, at least 1: Debevec and Malik's lambda"),
      field("basis_functions", &O::basis_functions, "of `basis`, 1 to 8"),
      field("max_places", &O::max_places, "flat places used per channel, at least 16"));
}

/// Exposure index, x, y, level, log exposure, residual, sigma.
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

log_exposure is g(level) = ln(light x time), 0 at the middle level: light has no scale here.)")
      .def_readonly("black_level_dn", &C::black_level_dn, "Stored level without light.")
      .def_readonly("full_scale_dn", &C::full_scale_dn, "Highest stored level.")
      .def_readonly("level_dn", &C::level_dn, "(n,) levels, rising.")
      .def_readonly("log_exposure", &C::log_exposure, "(n,) g at the levels, not falling.")
      .def_property_readonly("sigma", &C::sigma, "(n,) standard deviation of log_exposure.")
      .def_readonly("covariance", &C::covariance, "(n, n) of log_exposure.")
      .def_readonly("projected", &C::projected, "Levels moved to make the curve rise.")
      .def_readonly("lowest_dn", &C::lowest_dn, "Lowest level seen; below it extrapolated.")
      .def_readonly("highest_dn", &C::highest_dn, "Highest level seen; above it extrapolated.")
      .def_readonly("coefficients", &C::coefficients, "Of the basis; empty for `levels`.")
      .def_readonly("coefficient_covariance", &C::coefficient_covariance, "Theirs.")
      .def_readonly("chi2", &C::chi2, "Of the residuals.")
      .def_readonly("dof", &C::dof, "Observations minus parameters.")
      .def_readonly("variance_factor", &C::variance_factor,
                    "Contained in covariance; 1 unless chi2 is too large for chance.")
      .def_property_readonly("residuals", &residual_rows,
                             "(m, 7) image, x, y [px], level [dn], log exposure, residual, sigma.")
      .def("table", &C::table, py::arg("samples") = 1024,
           "Stored values 0..1 at evenly spaced linear ones, for Sensor(response_table=).")
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
  py::native_enum<ResponseMethod>(m, "ResponseMethod", "enum.Enum", "How a response is described.")
      .value("levels", ResponseMethod::levels)
      .value("basis", ResponseMethod::basis)
      .finalize();
  define_channel(m);
  ResultClass<Recovered> result(m, "RecoveredResponse", "A camera's response curves, by channel.");
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
          "The sensor with this response as tables. Three channels (blue, green, red) take one "
          "with a mosaic.")
      .def("__repr__", [](const Recovered& r) {
        return "<RecoveredResponse: " + std::string(to_string(r.status)) + ", channels " +
               std::to_string(r->channels.size()) + ">";
      });

  const auto fields = response_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "recover_response",
            [fields](const std::vector<NumpyImage>& images, const std::vector<double>& exposures_s,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              return recovered(images, exposures_s,
                               from_values<ResponseOptions>(fields, values...));
            },
            py::arg("images"), py::arg("exposures_s"), py::kw_only(), argument(f, texts)...,
            (R"(The camera's response from images of one still scene with several exposure times.

Debevec and Malik, SIGGRAPH 1997, eq (3), by the noise that the pixels show, per channel; or a
curve of a basis (Grossberg and Nayar, CVPR 2003) for two or three exposures.
images: arrays of one shape, (height, width) or (height, width, 3), uint8 or uint16.
exposures_s: exposure time of each [s]; only their ratios count.
Returns: RecoveredResponse; its status is degenerate when the images do not determine the curve.
Raises: ValueError for counts, shapes or times that do not fit, naming them.)" +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
  define_calibrate_light(m);
}

}  // namespace occ::python
