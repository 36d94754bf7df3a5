// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/known_consensus.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/network/internal/adjustment_report.hpp"
#include "libocc/network/internal/consensus.hpp"
#include "libocc/network/internal/network_layout.hpp"
#include "libocc/network/precision.hpp"

namespace occ::internal::network {

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Lengths agree if they differ by less than this plus five sigmas (of the lengths and of the
// images): least squares finds smaller errors. Those with five sigmas beyond the larger limit do
// not decide.
constexpr double min_tolerance = 0.02, max_tolerance = 0.1, sigmas = 5;
constexpr std::size_t min_control = 3;  // that determine a similarity
// Control points before each one to which its distance is taken, and scales that are tried: with
// many control points, these decide as well as all would.
constexpr std::size_t max_neighbours = 10, max_trials = 500;

/// A known length: a distance, or that between two control points.
struct KnownLength {
  int distance = -1;       ///< index, -1: between control points
  int from = -1, to = -1;  ///< control points
  double log_ratio = 0;    ///< the known length over that of the network
  double known_sigma = 0;  ///< relative, of the known length
  double sigma = 0;        ///< sigma of log_ratio
};

/// A scale of the network.
struct Scale {
  double log = 0;    ///< known lengths over those of the network
  double sigma = 0;  ///< relative
};

class Consensus {
 public:
  Consensus(const Network& adjusted, const Network& known, int threads)
      : adjusted_(adjusted), known_(known), threads_(threads), defect_(datum_defect(adjusted)) {}

  KnownConsensus run() {
    list_lengths();
    out_.reliable = !lengths_.empty() && (all_agree() || find_majority());
    if (out_.reliable && out_.contradiction.empty()) move_to_known();
    return out_;
  }

 private:
  void list_lengths() {
    const NetworkLayout layout = layout_of(adjusted_);
    const auto add = [&](const Target& from, const Target& to, double length_m, double sigma_m) {
      if (!layout.is_determined(from) || !layout.is_determined(to)) return false;
      const double adjusted = difference_m(from, to).norm();
      if (!(adjusted > 0) || !(length_m > 0)) return false;
      KnownLength one;
      one.log_ratio = std::log(length_m / adjusted);
      one.sigma = one.known_sigma = sigma_m / length_m;
      lengths_.push_back(one);
      return true;
    };
    for (std::size_t i = 0; i < known_.distances.size(); ++i) {
      const DistanceObservation& one = known_.distances[i];
      if (one.used && add(one.from, one.to, one.length_m, one.sigma_m))
        lengths_.back().distance = static_cast<int>(i);
    }
    for (std::size_t i = 0; i < known_.control.size(); ++i)
      if (known_.control[i].used && layout.is_determined(known_.control[i].target))
        control_.push_back(static_cast<int>(i));
    for (std::size_t k = 0; k < control_.size(); ++k)
      for (std::size_t i = k - std::min(k, max_neighbours); i < k; ++i) {
        const ControlPoint &a = known_.control[control_[i]], &b = known_.control[control_[k]];
        const double sigma_m = std::sqrt((a.covariance_m2 + b.covariance_m2).trace());
        if (add(a.target, b.target, (b.position_m - a.position_m).norm(), sigma_m)) {
          lengths_.back().from = control_[i];
          lengths_.back().to = control_[k];
        }
      }
  }

  /// True if all lengths agree as they are, without errors of the images; sets the scale. Precision
  /// takes as long as a stage of the adjustment, and is then not needed.
  bool all_agree() {
    const auto count = static_cast<std::ptrdiff_t>(lengths_.size());
    return (defect_.scale == 0 ? count_agreeing(lengths_, scale_) : find_mean_scale(lengths_)) ==
           count;
  }

  /// Finds the scale that most lengths agree with, and the others. False if no length decides.
  bool find_majority() {
    if (!add_image_sigmas()) return false;
    std::vector<KnownLength> deciding;
    for (const KnownLength& one : lengths_)
      if (sigmas * one.sigma <= max_tolerance) deciding.push_back(one);
    if (deciding.empty()) return false;
    find_scale(deciding);
    if (out_.contradiction.empty()) find_outliers();
    return true;
  }

  /// Adds the errors of the images to the sigmas; those of control points count as independent,
  /// which is faster. False if there is no covariance.
  bool add_image_sigmas() {
    const Result<Precision> precise = precision(adjusted_, {}, threads_);
    if (!precise.ok()) return false;
    std::vector<Matrix3d> covariances(known_.control.size());
    for (const int i : control_) covariances[i] = precise->joint({known_.control[i].target});
    for (KnownLength& one : lengths_) {
      double sigma_m = 0, length_m = 0;
      if (one.distance >= 0) {
        const DistanceObservation& known = known_.distances[one.distance];
        length_m = difference_m(known.from, known.to).norm();
        sigma_m = precise->distance_sigma_m(known.from, known.to);
      } else {
        const Vector3d apart =
            difference_m(known_.control[one.from].target, known_.control[one.to].target);
        length_m = apart.norm();
        const Matrix3d covariance = covariances[one.from] + covariances[one.to];
        sigma_m = std::sqrt(std::max(0.0, apart.normalized().dot(covariance * apart.normalized())));
      }
      one.sigma = std::hypot(one.sigma, sigma_m / length_m);
    }
    return true;
  }

  Vector3d difference_m(const Target& from, const Target& to) const {
    return adjusted_.position_m(to) - adjusted_.position_m(from);
  }

  bool agrees(const KnownLength& one, const Scale& scale) const {
    return std::abs(one.log_ratio - scale.log) <=
           min_tolerance + sigmas * std::hypot(one.sigma, scale.sigma);
  }

  std::ptrdiff_t count_agreeing(const std::vector<KnownLength>& lengths, const Scale& scale) const {
    return std::count_if(lengths.begin(), lengths.end(),
                         [&](const KnownLength& one) { return agrees(one, scale); });
  }

  /// The scale of one of some lengths with which most of these agree, and their number.
  std::pair<std::ptrdiff_t, Scale> best_scale(std::vector<KnownLength> lengths) const {
    std::stable_sort(
        lengths.begin(), lengths.end(),
        [](const KnownLength& a, const KnownLength& b) { return a.log_ratio < b.log_ratio; });
    std::pair<std::ptrdiff_t, Scale> best{0, {}};
    for (std::size_t i = 0; i < lengths.size(); i += 1 + lengths.size() / max_trials) {
      const Scale scale{lengths[i].log_ratio, lengths[i].sigma};
      const std::ptrdiff_t count = count_agreeing(lengths, scale);
      if (count > best.first) best = {count, scale};
    }
    return best;
  }

  /// The scale that most lengths agree with, if fewer of the others agree with another one. A scale
  /// that the network has counts once for each element that gives it.
  void find_scale(const std::vector<KnownLength>& deciding) {
    std::ptrdiff_t most = 0;
    if (defect_.scale == 0)
      most = count_agreeing(deciding, scale_) + std::max(std::ptrdiff_t{1}, count_sizes());
    else
      most = find_mean_scale(deciding);
    std::vector<KnownLength> others;
    for (const KnownLength& one : lengths_)
      if (!agrees(one, scale_)) others.push_back(one);
    if (most > best_scale(others).first) return;
    std::vector<std::string> names;
    for (const KnownLength& one : lengths_)
      if (one.distance >= 0) names.push_back(name_of_distance(known_, one.distance));
    for (const int i : control_) names.push_back(name_of_control(known_, i));
    out_.contradiction = contradiction_of(names);
  }

  /// The mean scale of the lengths that agree; returns their number.
  std::ptrdiff_t find_mean_scale(const std::vector<KnownLength>& lengths) {
    const auto [count, trial] = best_scale(lengths);
    double sum = 0, weights = 0;
    for (const KnownLength& one : lengths) {
      if (!agrees(one, trial)) continue;
      const double weight = 1 / square(min_tolerance + sigmas * one.sigma);
      sum += weight * one.log_ratio;
      weights += weight;
    }
    scale_.log = sum / weights;
    return count;
  }

  /// Number of bodies and fixed elements that give the network its scale.
  std::ptrdiff_t count_sizes() const {
    const auto is_fixed = [](const auto& one) { return one.fixed; };
    return std::count_if(adjusted_.bodies.begin(), adjusted_.bodies.end(),
                         [](const NetworkBody& one) { return one.fixed || !one.scale_free; }) +
           std::count_if(adjusted_.points.begin(), adjusted_.points.end(), is_fixed) +
           std::count_if(adjusted_.stations.begin(), adjusted_.stations.end(), is_fixed) +
           static_cast<std::ptrdiff_t>(adjusted_.pose_priors.size());
  }

  void find_outliers() {
    remove_control();
    if (!removed_.empty() && control_.size() < min_control) {
      std::vector<std::string> names;
      for (const auto* list : {&control_, &removed_})
        for (const int i : *list) names.push_back(name_of_control(known_, i));
      out_.contradiction = contradiction_of(names);
      return;
    }
    for (const KnownLength& one : lengths_) {
      if (one.distance < 0 || agrees(one, scale_)) continue;
      const double residual = std::exp(scale_.log - one.log_ratio) - 1;
      out_.distances.push_back({one.distance, std::abs(residual) / one.known_sigma});
    }
  }

  /// Removes the control point in most lengths that do not agree until all agree.
  void remove_control() {
    std::vector<int> disagreements(known_.control.size());
    const auto change = [&](const KnownLength& one, int by) {
      if (one.distance >= 0 || agrees(one, scale_)) return;
      disagreements[one.from] += by;
      disagreements[one.to] += by;
    };
    for (const KnownLength& one : lengths_) change(one, 1);
    while (true) {
      const auto worst = std::max_element(disagreements.begin(), disagreements.end());
      if (worst == disagreements.end() || *worst == 0) return;
      const int index = static_cast<int>(worst - disagreements.begin());
      for (KnownLength& one : lengths_) {
        if (one.from != index && one.to != index) continue;
        change(one, -1);
        one.from = one.to = -1;
      }
      control_.erase(std::find(control_.begin(), control_.end(), index));
      removed_.push_back(index);
    }
  }

  /// The similarity to the control points that agree. A datum that is fixed in part is kept.
  void move_to_known() {
    if (defect_.scale != 0) out_.to_known.scale = std::exp(scale_.log);
    const bool is_free = defect_.translation == 3 && defect_.rotation == 3;
    Matrix3Xd from(3, 0), to(3, 0);
    for (const int i : control_) {
      from.conservativeResize(3, from.cols() + 1);
      to.conservativeResize(3, to.cols() + 1);
      from.rightCols<1>() = adjusted_.position_m(known_.control[i].target);
      to.rightCols<1>() = known_.control[i].position_m;
    }
    if (is_free && control_.size() >= min_control)
      out_.to_known = similarity_between(from, to, out_.to_known.scale);
    else if (is_free && !control_.empty())
      out_.to_known.translation = to.rowwise().mean() - out_.to_known.scale * from.rowwise().mean();
    for (const int i : removed_) {
      const ControlPoint& one = known_.control[i];
      const Eigen::Array3d normalised =
          (out_.to_known * adjusted_.position_m(one.target) - one.position_m).array().abs() /
          one.covariance_m2.diagonal().array().sqrt();
      OutlierCandidate outlier;
      outlier.index = i;
      outlier.normalised = normalised.maxCoeff(&outlier.coordinate);
      out_.control.push_back(outlier);
    }
    if (!is_free && defect_.total() > 0) out_.to_known = {};
  }

  const Network& adjusted_;
  const Network& known_;
  const int threads_;
  const DatumDefect defect_;
  std::vector<KnownLength> lengths_;
  std::vector<int> control_, removed_;  // of the control points that are used
  Scale scale_;                         // from the network to the known lengths
  KnownConsensus out_;
};

}  // namespace

bool has_redundant_lengths(const Network& network) {
  const auto is_used = [](const auto& one) { return one.used; };
  const auto distances = std::count_if(network.distances.begin(), network.distances.end(), is_used);
  const auto control = std::count_if(network.control.begin(), network.control.end(), is_used);
  const auto lengths = distances + control * (control - 1) / 2;
  return lengths > 1 || (lengths == 1 && datum_defect(without_known(network)).scale == 0);
}

Network without_known(Network network) {
  for (DistanceObservation& one : network.distances) one.used = false;
  for (ControlPoint& one : network.control) one.used = false;
  return network;
}

KnownConsensus known_consensus(const Network& adjusted, const Network& known, int threads) {
  return Consensus(adjusted, known, threads).run();
}

}  // namespace occ::internal::network
