// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_rim.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/rim_errors.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/refine/internal/rim_light.hpp"

namespace occ::internal::refine {
namespace {

using RimErrors = Eigen::Matrix<double, 5, 1>;

/// Chi-square of a rim point whose ray misses the lamp's plane or whose distance is undefined: that
/// of a residual of ten sigmas, so that a pose cannot gain by losing points.
constexpr double lost_chi2 = 100;

constexpr int residual_index = 7;  // in a column of rows_, after pose and growth

/// R with R R^T = S. The matrix is padded: its root has a column for each of its directions.
Eigen::Matrix<double, 5, 6> root_of(const RimErrorCovariance& covariance) {
  Matrix6 padded = Matrix6::Zero();
  padded.topLeftCorner<5, 5>() = covariance;
  return core::semidefinite_root(padded).transpose().topRows<5>();
}

/// Inverse of an information matrix that may be singular, e.g. of a single straight side.
Eigen::Matrix3d inverse_of(Eigen::Matrix3d information) {
  information.diagonal().array() += 1e-9 * information.trace() + std::numeric_limits<double>::min();
  return information.inverse();
}

/// Standard deviation estimated from the median of absolute values.
double scatter(std::vector<double> sizes) {
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / 0.6745;
}

}  // namespace

LampRim::LampRim(const LampObservation& lamp, const Observations& all, const Scene& scene,
                 double huber_sigma)
    : lamp_(lamp),
      points_(all.rim.data() + lamp.rim_begin),
      all_(all),
      scene_(scene),
      huber_sigma_(huber_sigma),
      next_unit_error_(lamp.unit_error) {
  if (has_errors()) common_root_ = root_of(lamp.common_covariance_px2);
  const auto count = static_cast<Eigen::Index>(lamp.rim_end - lamp.rim_begin);
  rows_.resize(rows, count);
  weighted_.resize(rows, count);
  weights_.setOnes(count);
}

LampInCam LampRim::lamp_at(const Rigid3& cam_from_world) const {
  const LampInCam lamp = lamp_in_cam(*lamp_.lamp, cam_from_world);
  if (!lamp_.errors) return lamp;
  return with_error(lamp, error_, cam_from_world);
}

/// If the errors of the camera are unknowns, derivatives by these and by the pose belong to the
/// point of the predicted rim instead of the measured one. Those would correlate with the noise of
/// the points: if a camera looks straight at a ceiling, so that the prior alone determines its
/// focal length, thousands of points would move that by many of its sigmas. Errors of the camera
/// move the image of the point by n . (d pixel / d errors) along the rim's normal n.
void LampRim::linearise_on_rim(Eigen::Index index, double distance_px, const LampInCam& lamp,
                               Eigen::Matrix<double, 1, 6>& d_lamp) {
  const RimObservation& point = points_[index];
  const RimPoint on_rim{point.px - distance_px * point.normal, point.normal};
  const std::optional<RimRay> ray = rim_ray(on_rim, scene_.camera);
  if (!ray || !rim_distance_px(lamp, *ray, &d_lamp)) return;
  const Eigen::Vector3d at = ray->origin + lamp.centre_m.norm() * ray->bearing.normalized();
  Eigen::Matrix<double, 2, 3> by_point;
  if (!scene_.camera.project(at, &by_point)) return;
  // The normal of the predicted rim, scaled to a distance of one pixel along the measured normal.
  Eigen::Vector2d normal =
      (by_point * by_point.transpose()).inverse() * by_point * d_lamp.tail<3>().transpose();
  normal /= normal.dot(point.normal);
  by_shared_.col(index).head(all_.shared_errors.camera_count()) =
      -point.inverse_sigma * all_.shared_errors.by_camera(scene_.camera, at).transpose() * normal;
}

/// The last estimate, moved to `state` along its derivatives. Far away it says nothing.
void LampRim::predict_errors(const State& state) {
  if (estimate_.by_state.size() == 0) return;
  constexpr double max_motion_px = 3;
  const Rigid3& before = estimate_.state.cam_from_world;
  const Eigen::Vector3d centre_m = state.cam_from_world * lamp_.lamp->centre_m;
  Eigen::VectorXd motion(estimate_.by_state.cols());
  motion.head<3>() = so3_log(state.cam_from_world.rotation * before.rotation.transpose());
  motion.segment<3>(3) = centre_m - before * lamp_.lamp->centre_m;
  motion[6] = state.growth_px - estimate_.state.growth_px;
  motion[residual_index] = 1;
  motion.tail(motion.size() - 8) = all_.shared_shift;
  const double motion_m =
      motion.segment<3>(3).norm() + lamp_.lamp->reach_m() * motion.head<3>().norm();
  if (motion_m * scene_.camera.fx_px() < max_motion_px * centre_m.norm())
    set_estimate(estimate_.by_state * motion);
}

int LampRim::linearise(const State& state, const Eigen::Vector3d& pivot) {
  if (lamp_.errors) predict_errors(state);
  linearise_rim(state, pivot);
  if (lamp_.errors) follow_errors(state, pivot, nullptr);
  return lost_;
}

/// The most probable errors that move the image of the lamp onto the blob: its centre to the
/// centroid, or the predicted rim to the measured one, of which the image may show an arc only.
void LampRim::displace(const State& state, const Eigen::Vector3d& pivot) {
  constexpr int max_passes = 3;  // a long way from an arc is not linear
  next_unit_error_.setZero();
  Eigen::Matrix<double, 2, 3> by_shift;
  const auto px = scene_.camera.project(state.cam_from_world * lamp_.lamp->centre_m, &by_shift);
  if (!px) return;
  const Eigen::Matrix<double, 2, 3> by_errors =
      by_shift * state.cam_from_world.rotation * lamp_.errors->position_m.asDiagonal();
  const auto move = [&](const Eigen::Vector2d& off_px, Eigen::Matrix2d covariance) {
    covariance += by_errors * by_errors.transpose();
    LampError unit = LampError::Zero();
    unit.segment<3>(3) = by_errors.transpose() * covariance.inverse() * off_px;
    set_estimate(unit);
  };
  if (lamp_.has_centroid) {
    move(scene_.camera.difference_px(lamp_.blob->centroid_px, *px),
         lamp_.centroid_information.inverse());
    return;
  }
  for (int pass = 0; pass < max_passes; ++pass) {
    linearise_rim(state, pivot);
    const auto normals = rows_.middleRows<2>(9);  // over the standard deviations
    constexpr double information_per_px2 = 1e-6;  // where all points are lost
    const Eigen::Matrix2d spread =
        normals * normals.transpose() + information_per_px2 * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d covariance_px2 = spread.inverse();
    const Eigen::Vector2d left_px = covariance_px2 * normals * seen_.transpose();
    move(by_errors * unit_error_.segment<3>(3) + left_px, covariance_px2);
  }
}

/// Repeats the linearisation at the estimated errors of the lamp until they are stable, with the
/// given weights or with those of the residuals.
void LampRim::follow_errors(const State& state, const Eigen::Vector3d& pivot,
                            const Eigen::VectorXd* weights) {
  if (is_stable(state, pivot, weights)) return;
  // The last estimate is too far from that of this state.
  displace(state, pivot);
  linearise_rim(state, pivot);
  is_stable(state, pivot, weights);
}

/// False if the estimates are not stable after some passes, or at a limit, or if many rays miss the
/// lamp there.
bool LampRim::is_stable(const State& state, const Eigen::Vector3d& pivot,
                        const Eigen::VectorXd* weights) {
  constexpr int max_passes = 8;
  // The estimates of the shared errors converge together with those of the lamps.
  const double stable_px = all_.shared_errors.count() > 0 ? 1e-4 : 1e-3;
  const double max_lost = 0.1 * static_cast<double>(rows_.cols());
  const double px_per_m =
      scene_.camera.fx_px() / (state.cam_from_world * lamp_.lamp->centre_m).norm();
  for (int pass = 0; pass < max_passes; ++pass) {
    if (weights)
      weights_ = (weights_.array() > 0).select(*weights, 0);
    else
      weigh_points();
    sums_ = eliminate(weighted_products());
    const LampError step = lamp_.errors->scaled(next_unit_error_) - error_;
    const double step_m = step.segment<3>(3).norm() +
                          lamp_.lamp->reach_m() * (step.head<3>().norm() + std::abs(step[6]));
    if (step_m * px_per_m < stable_px) return lost_ <= max_lost && is_within_limits();
    linearise_rim(state, pivot);
  }
  return false;
}

int LampRim::linearise_rim(const State& state, const Eigen::Vector3d& pivot) {
  sums_.reset();
  estimate_.state = state;
  unit_error_ = next_unit_error_;
  if (lamp_.errors) error_ = lamp_.errors->scaled(unit_error_);
  const LampInCam in_cam = lamp_at(state.cam_from_world);
  if (lamp_.errors)
    unit_motion_ = unit_motion(*lamp_.errors, in_cam, error_[6], state.cam_from_world);
  const RimLight light(*lamp_.lamp, *lamp_.blob, state.cam_from_world, scene_);
  const double growth_slope = all_.grows(lamp_) ? -1 : 0;
  arm_ = in_cam.centre_m - pivot;
  lost_ = 0;
  by_shared_.setZero(all_.shared_errors.count(), rows_.cols());
  Eigen::Matrix<double, 1, 6> d_lamp;
  for (Eigen::Index i = 0; i < rows_.cols(); ++i) {
    const std::optional<double> distance = rim_distance_px(in_cam, points_[i].ray, &d_lamp);
    if (!distance) {
      rows_.col(i).setZero();
      weights_[i] = 0;
      ++lost_;
      continue;
    }
    if (weights_[i] == 0) weights_[i] = 1;
    if (all_.shared_errors.camera_count() > 0)
      linearise_on_rim(i, *distance + lamp_.moved_px, in_cam, d_lamp);
    const Eigen::Vector2d& normal = points_[i].normal;
    const double off = *distance + lamp_.moved_px + growth_slope * state.growth_px -
                       normal.dot(light.displacement_px(points_[i].px, normal));
    rows_.col(i) << d_lamp.transpose(), growth_slope, off, core::common_rim_errors(normal);
    rows_.col(i) *= points_[i].inverse_sigma;
  }
  if (all_.shared_errors.count() > 0) {
    // As the lamp's own errors, which are eliminated with the same rows.
    const Eigen::Matrix3Xd motion = all_.shared_errors.motion(*lamp_.lamp, state.cam_from_world);
    by_shared_.bottomRows(motion.cols()) = motion.transpose() * rows_.middleRows<3>(3);
  }
  if (has_errors()) step_back();
  return lost_;
}

/// r = r(e0) - (d r / d e) e0 for the errors of the lamp and the shared ones.
void LampRim::step_back() {
  seen_ = rows_.row(residual_index);
  back_.setZero(rows_.cols());
  if (lamp_.errors)
    back_ += unit_error_.transpose() * unit_motion_.transpose() * rows_.topRows<6>();
  if (by_shared_.size() > 0) back_ += all_.shared_shift.transpose() * by_shared_;
  rows_.row(residual_index) -= back_;
}

void LampRim::weigh_points() {
  const Eigen::RowVectorXd residuals =
      has_errors() ? seen_ : Eigen::RowVectorXd(rows_.row(residual_index));
  const auto size_and_place = rows_.middleRows<3>(8);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const Eigen::Vector3d weighted = weights_[i] * size_and_place.col(i);
    spread += weighted * size_and_place.col(i).transpose();
    pull += weighted * residuals[i];
  }
  const Eigen::Vector3d common = inverse_of(spread) * pull;
  std::vector<double> left(static_cast<std::size_t>(weights_.size()));
  for (std::size_t i = 0; i < left.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    left[i] = std::abs(residuals[k] - size_and_place.col(k).dot(common));
  }
  threshold_ = huber_sigma_ * std::max(1.0, scatter(left));
  for (std::size_t i = 0; i < left.size(); ++i) {
    double& weight = weights_[static_cast<Eigen::Index>(i)];
    if (weight > 0) weight = core::huber_weight(left[i] * left[i], threshold_);
  }
}

