// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/tracker.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

void define_frame(py::module_& m) {
  py::native_enum<TrackerState>(m, "TrackerState", "enum.Enum", "State of a tracker.")
      .value("searching", TrackerState::searching, "no pose yet")
      .value("tracking", TrackerState::tracking, "the lamps of the image determine the pose")
      .value("coasting", TrackerState::coasting, "no lamp fits; the pose is predicted")
      .value("lost", TrackerState::lost, "the prediction is too old or too uncertain")
      .finalize();
  using F = TrackedFrame;
  ResultClass<F>(m, "TrackedFrame", R"(Pose of the camera at the time of one image.

While searching or lost, the pose is undefined and its covariance infinite.)")
      .def_readonly("time_s", &F::time_s, "Time of the image [s].")
      .def_readonly("camera", &F::camera, "Number of the camera.")
      .def_readonly("state", &F::state, "TrackerState.")
      .def_readonly("reason", &F::reason, "A sentence on anything unexpected; else empty.")
      .def_readonly("cam_from_world", &F::cam_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &F::covariance,
                    "(6, 6) of cam_from_world [rotation rad, translation m], left perturbation.")
      .def_readonly("position_m", &F::position_m, "(3,) position of the camera [m, world].")
      .def_readonly("position_covariance_m2", &F::position_covariance_m2,
                    "(3, 3) covariance of the position [m^2, world].")
      .def_readonly("lamps", &F::lamps,
                    "Lamp id -> Blob, of the lamps that the pose was computed from.")
      .def_readonly("missing", &F::missing,
                    "Ids of lamps that should be in view and were not found.")
      .def_readonly("full_search", &F::full_search, "True if the whole image was searched.")
      .def_readonly("relocated", &F::relocated,
                    "True if the pose jumped out of the gate of its prediction.")
      .def_readonly("nis", &F::nis, "Normalised innovation squared of the lamps.")
      .def_readonly("nis_dof", &F::nis_dof, "Degrees of freedom of nis.")
      .def_readonly("protection_level_m", &F::protection_level_m,
                    "Horizontal protection level of the body [m]; inf without alert_limit_m.")
      .def_readonly("timing_s", &F::timing_s, "Timing: computing times [s].")
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
      field("floor", &O::floor,
            "PlanarFilterOptions of a vehicle on a floor, replaces `filter`; or None"),
      field("windows", &O::windows,
            "detect lamps around their predictions, not in the whole image"),
      field("gate_sigma", &O::gate_sigma, "gate between a predicted lamp and a blob [sigma]"),
      field("gate_model_sigma_px", &O::model_sigma_px,
            "error of camera and map, added to that gate [px]"),
      field("coast_s", &O::coast_s, "maximum duration of prediction without lamps [s]"),
      field("coast_sigma_m", &O::coast_sigma_m,
            "maximum position sigma of the prediction without lamps [m]"),
      field("drift_sigma_m", &O::drift_sigma_m,
            "position error of the prediction if odometry or a clock fails [m]"),
      field("drift_sigma_rad", &O::drift_sigma_rad,
            "rotation error of the prediction if odometry or a clock fails [rad]"),
      field("mount_sigma_rad", &O::mount_sigma_rad,
            "constant error of a camera's mount, rotation about each of the camera's axes [rad]"),
      field("mount_sigma_m", &O::mount_sigma_m,
            "constant error of a camera's mount, shift along each of the camera's axes [m]"),
      field("clock_sigma_s", &O::clock_sigma_s, "constant error of the times of all images [s]"),
      field("confirmations", &O::confirmations,
            "consecutive images that must agree on a pose outside the prediction"),
      field("alert_limit_m", &O::alert_limit_m,
            "limit of the protection level of the body's position; None: no level [m]"),
      field("integrity_risk", &O::integrity_risk,
            "probability that the error exceeds the protection level undetected, for each image"));
  return std::tuple_cat(own, fields_within(&O::locate, of_locate));
}

