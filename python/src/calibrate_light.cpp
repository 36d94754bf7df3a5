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
      field("powers", &O::powers, "each: every lamp's; common_factor: one factor of all of them"),
      field("gate_px", &O::gate_px, "a lamp's blob is no farther from its image's centre [px]"),
      field("model_sigma", &O::model_sigma, "relative, of every flux beside the blob's own"),
      field("huber_sigma", &O::huber_sigma, "fluxes further off than this weigh less [sigma]"),
      field("max_order_sigma", &O::max_order_sigma, "an order less certain is not determined"));
}

void define_enums(py::module_& m) {
  py::native_enum<PowerFit>(m, "PowerFit", "enum.Enum", "Which of the lamps' powers are unknown.")
      .value("each", PowerFit::each)
      .value("common_factor", PowerFit::common_factor)
      .finalize();
  py::native_enum<FluxUse>(m, "FluxUse", "enum.Enum", "What became of a lamp's flux in an image.")
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
      .def_readonly("use", &LampFlux::use, "Used, or why not.")
      .def_readonly("cos_emission", &LampFlux::cos_emission, "Of the angle from its normal.")
      .def_readonly("flux_dn", &LampFlux::flux_dn, "Sum of linear grey levels.")
      .def_readonly("residual", &LampFlux::residual, "ln of seen over predicted.")
      .def_readonly("sigma", &LampFlux::sigma, "Of the residual.")
      .def("__repr__", [](const LampFlux& f) {
        return "<LampFlux: image " + std::to_string(f.image) + ", " + to_string(f.use) + ">";
      });
  ResultClass<LampLight>(m, "LampLight", "Power and Lambertian order of one lamp.")
      .def_readonly("id", &LampLight::id, "The lamp's.")
      .def_readonly("status", &LampLight::status,
                    "ok; no_lamps: used in no image; degenerate: order not determined.")
      .def_readonly("message", &LampLight::message, "A sentence, may be empty.")
      .def_readonly("power_w", &LampLight::power_w, "[W]; the scene's when not found.")
      .def_readonly("order", &LampLight::order, "Lambertian; the scene's when not determined.")
      .def_readonly("covariance", &LampLight::covariance, "(2, 2) of (ln power, order).")
      .def_readonly("chi2", &LampLight::chi2, "Of the fluxes, robust.")
      .def_readonly("dof", &LampLight::dof, "Fluxes minus parameters.")
      .def_readonly("variance_factor", &LampLight::variance_factor,
                    "Contained in covariance; 1 unless chi2 is too large for chance.")
      .def_readonly("fluxes", &LampLight::fluxes, "LampFlux of each image.")
      .def("__repr__", [](const LampLight& l) {
        return "<LampLight: lamp " + std::to_string(l.id) + ", " + to_string(l.status) + ", " +
               value_repr(l.power_w) + " W, order " + value_repr(l.order) + ">";
      });
  ResultClass<CommonFactor>(m, "CommonFactor", "Of all the scene's powers.")
      .def_readonly("value", &CommonFactor::value, "The powers are the scene's times this.")
      .def_readonly("covariance", &CommonFactor::covariance,
                    "(1 + lamps, 1 + lamps) of (ln value, orders); inf: order not determined.")
      .def("__repr__",
           [](const CommonFactor& f) { return "<CommonFactor: " + value_repr(f.value) + ">"; });
  ResultClass<Calibrated> calibrated(m, "CalibratedLight", "The light of a scene's lamps.");
  define_result(calibrated);
  calibrated
      .def_property_readonly("lamps", value_of(&CalibratedLight::lamps),
                             "LampLight of each lamp, in the scene's order.")
      .def_property_readonly("factor", value_of(&CalibratedLight::factor),
                             "CommonFactor with powers=PowerFit.common_factor, else None.")
      .def_property_readonly("scene", value_of(&CalibratedLight::scene),
                             "The scene with the lamps' light where it is ok.")
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
  ResultClass<AmbientImage>(m, "AmbientImage", "What one image says of the ambient light.")
      .def_readonly("left_out", &AmbientImage::left_out, "Why it does not count; empty: it does.")
      .def_readonly("pixels", &AmbientImage::pixels, "That no lamp reaches.")
      .def_readonly("irradiance_w_m2", &AmbientImage::irradiance_w_m2, "[W/m^2] on the sensor.")
      .def_readonly("sigma_w_m2", &AmbientImage::sigma_w_m2, "Of its pixels' noise.")
      .def("__repr__", [](const AmbientImage& i) {
        return "<AmbientImage: " +
               (i.left_out.empty() ? value_repr(i.irradiance_w_m2) + " W/m^2" : i.left_out) + ">";
      });
  ResultClass<Ambient> ambient(m, "AmbientLight", "Light on the sensor that comes from no lamp.");
  define_result(ambient);
  ambient
      .def_property_readonly("irradiance_w_m2", value_of(&AmbientLight::irradiance_w_m2),
                             "[W/m^2] on the sensor.")
      .def_property_readonly("variance_w2_m4", value_of(&AmbientLight::variance_w2_m4),
                             "Of it; inf when it is not determined.")
      .def_property_readonly("chi2", value_of(&AmbientLight::chi2), "Of the images' irradiances.")
      .def_property_readonly("dof", value_of(&AmbientLight::dof), "Images that count, minus one.")
      .def_property_readonly("variance_factor", value_of(&AmbientLight::variance_factor),
                             "Contained in the variance; 1 unless chi2 is too large for chance.")
      .def_property_readonly("images", value_of(&AmbientLight::images), "AmbientImages.")
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
      R"(Ambient irradiance of the sensor from images of known poses.

The mean of the pixels that no lamp reaches, over black level and dark current. The lamps' fluxes are
over the local background, so that this and calibrate_light() do not depend on each other.
poses: cam_from_world of each image, (4, 4).
Returns: AmbientLight; status degenerate when no image tells it: the background is cut off at level 0
  or saturated, or has light of the lamps by walls, glare or ghosts, or is darker than the black level.
Raises: ValueError for another number of poses than of images, images not of the camera's size, a
  colour mosaic, or a scene that switches ambient light off.)");
}

}  // namespace

void define_calibrate_light(py::module_& m) {
  define_enums(m);
  define_results(m);
  define_ambient(m);
  const auto fields = light_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "calibrate_light",
            [fields](const Scene& scene, const std::vector<ImageOrBlobs>& images,
                     const std::vector<Rigid3>& poses,
                     const std::optional<std::vector<std::vector<Match>>>& matches,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              return calibrated(scene, images, poses, matches,
                                from_values<LightOptions>(fields, values...));
            },
            py::arg("scene"), py::arg("images"), py::arg("poses"), py::arg("matches") = py::none(),
            py::kw_only(), argument(f, texts)...,
            (R"(Power and Lambertian order of the scene's lamps, from images at known poses.

Weighted least squares of each lamp's fluxes: ln F = ln P + ln(m + 1) + m ln cos(phi) + geometry.
With powers=PowerFit.common_factor the scene's powers are right but for one factor of all of them, of
the exposure or of the gain; fluxes cannot tell it from every lamp's power, so one of both is known.
What the scene's effects switch off, such as vignetting, is not counted.
images: arrays, or lists of Blobs that detect() found with the scene's sensor. poses: cam_from_world
of each, (4, 4). matches: for each image the Matches of lamps and blobs, instead of a gate about
where the poses put the lamps.
Returns: CalibratedLight; status degenerate when no lamp's power and order are determined.
Raises: ValueError for another number of poses than of images, naming it.)" +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

}  // namespace occ::python