LampRim::Products LampRim::weighted_products() {
  weighted_.noalias() = rows_ * weights_.asDiagonal();
  Products products;
  core::product_transposed(weighted_, rows_, products);
  return products;
}

/// Sums over pose, growth, residual and shared errors without the common errors of the rim.
Eigen::MatrixXd LampRim::eliminate(const Products& products) {
  const Eigen::Index errors = by_shared_.rows();
  Eigen::MatrixXd sums(8 + errors, 8 + errors);
  sums.topLeftCorner<8, 8>() = products.topLeftCorner<8, 8>();
  constexpr int own = commons + 6;  // common errors, then those of the lamp's pose
  Eigen::Matrix<double, own, Eigen::Dynamic> along(own, 8 + errors);
  along.topLeftCorner<commons, 8>() = products.bottomLeftCorner<commons, 8>();
  along.bottomLeftCorner<6, 8>() = products.topLeftCorner<6, 8>();
  Eigen::Matrix<double, own, own> spread;
  spread << products.bottomRightCorner<commons, commons>(), products.bottomLeftCorner<commons, 6>(),
      products.topRightCorner<6, commons>(), products.topLeftCorner<6, 6>();
  if (errors > 0) {
    const Eigen::MatrixXd cross = core::product_transposed(by_shared_, weighted_);
    const Eigen::MatrixXd weighted = by_shared_ * weights_.asDiagonal();
    sums.bottomLeftCorner(errors, 8) = cross.leftCols<8>();
    sums.topRightCorner(8, errors) = cross.leftCols<8>().transpose();
    sums.bottomRightCorner(errors, errors) = core::product_transposed(weighted, by_shared_);
    along.topRightCorner(commons, errors) = cross.rightCols<commons>().transpose();
    along.bottomRightCorner(6, errors) = cross.leftCols<6>().transpose();
  }
  constexpr int units = 6 + 7;  // the same in units of their standard deviations
  Eigen::Matrix<double, own, units> root = Eigen::Matrix<double, own, units>::Zero();
  root.topLeftCorner<commons, 6>() = common_root_;
  if (lamp_.errors) root.bottomRightCorner<6, 7>() = unit_motion_;
  const Eigen::MatrixXd whitened = core::transposed_product(root, along);
  Eigen::MatrixXd information = core::product(core::transposed_product(root, spread), root);
  information.diagonal().array() += 1;
  const Eigen::MatrixXd estimates = core::solve_llt(information, whitened);
  sums -= core::transposed_product(whitened, estimates);
  if (lamp_.errors) {
    estimate_.by_state = -estimates.bottomRows<7>();
    LampError unit = estimate_.by_state.col(residual_index);
    if (errors > 0) unit += estimate_.by_state.rightCols(errors) * all_.shared_shift;
    set_estimate(unit);
    if (next_unit_error_ != unit) {
      Eigen::VectorXd pull = whitened.col(residual_index);
      if (errors > 0) pull += whitened.rightCols(errors) * all_.shared_shift;
      set_estimate(within_limits(unit, information, pull));
    }
  }
  return sums;
}

