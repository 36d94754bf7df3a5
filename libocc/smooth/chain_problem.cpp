// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/chain_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/internal/independent_part.hpp"
#include "libocc/geometry/motion.hpp"

namespace occ::internal::smooth {
namespace {

template <int size>
using Rows = Eigen::Matrix<double, Eigen::Dynamic, size, 0, size, size>;

constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace

template <class Pose, int size>
Quadratic<Pose, size> quadratic(const Pose& about,
                                const Eigen::Matrix<double, size, size>& information,
                                const Eigen::Matrix<double, size, 1>& gradient) {
  using Square = Eigen::Matrix<double, size, size>;
  using Vector = Eigen::Matrix<double, size, 1>;
  // Scaled to a unit diagonal: the rank does not depend on the units.
  Vector unit = information.diagonal();
  for (int i = 0; i < size; ++i) unit[i] = unit[i] > 0 ? 1 / std::sqrt(unit[i]) : 0;
  const Square scaled = unit.asDiagonal() * (0.5 * (information + information.transpose())).eval() *
                        unit.asDiagonal();
  const auto eigen = core::symmetric_eigen<Square>(scaled);
  Quadratic<Pose, size> out{about, {}, Vector::Zero()};
  int first = size;
  while (first > 0 && eigen.eigenvalues()[first - 1] > 1e-13) --first;
  const int rows = size - first;
  out.root.resize(rows, size);
  Vector unscale = Vector::Zero();
  for (int i = 0; i < size; ++i) unscale[i] = unit[i] > 0 ? 1 / unit[i] : 0;
  for (int row = 0; row < rows; ++row) {
    const double value = eigen.eigenvalues()[first + row];
    const Vector axis = eigen.eigenvectors().col(first + row);
    out.root.row(row) = std::sqrt(value) * axis.transpose() * unscale.asDiagonal();
    const Vector along = unit.cwiseProduct(axis);
    out.offset -= along * (along.dot(gradient) / value);
  }
  return out;
}

Quadratic<Rigid3, 6> reading_of(const PoseObservation& seen, ErrorNumbers& numbers) {
  const auto part = internal::geometry::independent_part(seen);
  const PoseObservation of_body = part.observation.of_body();
  auto reading =
      quadratic<Rigid3, 6>(of_body.cam_from_world, of_body.information, of_body.gradient);
  std::vector<int> own;
  for (const int number : seen.systematic)
    own.push_back(numbers.of(ErrorNumbers::observation, {static_cast<double>(number)}, 0));
  reading.errors.add(own, adjoint(seen.cam_from_body).transpose() * part.by_systematic);
  return reading;
}

template <class Body>
double Chain<Body>::node_cost(std::size_t k, const Pose& pose, typename Body::Block* information,
                              typename Body::Part* gradient) const {
  const Node<Body>& node = nodes[k];
  const Rigid3 spatial = body.body_from_world(pose);
  Matrix6 information6 = Matrix6::Zero();
  Vector6 gradient6 = Vector6::Zero();
  double cost = 0;
  Eigen::Matrix<double, 2, 6> d_body;
  for (const View& view : node.views) {
    if (!view.errors.empty()) {
      const ViewFit fit = fitted_errors(view, spatial, sighting_corner);
      cost += fit.cost;
      information6 += fit.information;
      gradient6 += fit.gradient;
      continue;
    }
    for (std::size_t i = 0; i < view.root.size(); ++i) {
      if (view.aside[i]) continue;
      const auto residual =
          sighting_residual(view, i, spatial, information != nullptr ? &d_body : nullptr);
      if (!residual) return infinite;
      const double squared = residual->squaredNorm();
      cost += core::huber_loss(squared, sighting_corner);
      if (information == nullptr) continue;
      const double weight = core::huber_weight(squared, sighting_corner);
      information6.noalias() += weight * d_body.transpose() * d_body;
      gradient6.noalias() += weight * d_body.transpose() * *residual;
    }
  }
  for (const auto& reading : node.readings) {
    Matrix6 d_pose;
    const Vector6 delta = SpatialBody::difference(spatial, reading.about, &d_pose);
    const Eigen::VectorXd residual = reading.root * (delta - reading.offset);
    cost += 0.5 * residual.squaredNorm();
    if (information == nullptr) continue;
    const Rows<6> jacobian = reading.root * d_pose;
    information6.noalias() += jacobian.transpose() * jacobian;
    gradient6.noalias() += jacobian.transpose() * residual;
  }
  if (information != nullptr) {
    const typename Body::Lift lift = body.lift(pose);
    *information += lift.transpose() * information6 * lift;
    *gradient += lift.transpose() * gradient6;
  }
  for (const auto& prior : node.priors) {
    typename Body::Block d_pose;
    const typename Body::Part delta = Body::difference(pose, prior.about, &d_pose);
    const Eigen::VectorXd residual = prior.root * (delta - prior.offset);
    cost += 0.5 * residual.squaredNorm();
    if (information == nullptr) continue;
    const Rows<Body::size> jacobian = prior.root * d_pose;
    *information += jacobian.transpose() * jacobian;
    *gradient += jacobian.transpose() * residual;
  }
  return std::isfinite(cost) ? cost : infinite;
}

template <class Body>
double Chain<Body>::link_cost(std::size_t k, const std::vector<Pose>& poses) const {
  const Link<Body>& link = links[k];
  if (!link.exists) return 0;
  const typename Body::Part residual =
      link.root * Body::residual(poses[k], poses[k + 1], link.step, nullptr, nullptr);
  return core::huber_loss(residual.squaredNorm() / link.report.factor, corner_of(link));
}

template <class Body>
LinkTerms<Body> Chain<Body>::link_terms(std::size_t k, const std::vector<Pose>& poses) const {
  const Link<Body>& link = links[k];
  LinkTerms<Body> out;
  out.residual = Body::residual(poses[k], poses[k + 1], link.step, &out.d_from, &out.d_to);
  out.residual = (link.root * out.residual).eval();
  out.d_from = (link.root * out.d_from).eval();
  out.d_to = (link.root * out.d_to).eval();
  out.weight =
      core::huber_weight(out.residual.squaredNorm() / link.report.factor, corner_of(link)) /
      link.report.factor;
  return out;
}

template <class Body>
void Chain<Body>::add_link(std::size_t k, const std::vector<Pose>& poses,
                           ChainNormals<Body::size>& into) const {
  const LinkTerms<Body> t = link_terms(k, poses);
  into.from[k].noalias() += t.weight * t.d_from.transpose() * t.d_from;
  into.to[k].noalias() += t.weight * t.d_to.transpose() * t.d_to;
  into.coupling[k].noalias() += t.weight * t.d_from.transpose() * t.d_to;
  into.gradient[k].noalias() += t.weight * t.d_from.transpose() * t.residual;
  into.gradient[k + 1].noalias() += t.weight * t.d_to.transpose() * t.residual;
}

template <class Body>
double Chain<Body>::cost(const std::vector<Pose>& poses) const {
  double sum = 0;
  for (std::size_t k = 0; k < nodes.size() && sum < infinite; ++k) {
    sum += node_cost(k, poses[k], nullptr, nullptr);
    if (k + 1 < nodes.size()) sum += link_cost(k, poses);
  }
  return std::isfinite(sum) ? sum : infinite;
}

template <class Body>
ChainNormals<Body::size> Chain<Body>::normals(const std::vector<Pose>& poses) const {
  ChainNormals<Body::size> out(nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    node_cost(k, poses[k], &out.own[k], &out.gradient[k]);
    if (k + 1 < nodes.size() && links[k].exists) add_link(k, poses, out);
  }
  return out;
}

template <class Body>
bool Chain<Body>::set_aside(const std::vector<Pose>& poses) {
  bool changed = false;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Rigid3 spatial = body.body_from_world(poses[k]);
    for (View& view : nodes[k].views) changed = view.set_aside(spatial) || changed;
  }
  return changed;
}

template <class Body>
CommonErrors<Body::size> Chain<Body>::errors_at(std::size_t k, const Pose& pose) const {
  const Node<Body>& node = nodes[k];
  const Rigid3 spatial = body.body_from_world(pose);
  CommonErrors<6> errors;
  for (const View& view : node.views)
    if (!view.errors.empty()) errors.add(common_errors_of(view, spatial, sighting_corner));
  for (const auto& reading : node.readings) {
    if (reading.errors.empty()) continue;
    Matrix6 d_pose;
    SpatialBody::difference(spatial, reading.about, &d_pose);
    errors.add(reading.errors.mapped(d_pose));
  }
  CommonErrors<Body::size> out = errors.mapped(body.lift(pose));
  for (const auto& prior : node.priors) {
    if (prior.errors.empty()) continue;
    typename Body::Block d_pose;
    Body::difference(pose, prior.about, &d_pose);
    out.add(prior.errors.mapped(d_pose));
  }
  return out;
}

template <class Body>
bool Chain<Body>::has_errors() const {
  const auto any = [](const auto& terms) {
    return std::any_of(terms.begin(), terms.end(),
                       [](const auto& term) { return !term.errors.empty(); });
  };
  return std::any_of(nodes.begin(), nodes.end(), [&](const Node<Body>& node) {
    return any(node.views) || any(node.readings) || any(node.priors);
  });
}

template <class Body>
void Chain<Body>::set_velocities() {
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    Vector6 sum = Vector6::Zero();
    Matrix6 covariance = Matrix6::Zero();
    int count = 0;
    for (const std::size_t i : {k - 1, k}) {  // the links at both sides
      if (i >= links.size() || !links[i].report.odometry) continue;
      const Rigid3 motion = body.body_from_world(Body::after(Pose{}, links[i].step)) *
                            body.body_from_world(Pose{}).inverse();
      const double duration_s = nodes[i + 1].time_s - nodes[i].time_s;
      sum += velocity_between({}, motion, duration_s);
      const typename Body::Lift lift = body.lift(Pose{});
      covariance += lift * links[i].step.covariance * lift.transpose() / square(duration_s);
      ++count;
    }
    const double weight = 1.0 / std::max(1, count);
    const Matrix6 root = core::semidefinite_root(Matrix6(square(weight) * covariance));
    for (View& view : nodes[k].views) {
      view.velocity = weight * sum;
      view.velocity_root = root;
    }
  }
}

