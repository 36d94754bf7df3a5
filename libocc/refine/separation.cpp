// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/separation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"

namespace occ {

namespace core = internal::core;
namespace {

/// Limits the number of sets of up to three units to 298.
constexpr std::size_t max_monitored_units = 12;

/// Smallest axis of the ellipse of a separation, relative to its largest and absolute: separations
/// across a narrow ellipse are rounding and second-order effects.
constexpr double min_axis = 0.01, min_axis_m = 1e-9;

/// Information, relative to that of all lamps, below which a direction is undetermined.
constexpr double singular = 1e-9;

double max_eigenvalue(const Eigen::Matrix2d& a) {
  return std::max(0.0, core::symmetric_eigenvalues(a)[1]);
}

/// Variance along the vertical, and the largest one along a horizontal direction.
struct Variances {
  double horizontal = 0, vertical = 0;

  Variances() = default;
  explicit Variances(const Eigen::Matrix3d& covariance)
      : horizontal(max_eigenvalue(covariance.topLeftCorner<2, 2>())),
        vertical(std::max(0.0, covariance(2, 2))) {}
};

/// Lamps that are faulty together, with the normal equations whitened by those of all lamps.
struct Unit {
  std::vector<int> lamps;
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

/// Position without a set of faulty units.
struct Subset {
  double probability = 1;
  Eigen::Matrix3d covariance;
  Eigen::Vector3d separation;
  std::vector<std::size_t> units;
};

/// The model in unknowns whose information from all lamps is the identity.
class Whitened {
 public:
  Whitened(const SeparationModel& model, std::size_t max_units) {
    Eigen::MatrixXd all = model.prior_information;
    for (const LampEquations& lamp : model.lamps) all += lamp.information;
    const core::Cholesky<Eigen::MatrixXd> root(all);
    is_determined_ = root.exists();
    if (!is_determined_) return;
    jacobian_ = root.solve_lower<Eigen::MatrixXd>(model.position_jacobian.transpose());
    units_.resize(std::min(max_units, model.lamps.size()));
    for (std::size_t i = 0; i < model.lamps.size(); ++i) {
      Unit& unit = units_[i % units_.size()];
      const Eigen::MatrixXd half = root.solve_lower(model.lamps[i].information).transpose();
      const Eigen::MatrixXd information = root.solve_lower(half);
      const Eigen::VectorXd gradient = root.solve_lower(model.lamps[i].gradient);
      unit.information = unit.lamps.empty() ? information : unit.information + information;
      unit.gradient = unit.lamps.empty() ? gradient : unit.gradient + gradient;
      unit.lamps.push_back(model.lamps[i].lamp);
    }
  }

  bool is_determined() const { return is_determined_; }
  const std::vector<Unit>& units() const { return units_; }
  Eigen::Matrix3d covariance() const { return jacobian_.transpose().lazyProduct(jacobian_); }

  /// False if the other units do not determine the pose.
  bool leave_out(Subset& set) {
    left_.setIdentity(jacobian_.rows(), jacobian_.rows());
    right_.resize(jacobian_.rows(), 4);
    right_.leftCols<3>() = jacobian_;
    right_.col(3).setZero();
    for (const std::size_t unit : set.units) {
      left_ -= units_[unit].information;
      right_.col(3) += units_[unit].gradient;
    }
    if (!core::cholesky_in_place(left_)) return false;
    if (!(left_.diagonal().minCoeff() > std::sqrt(singular))) return false;
    core::solve_lower_in_place(left_, right_);
    const auto shifts = right_.leftCols<3>();
    set.covariance = shifts.transpose().lazyProduct(shifts);
    set.separation = shifts.transpose().lazyProduct(right_.col(3));
    return true;
  }

