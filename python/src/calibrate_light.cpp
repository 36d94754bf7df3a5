// SPDX-License-Identifier: Apache-2.0
#include "fields.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/photometry/ambient.hpp"
#include "libocc/photometry/light.hpp"
#include "module.hpp"
#include "results.hpp"

namespace occ::python {
namespace {

using Calibrated = Result<CalibratedLight>;

auto light_fields() {
  using O = LightOptions;
  return std::make_tuple(
      field("powers", &O::powers,
            "each: power of each lamp; common_factor: one factor of all powers"),
      field("gate_px", &O::gate_px,
            "radius around a lamp's predicted image that must contain one blob [px]"),
      field("model_sigma", &O::model_sigma,
            "relative error of the flux model, added to that of the blob"),
      field("huber_sigma", &O::huber_sigma, "residuals above are down-weighted [sigma]"),
      field("max_order_sigma", &O::max_order_sigma,
            "an order with a larger sigma counts as undetermined"));
}

void define_enums(py::module_& m) {
  py::native_enum<PowerFit>(m, "PowerFit", "enum.Enum", "Unknown powers of the lamps.")
      .value("each", PowerFit::each)
      .value("common_factor", PowerFit::common_factor)
      .finalize();
  py::native_enum<FluxUse>(m, "FluxUse", "enum.Enum",
                           "Use of a lamp's flux in an image, or the reason for its exclusion.")
      .value("used", FluxUse::used)
      .value("out_of_view", FluxUse::out_of_view)
      .value("hidden", FluxUse::hidden)
      .value("no_blob", FluxUse::no_blob)
      .value("not_alone", FluxUse::not_alone)
      .value("saturated", FluxUse::saturated)
      .value("cut", FluxUse::cut)
      .value("merged", FluxUse::merged)
      .value("blinks", FluxUse::blinks)
      .finalize();
}

void define_results(py::module_& m) {
  ResultClass<LampFlux>(m, "LampFlux", "A lamp's flux in one image.")
      .def_readonly("image", &LampFlux::image, "Index of the image.")
      .def_readonly("use", &LampFlux::use, "FluxUse: used, or the reason for exclusion.")
      .def_readonly("cos_emission", &LampFlux::cos_emission, "Cosine of the emission angle.")
      .def_readonly("flux_dn", &LampFlux::flux_dn, "Flux: sum of linear grey levels.")
      .def_readonly("residual", &LampFlux::residual, "ln(observed / predicted flux).")
      .def_readonly("sigma", &LampFlux::sigma, "Standard deviation of the residual.")
      .def("__repr__", [](const LampFlux& f) {
        return "<LampFlux: image " + std::to_string(f.image) + ", " + to_string(f.use) + ">";
      });
  ResultClass<LampLight>(m, "LampLight", "Power and Lambertian order of one lamp.")
      .def_readonly("id", &LampLight::id, "Id of the lamp.")
      .def_readonly("status", &LampLight::status,
                    "ok; no_lamps: used in no image; degenerate: order not determined.")
      .def_readonly("message", &LampLight::message, "Explanation, may be empty.")
      .def_readonly("power_w", &LampLight::power_w,
                    "Power [W]; that of the scene if not determined.")
      .def_readonly("order", &LampLight::order,
                    "Lambertian order; that of the scene if not determined.")
      .def_readonly("covariance", &LampLight::covariance, "Covariance (2, 2) of (ln power, order).")
      .def_readonly("chi2", &LampLight::chi2, "Robust chi-square of the fluxes.")
      .def_readonly("dof", &LampLight::dof, "Fluxes minus parameters.")
      .def_readonly("variance_factor", &LampLight::variance_factor,
                    "Included in covariance; 1 unless chi2 exceeds its 99.9 % quantile.")
      .def_readonly("fluxes", &LampLight::fluxes, "LampFlux of each image.")
      .def("__repr__", [](const LampLight& l) {
        return "<LampLight: lamp " + std::to_string(l.id) + ", " + to_string(l.status) + ", " +
               value_repr(l.power_w) + " W, order " + value_repr(l.order) + ">";
      });
  ResultClass<CommonFactor>(m, "CommonFactor", "Common factor of all powers of the scene.")
      .def_readonly("value", &CommonFactor::value, "Ratio of the powers to those of the scene.")
      .def_readonly(
          "covariance", &CommonFactor::covariance,
          "Covariance (1 + lamps, 1 + lamps) of (ln value, orders); inf: undetermined order.")
      .def("__repr__",
           [](const CommonFactor& f) { return "<CommonFactor: " + value_repr(f.value) + ">"; });
  ResultClass<Calibrated> calibrated(m, "CalibratedLight", "Calibrated light of a scene's lamps.");
  define_result(calibrated);
  calibrated
      .def_property_readonly("lamps", value_of(&CalibratedLight::lamps),
                             "LampLight of each lamp, in the scene's order.")
      .def_property_readonly("factor", value_of(&CalibratedLight::factor),
                             "CommonFactor with powers=PowerFit.common_factor, else None.")
      .def_property_readonly("scene", value_of(&CalibratedLight::scene),
                             "Scene with the calibrated light of the lamps that are ok.")
      .def("__repr__", [](const Calibrated& c) {
        return "<CalibratedLight: " + std::string(to_string(c.status)) + ", lamps " +
               std::to_string(c->lamps.size()) + ">";
      });
}

Calibrated calibrated(const Scene& scene, const std::vector<ImageOrBlobs>& images,
                      const std::vector<Rigid3>& poses,
                      const std::optional<std::vector<std::vector<Match>>>& matches,
                      const LightOptions& options) {
  py::gil_scoped_release unlocked;
  DetectOptions detecting;
  detecting.sensor = scene.as_rendered().sensor;
  std::vector<std::vector<Blob>> blobs;
  for (const ImageOrBlobs& one : images)
    blobs.push_back(one.image ? detect(one.image->view, detecting) : one.blobs);
  return matches ? calibrate_light(scene, blobs, poses, *matches, options)
                 : calibrate_light(scene, blobs, poses, options);
}

using Ambient = Result<AmbientLight>;

void define_ambient(py::module_& m) {
  ResultClass<AmbientImage>(m, "AmbientImage", "Ambient light estimated from one image.")
      .def_readonly("left_out", &AmbientImage::left_out, "Reason for exclusion; empty: used.")
      .def_readonly("pixels", &AmbientImage::pixels, "Number of pixels without light of lamps.")
      .def_readonly("irradiance_w_m2", &AmbientImage::irradiance_w_m2, "[W/m^2] on the sensor.")
      .def_readonly("sigma_w_m2", &AmbientImage::sigma_w_m2,
                    "Standard deviation from the pixels' noise.")
      .def("__repr__", [](const AmbientImage& i) {
        return "<AmbientImage: " +
               (i.left_out.empty() ? value_repr(i.irradiance_w_m2) + " W/m^2" : i.left_out) + ">";
      });
  ResultClass<Ambient> ambient(m, "AmbientLight", "Ambient light on the sensor.");
  define_result(ambient);
  ambient
      .def_property_readonly("irradiance_w_m2", value_of(&AmbientLight::irradiance_w_m2),
                             "[W/m^2] on the sensor.")
      .def_property_readonly("variance_w2_m4", value_of(&AmbientLight::variance_w2_m4),
                             "Variance of the irradiance; inf if undetermined.")
      .def_property_readonly("chi2", value_of(&AmbientLight::chi2),
                             "Chi-square of the images' irradiances.")
      .def_property_readonly("dof", value_of(&AmbientLight::dof),
                             "Number of used images minus one.")
      .def_property_readonly("variance_factor", value_of(&AmbientLight::variance_factor),
                             "Included in the variance; 1 unless chi2 exceeds its 99.9 % quantile.")
      .def_property_readonly("images", value_of(&AmbientLight::images), "List of AmbientImage.")
      .def("__repr__", [](const Ambient& a) {
        return "<AmbientLight: " + std::string(to_string(a.status)) + ", " +
               value_repr(a->irradiance_w_m2) + " W/m^2>";
      });
  m.def(
      "calibrate_ambient",
      [](const Scene& scene, const std::vector<NumpyImage>& images,
         const std::vector<Rigid3>& poses) {
        std::vector<ImageView> views;
        for (const NumpyImage& image : images) views.push_back(image.view);
        py::gil_scoped_release unlocked;
        return calibrate_ambient(scene, views, poses);
      },
      py::arg("scene"), py::arg("images"), py::arg("poses"),
      R"(Estimates the ambient irradiance of the sensor from images of known poses.

It is the mean of the pixels without light of lamps, above black level and dark current. The fluxes
of lamps are measured above the local background, so this and calibrate_light() are independent.
poses: cam_from_world of each image, (4, 4).
Returns: AmbientLight; status degenerate if no image is usable: the background is clipped at level 0
  or saturated, contains light of lamps (walls, glare, ghosts), or is darker than the black level.
Raises: ValueError for another number of poses than of images, images of another size than the
  camera's, a colour mosaic, or a scene with ambient light switched off.)");
}

}  // namespace

void define_calibrate_light(py::module_& m) {
  define_enums(m);
  define_results(m);
  define_ambient(m);
  const auto fields = light_fields();
  define_function(
      m, "calibrate_light", fields,
      [](LightOptions options, const Scene& scene, const std::vector<ImageOrBlobs>& images,
         const std::vector<Rigid3>& poses,
         const std::optional<std::vector<std::vector<Match>>>& matches) {
        return calibrated(scene, images, poses, matches, options);
      },
      py::arg("scene"), py::arg("images"), py::arg("poses"), py::arg("matches") = py::none(),
      py::kw_only(),
      (R"(Estimates power and Lambertian order of the scene's lamps from images at known poses.

Weighted least squares of each lamp's fluxes: ln F = ln P + ln(m + 1) + m ln cos(phi) + geometry.
With powers=PowerFit.common_factor, the ratios of the scene's powers are held and one factor of all
powers, the exposure or the gain is estimated: fluxes cannot separate the factor from the powers.
Effects that the scene switches off, such as vignetting, are not modelled.
images: arrays, or lists of Blobs from detect() with the scene's sensor. poses: cam_from_world of
each, (4, 4). matches: for each image the Matches of lamps and blobs, instead of the gate around the
predicted images of the lamps.
Returns: CalibratedLight; status degenerate when no lamp's power and order are determined.
Raises: ValueError for another number of poses than of images.)" +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