template <class Body>
std::vector<bool> Chain<Body>::linked() const {
  std::vector<bool> out;
  for (const auto& link : links) out.push_back(link.exists);
  return out;
}

template <class Body>
int Chain<Body>::rows() const {
  Eigen::Index rows = 0;
  for (const auto& node : nodes) {
    for (const View& view : node.views)
      rows += 2 * std::count(view.aside.begin(), view.aside.end(), false);
    for (const auto& reading : node.readings) rows += reading.root.rows();
    for (const auto& prior : node.priors) rows += prior.root.rows();
  }
  for (const auto& link : links) rows += link.exists ? Body::size : 0;
  return static_cast<int>(rows);
}

template <class Body>
Link<Body> made_link(const typename Body::Step& step, double from_s, double to_s, bool odometry,
                     const SmootherOptions& options) {
  using Block = typename Body::Block;
  Link<Body> link;
  link.exists = true;
  link.step = step;
  link.report.from_s = from_s;
  link.report.to_s = to_s;
  link.report.odometry = odometry;
  Block covariance = step.covariance;
  covariance.diagonal() +=
      Body::sigmas(options.min_odometry_sigma_m, options.min_odometry_sigma_rad).cwiseAbs2();
  const core::Cholesky<Block> cholesky(0.5 * (covariance + covariance.transpose()));
  require(cholesky.exists(), "odometry's covariance", step.covariance,
          "positive definite together with min_odometry_sigma_m, min_odometry_sigma_rad");
  link.root = cholesky.template solve_lower<Block>(Block::Identity());
  return link;
}