 private:
  bool is_determined_ = false;
  std::vector<Unit> units_;
  Eigen::MatrixXd jacobian_;  // d position / d whitened unknowns, transposed
  Eigen::MatrixXd left_, right_;
};

/// Bound of the probability of more than `faults` faulty units of the largest probability.
double probability_beyond(std::size_t faults, std::size_t units, double probability) {
  double sum = 0, combinations = 1;
  for (std::size_t k = 1; k <= units; ++k) {
    combinations *= static_cast<double>(units - k + 1) / static_cast<double>(k);
    if (k > faults) sum += combinations * std::pow(probability, static_cast<double>(k));
  }
  return sum;
}

/// Sets of faulty units, and the probabilities of those that are not monitored: with more faulty
/// units, and without a pose from the others.
struct Hypotheses {
  std::vector<Subset> sets;
  double beyond = 0, undetermined = 0;
};

void add_sets(Whitened& model, double fault_probability, std::size_t faults, std::size_t first,
              const Subset& base, Hypotheses& out) {
  for (std::size_t i = first; i < model.units().size(); ++i) {
    Subset set = base;
    set.units.push_back(i);
    set.probability *= fault_probability * static_cast<double>(model.units()[i].lamps.size());
    const bool is_monitored = model.leave_out(set);
    if (!is_monitored) out.undetermined += set.probability;
    if (set.units.size() < faults) add_sets(model, fault_probability, faults, i + 1, set, out);
    if (is_monitored) out.sets.push_back(std::move(set));
  }
}

Hypotheses hypotheses(Whitened& model, double fault_probability, int excluded, double risk) {
  Hypotheses out;
  const std::size_t units = model.units().size();
  const double largest =
      fault_probability * static_cast<double>(units ? model.units().front().lamps.size() : 0);
  const std::size_t all = units + static_cast<std::size_t>(excluded);
  std::size_t faults = std::min<std::size_t>(2, units);
  while (faults < units && probability_beyond(faults, all, largest) > risk / 2) ++faults;
  out.beyond = probability_beyond(faults, all, largest);
  add_sets(model, fault_probability, faults, 0, {}, out);
  return out;
}

double normal_tail(double x) { return 0.5 * std::erfc(x * std::sqrt(0.5)); }
double length_tail(double x) { return x > 0 ? std::exp(-0.5 * x * x) : 1; }

/// One term p tail((level - threshold) / sigma) of the sum that a level solves.
struct Term {
  double probability, threshold, sigma;
};

/// Level at which the sum of the terms is `risk`: secants of its logarithm within a bracket.
template <class Tail>
double solve_level(const std::vector<Term>& terms, double risk, Tail tail) {
  const auto log_excess = [&](double level) {
    double sum = 0;
    for (const Term& term : terms)
      sum += term.probability * tail((level - term.threshold) / term.sigma);
    return std::log(std::max(sum, 1e-300) / risk);
  };
  double low = 0, high = terms.front().sigma, above = log_excess(low);
  if (!(above > 0)) return 0;
  double below = log_excess(high);
  while (below > 0) {
    low = high;
    above = below;
    high *= 2;
    below = log_excess(high);
  }
  constexpr double tolerance = 1e-4;
  constexpr int max_steps = 60;
  for (int i = 0; i < max_steps && high - low > tolerance * high; ++i) {
    // The sum of tails is log-concave up to its bends, where the middle is better.
    const double secant = low + (high - low) * above / (above - below);
    const double next = i % 3 == 2 ? 0.5 * (low + high) : secant;
    const double excess = log_excess(next);
    if (excess > 0) {
      low = next;
      above = excess;
    } else {
      high = next;
      below = excess;
    }
  }
  return high;
}

/// Second-order part of the variances of the position of a subset.
class SecondOrder {
 public:
  SecondOrder(const SeparationModel& model, const Eigen::Matrix3d& linear)
      : excess_(Eigen::Matrix3d(model.position_covariance_m2 - model.variance_factor * linear)),
        trace_(linear.trace()) {}