/// Limits each error to six sigma, beyond which the rim would be linearised where the lamp is not.
/// A shift is limited by the largest sigma of the axes: a small one, as of a known height, would
/// keep the lamp from its image while the pose is not yet right.
LampError LampRim::limits() const {
  constexpr double max_sigmas = 6;
  LampError limits = LampError::Constant(max_sigmas);
  const Eigen::Vector3d& sigmas_m = lamp_.errors->position_m;
  for (int axis = 0; axis < 3; ++axis)
    if (sigmas_m[axis] > 0) limits[3 + axis] *= sigmas_m.maxCoeff() / sigmas_m[axis];
  return limits;
}

/// The errors of the lamp within their limits: the last seven values of the minimum of
/// x^T I x / 2 + p^T x, which are `unit` without limits. Values at a limit are held there, since
/// the others follow from them: a lamp that is moved less far away than it should be would appear
/// beside its image.
LampError LampRim::within_limits(LampError unit, Eigen::MatrixXd information,
                                 Eigen::VectorXd pull) const {
  constexpr int max_rounds = 2;
  const LampError limit = limits();
  for (int round = 0; round < max_rounds; ++round) {
    const LampError held = unit.cwiseMax(-limit).cwiseMin(limit);
    if (held == unit) break;
    for (int k = 0; k < 7; ++k) {
      if (held[k] == unit[k]) continue;
      const Eigen::Index i = pull.size() - 7 + k;
      pull += information.col(i) * held[k];
      information.row(i).setZero();
      information.col(i).setZero();
      information(i, i) = 1;
      pull[i] = -held[k];
    }
    unit = -core::solve_llt(information, pull).tail<7>();
  }
  return unit;
}