template <class Body>
Link<Body> walk_link(double from_s, double to_s, const SmootherOptions& options) {
  if (!std::isfinite(options.walk_m) || !std::isfinite(options.walk_rad)) {
    Link<Body> none;
    none.report.from_s = from_s;
    none.report.to_s = to_s;
    return none;
  }
  typename Body::Step stays;
  stays.covariance.diagonal() =
      Body::sigmas(options.walk_m, options.walk_rad).cwiseAbs2() * (to_s - from_s);
  return made_link<Body>(stays, from_s, to_s, false, options);
}

template struct Chain<SpatialBody>;
template struct Chain<PlanarBody>;
template Quadratic<Rigid3, 6> quadratic(const Rigid3&, const Matrix6&, const Vector6&);
template Quadratic<PlanarPose, 3> quadratic(const PlanarPose&, const Eigen::Matrix3d&,
                                            const Eigen::Vector3d&);
template Link<SpatialBody> made_link<SpatialBody>(const SpatialBody::Step&, double, double, bool,
                                                  const SmootherOptions&);
template Link<PlanarBody> made_link<PlanarBody>(const PlanarBody::Step&, double, double, bool,
                                                const SmootherOptions&);
template Link<SpatialBody> walk_link<SpatialBody>(double, double, const SmootherOptions&);
template Link<PlanarBody> walk_link<PlanarBody>(double, double, const SmootherOptions&);

}  // namespace occ::internal::smooth