  Variances of(const Eigen::Matrix3d& linear, double variance_factor) const {
    const double ratio = linear.trace() / trace_;
    Variances variances(Eigen::Matrix3d(variance_factor * linear));
    variances.horizontal += ratio * ratio * excess_.horizontal;
    variances.vertical += ratio * ratio * excess_.vertical;
    return variances;
  }

 private:
  Variances excess_;
  double trace_;
};

std::string ids_text(const std::vector<int>& ids) {
  std::ostringstream text;
  for (std::size_t i = 0; i < ids.size(); ++i) text << (i > 0 ? ", " : "") << ids[i];
  return text.str();
}

double combinations(std::size_t n, int k) {
  double product = 1;
  for (int i = 1; i <= k; ++i) product *= static_cast<double>(n + 1) / i - 1;
  return product;
}

/// Share of the risk of the sets of lamps that are in use.
double share_of(const SeparationModel& model) {
  constexpr double half = 0.5;
  if (model.excluded == 0) return half;
  const std::size_t all = model.lamps.size() + static_cast<std::size_t>(model.excluded);
  return half / combinations(all, model.excluded);
}

/// Thresholds of the separations of this number of sets, in sigmas. The horizontal separation is
/// tested by its ellipse, the largest axis of which bounds its length.
class Thresholds {
 public:
  Thresholds(double continuity_risk, std::size_t sets) {
    const auto count = static_cast<double>(std::max<std::size_t>(1, sets));
    const double share = continuity_risk / (2 * count);  // of one set and one of the two levels
    horizontal_ = -2 * std::log(share);
    vertical_ = normal_quantile(share / 2) * normal_quantile(share / 2);
  }

  double horizontal_m(const Variances& separation) const {
    return std::sqrt(horizontal_ * separation.horizontal);
  }
  double vertical_m(const Variances& separation) const {
    return std::sqrt(vertical_ * separation.vertical);
  }

  /// Separation over its threshold, the larger of the horizontal and the vertical one.
  double excess(const Eigen::Vector3d& separation, const Eigen::Matrix3d& covariance) const {
    Eigen::Matrix2d ellipse = covariance.topLeftCorner<2, 2>();
    ellipse.diagonal().array() +=
        min_axis * min_axis * max_eigenvalue(ellipse) + min_axis_m * min_axis_m;
    const Eigen::Vector2d level = separation.head<2>();
    const double horizontal = level.dot(ellipse.inverse() * level) / horizontal_;
    const double vertical = separation.z() * separation.z() /
                            (vertical_ * std::max(covariance(2, 2), min_axis_m * min_axis_m));
    return std::sqrt(std::max(horizontal, vertical));
  }