bool LampRim::is_within_limits() const {
  return (next_unit_error_.array().abs() < limits().array()).all();
}

void LampRim::set_estimate(const LampError& unit) {
  const LampError limit = limits();
  next_unit_error_ = unit.cwiseMax(-limit).cwiseMin(limit);
}

void LampRim::add_to(PoseNormalEquations& normal, SharedSums* shared) {
  if (weights_.size() == 0) return;
  if (sums_) {  // of the last pass of linearise()
    add_with_errors(*sums_, normal, shared);
    return;
  }
  weigh_points();
  const Products products = weighted_products();
  if (has_errors()) {
    add_with_errors(eliminate(products), normal, shared);
    return;
  }
  Matrix8 sum = products.topLeftCorner<8, 8>();  // gradient and chi2 in the last column
  const Eigen::Matrix<double, commons, 8> along = products.bottomLeftCorner<commons, 8>();
  const RimErrorCovariance spread = products.bottomRightCorner<commons, commons>();

  const RimErrorCovariance& covariance = lamp_.common_covariance_px2;
  const RimErrorCovariance damped = RimErrorCovariance::Identity() + spread * covariance;
  common_gain_ = covariance * core::inverse(damped);
  const Eigen::Matrix<double, commons, 8> gained = common_gain_ * along;
  sum -= along.transpose().lazyProduct(gained);

  shift_information_ = sum.block<3, 3>(3, 3);
  shift_gradient_ = sum.block<3, 1>(3, residual_index);
  // A rotation w of the pose about the pivot rotates the lamp and moves its centre by w x arm.
  sum.leftCols<3>() -= sum.middleCols<3>(3) * skew(arm_);
  sum.topRows<3>() += skew(arm_) * sum.middleRows<3>(3);
  const double chi2 = sum(residual_index, residual_index) + lost_chi2 * lost_;
  normal.information.topLeftCorner<7, 7>() += sum.topLeftCorner<7, 7>();
  normal.gradient.head<7>() += sum.col(residual_index).head<7>();
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2 + robust_excess();
}

