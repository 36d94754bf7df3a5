// SPDX-License-Identifier: Apache-2.0
// Pose estimators for the closed loop that are written in Python.
#include "guide_estimator.hpp"

#include "fields.hpp"
#include "libocc/core/image.hpp"

namespace occ::python {
namespace {

/// Calls the methods of a Python object. The closed loop runs without the interpreter's lock.
class PythonEstimator : public LoopEstimator {
 public:
  explicit PythonEstimator(py::object object) : object_(std::move(object)) {}
  PythonEstimator(const PythonEstimator&) = delete;
  PythonEstimator& operator=(const PythonEstimator&) = delete;
  ~PythonEstimator() override {
    const py::gil_scoped_acquire locked;
    object_ = py::object();
  }

  void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) override {
    const py::gil_scoped_acquire locked;
    object_.attr("start")(time_s, pose, covariance);
  }
  void add_odometry(const PlanarOdometry& step) override {
    const py::gil_scoped_acquire locked;
    object_.attr("add_odometry")(step);
  }
  EstimatedPose add_image(const CapturedFrame& frame) override {
    const py::gil_scoped_acquire locked;
    return object_
        .attr("add_image")(to_numpy(to_grey(frame.image)), frame.captured_s, frame.now_s,
                           frame.cam_from_body)
        .cast<EstimatedPose>();
  }
  EstimatedPose at(double time_s) const override {
    const py::gil_scoped_acquire locked;
    return object_.attr("at")(time_s).cast<EstimatedPose>();
  }

 private:
  py::object object_;
};

}  // namespace

void define_estimated_pose(py::module_& m) {
  using E = EstimatedPose;
  define_documented<E>(
      m, "EstimatedPose", "Pose of the vehicle as the controller receives it.",
      std::make_tuple(
          field("time_s", &E::time_s, "time at which the pose holds [s]"),
          field("pose", &E::pose, "PlanarPose; the last known one while searching or lost"),
          field("covariance", &E::covariance, "(3, 3) of x, y and heading [m, m, rad]"),
          field("state", &E::state, "TrackerState; the vehicle stops without a pose"),
          field("reason", &E::reason, "explanation of the state; empty if normal"),
          field("lamps", &E::lamps, "lamps used for the pose of the last image"),
          field("nis", &E::nis, "normalised innovation squared of the last image"),
          field("nis_dof", &E::nis_dof, "its degrees of freedom; 0 without lamps"),
          field("relocated", &E::relocated, "the last image relocalised the vehicle"),
          field("protection_level_m", &E::protection_level_m,
                "bound of the horizontal error; inf: unknown [m]")));
}

MakeEstimator estimators_of(const std::optional<EstimatorFactory>& factory) {
  if (!factory) return {};
  return [factory](const Scene& scene) {
    const py::gil_scoped_acquire locked;
    return std::make_unique<PythonEstimator>((*factory)(scene));
  };
}

}  // namespace occ::python