 private:
  double horizontal_, vertical_;
};

/// Terms of both levels, and the largest separation over its threshold.
struct Levels {
  std::vector<Term> horizontal, vertical;
  double largest = 0;
  const Subset* contradicting = nullptr;
};

Levels levels_of(const SeparationModel& model, const Whitened& whitened,
                 const Hypotheses& hypotheses, double continuity_risk) {
  const Eigen::Matrix3d linear = whitened.covariance();
  const SecondOrder second_order(model, linear);
  const Thresholds thresholds(continuity_risk, hypotheses.sets.size());
  Levels levels;
  const auto add = [&](double probability, const Variances& separation, const Variances& own) {
    levels.horizontal.push_back(
        {probability, thresholds.horizontal_m(separation), std::sqrt(own.horizontal)});
    levels.vertical.push_back(
        {probability, thresholds.vertical_m(separation), std::sqrt(own.vertical)});
  };
  add(1, {}, second_order.of(linear, model.variance_factor));
  levels.vertical.front().probability = 2;
  for (const Subset& set : hypotheses.sets) {
    const Eigen::Matrix3d separation = model.variance_factor * (set.covariance - linear);
    add(set.probability, Variances(separation),
        second_order.of(set.covariance, model.variance_factor));
    const double over = thresholds.excess(set.separation, separation);
    if (over <= levels.largest) continue;
    levels.largest = over;
    levels.contradicting = &set;
  }
  return levels;
}

std::string unmonitored_message(const ProtectionLevel& level, double min_risk, std::size_t lamps) {
  std::ostringstream text;
  text.precision(2);
  text << "with " << lamps << " lamps, faults of probability " << level.unmonitored
       << " are not monitored; the risk must exceed " << min_risk
       << ", or more lamps must be in view";
  return text.str();
}

}  // namespace

Result<ProtectionLevel> protection_level(const SeparationModel& model, double risk,
                                         double continuity_risk, double assignment_risk) {
  const auto check = [](double value, const char* name) {
    require(value > 0 && value < 1, name, value, "between 0 and 1");
  };
  check(risk, "risk");
  check(continuity_risk, "continuity_risk");
  check(model.fault_probability, "fault_probability");
  require(assignment_risk >= 0 && assignment_risk <= 1, "assignment_risk", assignment_risk,
          "between 0 and 1");
  Result<ProtectionLevel> result;
  ProtectionLevel& level = result.value;
  level.risk = risk;
  level.unmonitored = 1;
  result.status = Status::too_few_lamps;
  Whitened whitened(model, max_monitored_units);
  if (model.lamps.empty() || !whitened.is_determined()) {
    result.message = "no lamps determine the pose";
    return result;
  }
  const double share = share_of(model);
  const Hypotheses found = hypotheses(whitened, model.fault_probability, model.excluded, risk);
  level.hypotheses = static_cast<int>(found.sets.size());
  level.unmonitored = std::min(1.0, found.beyond + found.undetermined + assignment_risk);
  const Levels levels = levels_of(model, whitened, found, continuity_risk);
  if (levels.largest > 1) {
    for (const std::size_t unit : levels.contradicting->units)
      for (const int lamp : whitened.units()[unit].lamps) level.contradicting_lamps.push_back(lamp);
    std::sort(level.contradicting_lamps.begin(), level.contradicting_lamps.end());
    std::ostringstream text;
    text.precision(2);
    text << "the position without lamps " << ids_text(level.contradicting_lamps) << " differs by "
         << 1e3 * levels.contradicting->separation.norm() << " mm, " << levels.largest
         << " times the threshold";
    result.status = Status::no_pose;
    result.message = text.str();
    return result;
  }
  const double min_risk = found.beyond + assignment_risk + found.undetermined / share;
  const double left = share * (risk - min_risk);
  if (!(left > 0)) {
    result.message = unmonitored_message(level, min_risk, model.lamps.size());
    return result;
  }
  result.status = Status::ok;
  level.horizontal_m = solve_level(levels.horizontal, left, length_tail);
  level.vertical_m = solve_level(levels.vertical, left, normal_tail);
  return result;
}

std::vector<int> separated_lamps(const SeparationModel& model, double continuity_risk) {
  Whitened whitened(model, model.lamps.size());
  if (model.lamps.empty() || !whitened.is_determined()) return {};
  const Eigen::Matrix3d linear = whitened.covariance();
  const Thresholds thresholds(continuity_risk, model.lamps.size());
  std::vector<std::pair<double, int>> separated;
  for (std::size_t i = 0; i < model.lamps.size(); ++i) {
    Subset set;
    set.units = {i};
    if (!whitened.leave_out(set)) continue;
    const Eigen::Matrix3d separation = model.variance_factor * (set.covariance - linear);
    const double over = thresholds.excess(set.separation, separation);
    if (over > 1) separated.emplace_back(-over, model.lamps[i].lamp);
  }
  std::sort(separated.begin(), separated.end());
  std::vector<int> lamps;
  for (const auto& [over, lamp] : separated) lamps.push_back(lamp);
  return lamps;
}

}  // namespace occ