void define_init(py::class_<Tracker>& cls) {
  const auto fields = tracker_fields();
  define_constructor(
      cls, fields,
      [](TrackerOptions options, const Scene& scene, const std::optional<Prior>& prior,
         const Rigid3& cam_from_body) {
        options.locate.prior = prior;
        return Tracker(scene, options, cam_from_body);
      },
      py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
      py::arg_v("cam_from_body", Rigid3{}, "numpy.eye(4)"), fields_doc(fields, "Options").c_str());
}

}  // namespace

void define_tracker(py::module_& m) {
  define_frame(m);
  py::class_<Tracker> cls(m, "Tracker", R"(Tracks a camera from image to image.

scene: Scene. prior: Prior of the camera before the first image; its height and gravity are used for
all images. cam_from_body: 4x4, mounting of the camera.

A filter predicts the pose. Lamps are detected in windows around their predicted images, and correct
the filter. If none is found there, the whole image is searched. A pose outside the prediction is
accepted after several images agree on it; the jump is reported (`relocated`).

>>> import libocc as occ
>>> scene = occ.Scene.load("data/scenes/irregular_six.yaml")
>>> pose = occ.look_at(position_m=[1.9, 2.1, 0.3], target_m=[1.9, 2.1, 3], up=[0, 1, 0])
>>> tracker = occ.Tracker(scene)
>>> image, truth = occ.simulate(scene, pose, seed=1)
>>> frame = tracker.add_image(image, 0.0)
>>> frame.state.name, frame.position_m.round(2).tolist()
('tracking', [1.9, 2.1, 0.3]))");
  define_init(cls);
  using Unlocked = py::call_guard<py::gil_scoped_release>;
  cls.def("add_camera", &Tracker::add_camera, py::arg("scene"), py::arg("cam_from_body"),
          "Adds a camera on the same body. Returns: its number.")
      .def("start", &Tracker::start, py::arg("time_s"), py::arg("body_from_world"),
           py::arg("covariance"),
           "Starts at a known pose (4x4) with covariance (6, 6) instead of a search.")
      .def(
          "add_image",
          [](Tracker& tracker, const NumpyImage& image, double time_s, int camera,
             const std::optional<Rigid3>& cam_from_body) {
            py::gil_scoped_release unlocked;
            return tracker.add_image(image.view, time_s, {camera, cam_from_body});
          },
          py::arg("image"), py::arg("time_s"), py::arg("camera") = 0,
          py::arg("cam_from_body") = py::none(),
          R"(Adds an image and returns the camera's pose at its time.

image: array as for locate(). time_s: start of the exposure of the first line [s], increasing for
each camera. camera: number returned by add_camera(). cam_from_body: mount (4x4) at this time, of a
camera that pans or tilts.
Returns: TrackedFrame. An image whose time is not later than the previous one's is skipped, with a
reason. After five of them in a row, the tracker restarts at the last pose: the clock was set back.
Raises: ValueError for an image that does not have the camera's size, a time that is not finite, or
an unknown camera.)")
      .def("add", py::overload_cast<const Odometry&>(&Tracker::add), py::arg("measurement"),
           Unlocked(),
           "Adds Odometry of a body in space, PlanarOdometry of a vehicle on a floor, or an "
           "ImuSample. Returns: FilterUpdate. Raises: RuntimeError for odometry of the other kind, "
           "ValueError for values that are not finite.")
      .def("add", py::overload_cast<const PlanarOdometry&>(&Tracker::add), py::arg("measurement"),
           Unlocked())
      .def("add", py::overload_cast<const ImuSample&>(&Tracker::add), py::arg("measurement"),
           Unlocked())
      .def_property_readonly("state", &Tracker::state, "TrackerState.")
      .def("predict", &Tracker::predict, py::arg("time_s"),
           "Returns the PosePrediction of the body at a time [s]; None while searching or lost.")
      .def("planar", &Tracker::planar, py::arg("time_s"),
           "Returns the PlanarEstimate of a vehicle on a floor at a time [s]; None while searching "
           "or lost, and for a body in space.")
      .def("protection_level_m", &Tracker::protection_level_m, py::arg("time_s"),
           "Bounds the horizontal error of the body's position predicted to a time [s], even if "
           "lamps are faulty [m]. inf without alert_limit_m, without a pose, and for a body in "
           "space at other times than that of the last image.");
}

}  // namespace occ::python
