// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/robust_pose.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using R = Result<RobustPose>;

// A property of the fix inside.
template <class M>
auto of_fix(M Fix::*member) {
  return [member](const R& r) -> const M& { return r.value.fix.*member; };
}

py::array_t<bool> inliers_of(const R& r) {
  py::array_t<bool> array(static_cast<py::ssize_t>(r.value.inliers.size()));
  std::copy(r.value.inliers.begin(), r.value.inliers.end(), array.mutable_data());
  return array;
}

void define_result_class(py::module_& m) {
  ResultClass<R> cls(m, "RobustPose", R"(A pose among wrong matches: the answer of robust_pose().

What was found so far is there even when it is not ok: look at status and message.)");
  define_result(cls);
  cls.def_property_readonly("cam_from_world", of_fix(&Fix::cam_from_world), "Pose, 4x4.")
      .def_property_readonly("covariance", of_fix(&Fix::covariance),
                             "(6, 6) of cam_from_world [rotation rad, translation m], left "
                             "perturbation.")
      .def_property_readonly("position_m", of_fix(&Fix::position_m),
                             "(3,) of the camera [m, world].")
      .def_property_readonly("position_covariance_m2", of_fix(&Fix::position_covariance_m2),
                             "(3, 3) of the position [m^2, world].")
      .def_property_readonly("rms_px", of_fix(&Fix::rms_px), "Of the inliers [px].")
      .def_property_readonly("candidates", of_fix(&Fix::candidates),
                             "Every pose that fits the inliers, best first.")
      .def_property_readonly("inliers", &inliers_of, "(n,) bool: the points that agree.")
      .def_property_readonly("inlier_ratio", value_of(&RobustPose::inlier_ratio), "Of all points.")
      .def_property_readonly("iterations", value_of(&RobustPose::iterations), "Samples drawn.")
      .def_property_readonly("log10_false_alarms", value_of(&RobustPose::log10_false_alarms),
                             "How many poses as good as this chance alone would bring.")
      .def("__repr__", [](const R& r) {
        return "<RobustPose: " + std::string(to_string(r.status)) + ", inlier ratio " +
               value_repr(r.value.inlier_ratio) + ", iterations " +
               std::to_string(r.value.iterations) + ">";
      });
}

auto robust_fields() {
  using O = RobustPoseOptions;
  return std::make_tuple(
      field("gate_sigmas", &O::gate_sigmas, "further off in the image a match is wrong"),
      field("confidence", &O::confidence, "that a sample without a wrong match was drawn"),
      field("max_iterations", &O::max_iterations, "samples"),
      field("max_false_alarms", &O::max_false_alarms,
            "poses as good as the best that chance alone would bring"),
      field("seed", &O::seed, "the same answer for the same seed"),
      field("up_in_cam", &O::up_in_cam,
            "(3,) the world's Z in the camera's frame, unit, when known: samples of two points"),
      field("up_sigma_rad", &O::up_sigma_rad, "of up_in_cam, about each axis [rad]"));
}

}  // namespace

void define_robust_pose(py::module_& m) {
  define_result_class(m);
  const auto fields = robust_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "robust_pose",
            [fields](const Rows3& points_in_world_m, const Rows2& points_px, const Camera& camera,
                     double sigma_px,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              auto options = from_values<RobustPoseOptions>(fields, values...);
              options.sigma_px = sigma_px;
              py::gil_scoped_release unlocked;
              return robust_pose(points_in_world_m.transpose(), points_px.transpose(), camera,
                                 options);
            },
            py::arg("points_in_world_m"), py::arg("points_px"), py::arg("camera"),
            py::arg("sigma_px") = RobustPoseOptions{}.sigma_px, py::kw_only(),
            argument(f, texts)...,
            (R"(The pose that most points agree with, when many were matched wrongly.

RANSAC with local optimisation, then least squares over the points that agree. points_in_world_m:
(n, 3). points_px: (n, 2), where they were seen. sigma_px: of a right match's pixel coordinate.
Returns: RobustPose. Its status is no_pose when no more points agree than chance explains or they
contradict up_in_cam; ambiguous when several poses fit; too_few_lamps; degenerate for points that
coincide or lie on a line.
Raises: ValueError for counts that differ, numbers that are not finite, a bad option.)" +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

}  // namespace occ::python