void LampRim::add_with_errors(Eigen::MatrixXd sums, PoseNormalEquations& normal,
                              SharedSums* shared) {
  const Eigen::Index errors = by_shared_.rows();
  shift_information_ = sums.block<3, 3>(3, 3);
  shift_gradient_ = sums.block<3, 1>(3, residual_index);
  if (errors > 0) shift_gradient_ += sums.block(3, 8, 3, errors) * all_.shared_shift;
  const Eigen::Matrix3d arm = skew(arm_);
  sums.leftCols<3>() -= (sums.middleCols<3>(3) * arm).eval();
  sums.topRows<3>() += (arm * sums.middleRows<3>(3)).eval();
  const double chi2 = sums(residual_index, residual_index) + lost_chi2 * lost_;
  normal.information.topLeftCorner<7, 7>() += sums.topLeftCorner<7, 7>();
  normal.gradient.head<7>() += sums.col(residual_index).head<7>();
  normal.chi2 += chi2;
  normal.robust_chi2 += chi2 + robust_excess();
  if (!shared) return;
  shared->mixed.topRows<7>() += sums.topRightCorner(7, errors);
  shared->information += sums.bottomRightCorner(errors, errors);
  shared->gradient += sums.col(residual_index).tail(errors);
}

double LampRim::own_chi2() const {
  return shift_gradient_.dot(inverse_of(shift_information_) * shift_gradient_);
}

