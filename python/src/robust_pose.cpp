// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/robust_pose.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"

namespace occ::python {
namespace {

using R = Result<RobustPose>;

// Getter of a member of the fix inside the result.
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
  ResultClass<R> cls(m, "RobustPose", R"(Result of robust_pose().

If `ok` is false, it holds the best pose found; status and message state the reason.)");
  define_result(cls);
  cls.def_property_readonly("cam_from_world", of_fix(&Fix::cam_from_world), "Pose, 4x4.")
      .def_property_readonly("covariance", of_fix(&Fix::covariance),
                             "(6, 6) of cam_from_world [rotation rad, translation m], left "
                             "perturbation.")
      .def_property_readonly("position_m", of_fix(&Fix::position_m),
                             "(3,) position of the camera [m, world].")
      .def_property_readonly("position_covariance_m2", of_fix(&Fix::position_covariance_m2),
                             "(3, 3) covariance of the position [m^2, world].")
      .def_property_readonly("rms_px", of_fix(&Fix::rms_px),
                             "Root mean square residual of the inliers [px].")
      .def_property_readonly("candidates", of_fix(&Fix::candidates),
                             "List of Candidate: all poses that fit the inliers, best first.")
      .def_property_readonly("inliers", &inliers_of, "(n,) bool, True for each inlier.")
      .def_property_readonly("inlier_ratio", value_of(&RobustPose::inlier_ratio),
                             "Number of inliers over number of points.")
      .def_property_readonly("iterations", value_of(&RobustPose::iterations),
                             "Number of samples drawn.")
      .def_property_readonly("log10_false_alarms", value_of(&RobustPose::log10_false_alarms),
                             "Base-10 logarithm of the expected number of random poses as good.")
      .def("__repr__", [](const R& r) {
        return "<RobustPose: " + std::string(to_string(r.status)) + ", inlier ratio " +
               value_repr(r.value.inlier_ratio) + ", iterations " +
               std::to_string(r.value.iterations) + ">";
      });
}

auto robust_fields() {
  using O = RobustPoseOptions;
  return std::make_tuple(
      field("gate_sigmas", &O::gate_sigmas, "residual above which a point is an outlier [sigma]"),
      field("confidence", &O::confidence, "probability that a sample without outliers was drawn"),
      field("max_iterations", &O::max_iterations, "maximum number of samples"),
      field("max_false_alarms", &O::max_false_alarms,
            "maximum expected number of random poses as good as the best"),
      field("seed", &O::seed, "seed of the samples; the same seed gives the same result"),
      field("up_in_cam", &O::up_in_cam,
            "(3,) the world's Z in the camera's frame, unit, if known; samples then have two "
            "points"),
      field("up_sigma_rad", &O::up_sigma_rad,
            "standard deviation of up_in_cam about each axis [rad]"));
}

}  // namespace

void define_robust_pose(py::module_& m) {
  define_result_class(m);
  const auto fields = robust_fields();
  define_function(
      m, "robust_pose", fields,
      [](RobustPoseOptions options, const Rows3& points_in_world_m, const Rows2& points_px,
         const Camera& camera, double sigma_px) {
        options.sigma_px = sigma_px;
        py::gil_scoped_release unlocked;
        return robust_pose(points_in_world_m.transpose(), points_px.transpose(), camera, options);
      },
      py::arg("points_in_world_m"), py::arg("points_px"), py::arg("camera"),
      py::arg("sigma_px") = RobustPoseOptions{}.sigma_px, py::kw_only(),
      (R"(Computes the pose from point correspondences with many outliers.

Uses RANSAC with local optimisation, then least squares over the inliers. points_in_world_m: (n, 3).
points_px: (n, 2), their pixels. sigma_px: standard deviation of an inlier's pixel coordinates.
Returns: RobustPose. Its status is ambiguous if several poses fit the inliers equally well; no_pose
if random correspondences give as many inliers, or if the pose contradicts up_in_cam; too_few_lamps
for fewer than four points (three with up_in_cam); degenerate for points or inliers that coincide or
lie on a line; not_converged.
Raises: ValueError for counts that differ, numbers that are not finite, pixels outside the lens
model, or an option out of range.)" +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace occ::python
