// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/explain.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <limits>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/renderer.hpp"

namespace occ {

using namespace internal::simulate;
namespace {

// Largest displacement of the solved position when each centroid moves by one pixel [m/px].
double position_gain(const Scene& scene, const Rigid3& pose) {
  constexpr double min_singular_value =
      1e-9;  // relative to the largest; below, the pose is undetermined
  Eigen::Matrix<double, Eigen::Dynamic, 6> rows(0, 6);
  for (const Lamp& lamp : scene.lamps) {
    const Eigen::Vector3d in_cam = pose * lamp.centre_m;
    Eigen::Matrix<double, 2, 3> d_px;
    const auto px = scene.camera.project(in_cam, &d_px);
    if (!px || !scene.camera.contains(*px)) continue;
    Eigen::Matrix<double, 3, 6> d_point;  // derivative by rotation and translation
    d_point << -skew(in_cam), Eigen::Matrix3d::Identity();
    rows.conservativeResize(rows.rows() + 2, 6);
    rows.bottomRows<2>() = d_px * d_point;
  }
  constexpr double undetermined = std::numeric_limits<double>::infinity();
  if (rows.rows() < 6) return undetermined;
  const auto svd =
      internal::core::jacobi_svd<Eigen::MatrixXd>(rows, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& values = svd.singularValues();
  if (!(values(5) > min_singular_value * values(0))) return undetermined;
  const Eigen::MatrixXd gain =
      svd.matrixV() * values.cwiseInverse().asDiagonal() * svd.matrixU().transpose();
  double sum = 0;
  for (Eigen::Index i = 0; i + 1 < gain.cols(); i += 2) {
    const Eigen::Matrix<double, 3, 2> lamp_gain = gain.block<3, 2>(3, i);
    sum += internal::core::jacobi_svd<Eigen::MatrixXd>(lamp_gain).singularValues()(0);
  }
  return sum;
}

double seconds(Renderer& renderer, const Rigid3& pose, const SimulateOptions& options,
               Rendered& out) {
  const auto begin = std::chrono::steady_clock::now();
  renderer.render(pose, options, out);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Fixes the use of every effect as planned, so that no time is spent on bounds.
Effects fixed(const Explanation& explanation, Effects effects) {
  for (const EffectPlan& plan : explanation.effects)
    effects.set(plan.effect, plan.applied ? Use::on : Use::off);
  return effects;
}

// Sets the use of one effect, and of effects that it requires or that require it.
void set_consistently(Effect changed, Use value, Effects& effects) {
  effects.set(changed, value);
  for (const EffectModel* model : effect_models()) {
    if (value == Use::off && model->required == changed) effects.set(model->effect, value);
    if (value == Use::on && model->required && model->effect == changed)
      effects.set(*model->required, value);
  }
}

// Times images of two scenes in turn, so that other load on the machine affects both alike.
class PairedTiming {
 public:
  PairedTiming(const Scene& a, const Scene& b) : renderers_{Renderer(a), Renderer(b)} {}

  std::array<double, 2> run(const Rigid3& pose, const SimulateOptions& options, int repetitions) {
    std::array<std::vector<double>, 2> times;
    for (int i = 0; i <= repetitions; ++i)
      for (std::size_t k = 0; k < 2; ++k) {
        const double time = seconds(renderers_[k], pose, options, out_[k]);
        if (i > 0) times[k].push_back(time);  // the first image computes tables
      }
    return {median(times[0]), median(times[1])};
  }

 private:
  std::array<Renderer, 2> renderers_;
  std::array<Rendered, 2> out_;
};

}  // namespace

Explanation explain(const Scene& given, const Rigid3& cam_from_world,
                    const SimulateOptions& options, int repetitions) {
  require(repetitions >= 0, "repetitions", repetitions, "at least 0");
  Explanation explanation;
  const RenderPlan plan = plan_render(given, cam_from_world, options);
  const double gain = position_gain(given, Rigid3::from_matrix(cam_from_world.matrix()));
  for (std::size_t i = 0; i < effect_count; ++i) {
    ExplainedEffect& effect = explanation.effects[i];
    static_cast<EffectPlan&>(effect) = plan.effects[i];
    effect.position_bound_m = effect.bound_px > 0 ? gain * effect.bound_px : 0;
  }
  if (repetitions == 0) return explanation;
  Scene scene = given;
  scene.effects = fixed(explanation, given.effects);
  explanation.render_s = PairedTiming(scene, scene).run(cam_from_world, options, repetitions)[0];
  for (ExplainedEffect& effect : explanation.effects) {
    if (!effect.called_for) continue;
    Scene with = scene, without = scene;
    set_consistently(effect.effect, Use::on, with.effects);
    set_consistently(effect.effect, Use::off, without.effects);
    const auto times = PairedTiming(with, without).run(cam_from_world, options, repetitions);
    effect.cost_s = times[0] - times[1];
  }
  return explanation;
}

}  // namespace occ