/// Sum of 2 rho(e) - w e^2 over the points, with Huber's loss rho and |e| = k / w where w < 1.
double LampRim::robust_excess() const {
  double sum = 0;
  for (const double weight : weights_) {
    if (weight > 0 && weight < 1) sum += threshold_ * threshold_ * (1 - weight) / weight;
  }
  return sum;
}

double LampRim::chi2(const State& state, Eigen::VectorXd* by_shared) {
  if (has_errors()) return chi2_with_errors(state, by_shared);
  const LampInCam in_cam = lamp_in_cam(*lamp_.lamp, state.cam_from_world);
  const RimLight light(*lamp_.lamp, *lamp_.blob, state.cam_from_world, scene_);
  const double growth_px = all_.grows(lamp_) ? state.growth_px : 0;
  double sum = 0, lost = 0;
  RimErrors pull = RimErrors::Zero();
  for (Eigen::Index i = 0; i < weights_.size(); ++i) {
    const std::optional<double> distance =
        weights_[i] > 0 ? rim_distance_px(in_cam, points_[i].ray) : std::nullopt;
    if (!distance) {
      lost += lost_chi2;
      continue;
    }
    const Eigen::Vector2d& normal = points_[i].normal;
    const double off = *distance + lamp_.moved_px - growth_px -
                       normal.dot(light.displacement_px(points_[i].px, normal));
    const double residual = off * points_[i].inverse_sigma;
    sum += weights_[i] * residual * residual;
    pull += weights_[i] * residual * points_[i].inverse_sigma * core::common_rim_errors(normal);
  }
  return sum - pull.dot(common_gain_ * pull) + lost;
}

/// The errors of the lamp follow the pose: they are estimated anew.
double LampRim::chi2_with_errors(const State& state, Eigen::VectorXd* by_shared) {
  const Eigen::VectorXd weights = weights_;
  const LampError estimate = next_unit_error_;
  const Eigen::Vector3d anywhere = Eigen::Vector3d::Zero();  // the pivot has no effect on chi2
  if (lamp_.errors) predict_errors(state);
  linearise_rim(state, anywhere);
  if (lamp_.errors) follow_errors(state, anywhere, &weights);
  if (!sums_) {
    weights_ = (weights_.array() > 0).select(weights, 0);
    sums_ = eliminate(weighted_products());
  }
  const Eigen::MatrixXd sums = *std::exchange(sums_, std::nullopt);
  weights_ = weights;
  next_unit_error_ = estimate;
  if (by_shared) *by_shared += sums.col(residual_index).tail(by_shared->size());
  return sums(residual_index, residual_index) + lost_chi2 * lost_;
}

}  // namespace occ::internal::refine
