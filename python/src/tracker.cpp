// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/tracker.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

void define_frame(py::module_& m) {
  py::native_enum<TrackerState>(m, "TrackerState", "enum.Enum", "Whether a tracker has a pose.")
      .value("searching", TrackerState::searching)
      .value("tracking", TrackerState::tracking)
      .value("coasting", TrackerState::coasting)
      .value("lost", TrackerState::lost)
      .finalize();
  using F = TrackedFrame;
  ResultClass<F>(m, "TrackedFrame", R"(Where the camera was when it took an image.

While searching or lost there is no pose: its covariance is infinite.)")
      .def_readonly("time_s", &F::time_s, "Of the image [s].")
      .def_readonly("camera", &F::camera, "Number of the camera.")
      .def_readonly("state", &F::state, "A TrackerState.")
      .def_readonly("reason", &F::reason, "A sentence; empty while all is as expected.")
      .def_readonly("cam_from_world", &F::cam_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &F::covariance,
                    "(6, 6) [rotation, translation], left perturbation.")
      .def_readonly("position_m", &F::position_m, "(3,) of the camera [m, world].")
      .def_readonly("position_covariance_m2", &F::position_covariance_m2, "(3, 3) of it.")
      .def_readonly("lamps", &F::lamps, "Lamp id -> Blob, of those the pose was made of.")
      .def_readonly("missing", &F::missing, "Ids that should be in view and were not found.")
      .def_readonly("full_search", &F::full_search, "Whether the whole image was searched.")
      .def_readonly("relocated", &F::relocated, "The pose has jumped to where none expected it.")
      .def_readonly("nis", &F::nis, "Normalised innovation squared of the lamps.")
      .def_readonly("nis_dof", &F::nis_dof, "Its degrees of freedom.")
      .def_readonly("timing_s", &F::timing_s, "Where the time went [s].")
      .def("__repr__", [](const F& f) {
        const std::string text = "<TrackedFrame: " + value_repr(f.time_s) + " s, " +
                                 to_string(f.state) + ", " + std::to_string(f.lamps.size()) +
                                 " lamps";
        return text + (f.reason.empty() ? ">" : ": " + f.reason + ">");
      });
}

auto tracker_fields() {
  using O = TrackerOptions;
  using L = LocateOptions;
  const auto of_locate = std::tuple_cat(fields_within(&L::detect, detect_fields()),
                                        fields_within(&L::refine, refine_fields()));
  const auto own = std::make_tuple(
      field("filter", &O::filter, "PoseFilterOptions of a body that moves in space"),
      field("floor", &O::floor, "instead: PlanarFilterOptions of a vehicle on a floor"),
      field("windows", &O::windows, "look for lamps where they are expected, not everywhere"),
      field("gate_sigma", &O::gate_sigma, "a lamp and a blob agree within [sigma]"),
      field("gate_model_sigma_px", &O::model_sigma_px, "camera and map error in that gate [px]"),
      field("coast_s", &O::coast_s, "without lamps the prediction is believed so long [s]"),
      field("coast_sigma_m", &O::coast_sigma_m, "and while its sigma is smaller [m]"),
      field("drift_sigma_m", &O::drift_sigma_m, "how far off it may be when odometry errs [m]"),
      field("drift_sigma_rad", &O::drift_sigma_rad, "alike [rad]"),
      field("confirmations", &O::confirmations,
            "images that must agree on a pose that was not predicted"));
  return std::tuple_cat(own, fields_within(&O::locate, of_locate));
}

void define_constructor(py::class_<Tracker>& cls) {
  const auto fields = tracker_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        cls.def(py::init([fields](const Scene& scene, const std::optional<Prior>& prior,
                                  const Rigid3& cam_from_body,
                                  const typename std::decay_t<decltype(f)>::value_type&... values) {
                  auto options = from_values<TrackerOptions>(fields, values...);
                  options.locate.prior = prior;
                  return Tracker(scene, options, cam_from_body);
                }),
                py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
                py::arg_v("cam_from_body", Rigid3{}, "numpy.eye(4)"), argument(f, texts)...,
                fields_doc(fields, "Options").c_str());
      },
      fields);
}

}  // namespace

void define_tracker(py::module_& m) {
  define_frame(m);
  py::class_<Tracker> cls(m, "Tracker", R"(A camera's way through the lamps, image by image.

scene: Scene. prior: what is known of the camera before the first image; its height and gravity
hold for ever. cam_from_body: 4x4, how the camera is mounted.

The filter predicts, lamps are looked for where that puts them, and what they say corrects it. A
camera that has been carried off is found again, and the jump is said (`relocated`).

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/irregular_six.yaml")
>>> pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[1.9, 2.1, 3], up=[0, 1, 0])
>>> tracker = occ.Tracker(scene)
>>> image, truth = occ.simulate(scene, pose, seed=1)
>>> frame = tracker.add_image(image, 0.0)
>>> frame.state.name, frame.position_m.round(2).tolist()
('tracking', [1.9, 2.1, 0.3]))");
  define_constructor(cls);
  using Unlocked = py::call_guard<py::gil_scoped_release>;
  cls.def("add_camera", &Tracker::add_camera, py::arg("scene"), py::arg("cam_from_body"),
          "A second camera on the same body. Returns: its number.")
      .def("start", &Tracker::start, py::arg("time_s"), py::arg("body_from_world"),
           py::arg("covariance"), "Begins at a known pose (4x4; (6, 6)) instead of by a search.")
      .def(
          "add_image",
          [](Tracker& tracker, const NumpyImage& image, double time_s, int camera,
             const std::optional<Rigid3>& cam_from_body) {
            py::gil_scoped_release unlocked;
            return tracker.add_image(image.view, time_s, {camera, cam_from_body});
          },
          py::arg("image"), py::arg("time_s"), py::arg("camera") = 0,
          py::arg("cam_from_body") = py::none(),
          R"(Where the camera was at time_s, when the image's first line began its exposure.

image: as locate() takes it. cam_from_body: of a camera that pans or tilts, how it stood.
Returns: TrackedFrame. An image whose time is not after the last one's is left out, and said.
Raises: ValueError for another size, a time that is not finite, a camera that there is not.)")
      .def("add", py::overload_cast<const Odometry&>(&Tracker::add), py::arg("measurement"),
           Unlocked(),
           "Takes Odometry of a body in space, PlanarOdometry of a vehicle on a floor, or an "
           "ImuSample. Returns: FilterUpdate. Raises: RuntimeError for odometry of the other kind.")
      .def("add", py::overload_cast<const PlanarOdometry&>(&Tracker::add), py::arg("measurement"),
           Unlocked())
      .def("add", py::overload_cast<const ImuSample&>(&Tracker::add), py::arg("measurement"),
           Unlocked())
      .def_property_readonly("state", &Tracker::state, "A TrackerState.")
      .def("predict", &Tracker::predict, py::arg("time_s"),
           "PosePrediction of the body at a time [s], or None while there is no pose.")
      .def("planar", &Tracker::planar, py::arg("time_s"),
           "PlanarEstimate at a time [s], or None; of a vehicle on a floor.");
}

}  // namespace occ::python
