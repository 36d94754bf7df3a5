// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/adjust.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <sstream>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/internal/body_agreement.hpp"
#include "libocc/network/internal/minimise_network.hpp"
#include "libocc/network/internal/network_checks.hpp"
#include "libocc/network/internal/point_agreement.hpp"
#include "libocc/network/internal/residual_cofactors.hpp"

namespace occ {

using namespace internal::network;

namespace {

/// The median of the length of two residuals of sigma 1.
constexpr double rayleigh_median = 1.17741;

/// One adjustment: the network as it stands, with what was taken out of it.
class Adjuster {
 public:
  Adjuster(const Network& network, const AdjustOptions& options, const AdjustCallback& progress)
      : options_(options), progress_(progress) {
    result_.value.network = network;
  }

  Result<Adjustment> run() {
    renew();
    if (!may_go_on()) return finish();
    reference_ = without_observations(network());
    if (options_.robust && !reject_robustly()) return finish();
    if (!least_squares("least squares")) return finish();
    if (options_.snooping && !snoop()) return finish();
    return finish();
  }

 private:
  Network& network() { return result_.value.network; }

  void renew() { layout_ = layout_of(network()); }

  bool fail(Status status, const std::string& message) {
    result_.status = status;
    result_.message = message;
    return false;
  }

  bool may_go_on() {
    const Objection objection = objection_to(network(), layout_);
    if (objection.status != Status::ok) return fail(objection.status, objection.message);
    const int open = count_observations(network(), layout_) - static_cast<int>(layout_.total) +
                     datum_defect(network()).total();
    if (open < 0)
      return fail(Status::degenerate,
                  "there are " + std::to_string(-open) + " observations fewer than unknowns");
    return true;
  }

  /// Points that some image cannot show from where it starts are put where their rays meet.
  void repair_points(NetworkState& state) {
    const std::vector<std::vector<int>> seen_by = sightings_of_points(network(), layout_);
    for (std::size_t p = 0; p < seen_by.size(); ++p) {
      const bool lost = std::any_of(seen_by[p].begin(), seen_by[p].end(), [&](int i) {
        double r[2];
        return !residual_of(network(), state, network().observations[i], r);
      });
      if (!lost) continue;
      if (const auto meeting = meeting_of(network(), state, seen_by[p]))
        state.points[p] = reference_.points[p].position_m = *meeting;
    }
  }

  /// Runs a stage from the present state; false when it was stopped by the caller.
  Minimised stage(const char* name, const Loss& loss, int iterations, double min_fall) {
    NetworkState state(network());
    MinimiseOptions options;
    options.loss = loss;
    options.max_iterations = iterations;
    options.tolerance_sigma = options_.tolerance_sigma;
    options.min_fall = min_fall;
    options.threads = options_.threads;
    const auto report = [&](int iteration, double cost) {
      return !progress_ ||
             progress_({name, iteration, cost, static_cast<int>(result_.value.rejected.size())});
    };
    const bool first = result_.value.iterations == 0;
    const Minimised minimised = first ? minimise(network(), layout_, state, options, report,
                                                 [&](NetworkState& start) { repair_points(start); })
                                      : minimise(network(), layout_, state, options, report);
    state.put_into(network());
    result_.value.iterations += minimised.iterations;
    return minimised;
  }

  bool stopped(const Minimised& minimised) {
    if (minimised.ending != Ending::stopped) return false;
    fail(Status::not_converged, "stopped by the caller");
    return true;
  }

  /// Length of every used observation's residual, infinite when it is not in view.
  std::vector<double> lengths() {
    const NetworkState state(network());
    std::vector<double> all(network().observations.size(), -1);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const ImageObservation& seen = network().observations[i];
      if (!seen.used || !layout_.knows(seen.target)) continue;
      double r[2];
      all[i] = residual_of(network(), state, seen, r) ? std::hypot(r[0], r[1])
                                                      : std::numeric_limits<double>::infinity();
    }
    return all;
  }

  static double scale_of(const std::vector<double>& lengths) {
    std::vector<double> shown;
    for (const double length : lengths)
      if (length >= 0 && std::isfinite(length)) shown.push_back(length);
    return std::max(1.0, median(std::move(shown)) / rayleigh_median);
  }

  void reject(int observation, double normalised, const char* reason) {
    network().observations[observation].used = false;
    cost_.reset();
    result_.value.rejected.push_back({observation, normalised, reason});
  }

  /// Robust estimation, then what lies beyond Tukey's limit goes.
  bool reject_robustly() {
    constexpr int rounds = 8, steps = 20;
    double scale = scale_of(lengths());
    for (int round = 0; round < rounds; ++round) {
      if (stopped(stage("robust", {Loss::Kind::huber, scale}, steps, 1e-3))) return false;
      const double now = scale_of(lengths());
      const bool settled = now > 0.9 * scale;
      scale = now;
      if (settled && round > 0) break;
    }
    for (int round = 0; round < 2; ++round) {
      settle_points(Loss::tukey * scale, false);
      if (stopped(stage("robust", {Loss::Kind::tukey, scale}, steps, 1e-4))) return false;
      scale = scale_of(lengths());
    }
    settle_points(Loss::tukey * scale, true);
    const std::vector<double> all = lengths();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i] > Loss::tukey * scale) reject_for(static_cast<int>(i), all[i], "robust");
    renew();
    return may_go_on();
  }

  void reject_for(int observation, double length, const char* reason) {
    reject(observation, length, std::isfinite(length) ? reason : "not in view");
  }

  void settle_bodies(double limit, bool last, const std::vector<double>& all) {
    NetworkState state(network());
    const std::vector<std::vector<int>> seen_by = sightings_of_bodies(network(), layout_);
    for (std::size_t b = 0; b < seen_by.size(); ++b) {
      if (seen_by[b].empty()) continue;
      const int body = static_cast<int>(b);
      const BodyAgreement about =
          agreement_about_body(network(), layout_, state, body, seen_by[b], limit);
      if (!last || about.sound) {
        network().bodies[b].world_from_body = about.world_from_body;
        network().bodies[b].scale = about.scale;
      }
      if (!last) continue;
      for (const int i : about.sound ? about.disagree : seen_by[b])
        reject_for(i, all[i], about.sound ? "robust" : "no agreement");
      if (!about.sound)
        disputed_.push_back(
            "body " +
            (network().bodies[b].name.empty() ? std::to_string(b) : network().bodies[b].name) +
            ": its images do not agree; it is left out");
    }
  }

  /// Puts each point where most of its images agree; at last takes away what does not.
  void settle_points(double limit, bool last) {
    const NetworkState state(network());
    const std::vector<double> all = last ? lengths() : std::vector<double>();
    const std::vector<std::vector<int>> seen_by = sightings_of_points(network(), layout_);
    for (std::size_t p = 0; p < seen_by.size(); ++p) {
      const int point = static_cast<int>(p);
      const PointAgreement about = agreement_about(network(), state, point, seen_by[p], limit);
      if (!last || about.sound) network().points[p].position_m = about.position_m;
      if (!last) continue;
      for (const int i : about.sound ? about.disagree : seen_by[p])
        reject_for(i, all[i], about.sound ? "robust" : "no agreement");
      if (!about.sound)
        disputed_.push_back(network().name_of(Target::of_point(point)) +
                            ": no three of its images agree; it is left out");
    }
    settle_bodies(limit, last, all);
  }

  /// False when there is no way on; non-convergence is noted.
  bool least_squares(const char* name) {
    constexpr int rounds = 3;
    for (int round = 0; round < rounds; ++round) {
      const Minimised minimised = stage(name, {}, options_.max_iterations, 0);
      if (stopped(minimised)) return false;
      if (!minimised.undetermined.empty())
        return fail(Status::degenerate,
                    "no observation determines " +
                        names_of_unknowns(network(), layout_, minimised.undetermined));
      cost_ = minimised.cost;
      if (minimised.lost == 0 && minimised.loose_groups.empty())
        return minimised.ending == Ending::converged || note(minimised);
      cost_.reset();
      leave_out(minimised.loose_groups);
      const std::vector<double> all = lengths();
      for (std::size_t i = 0; i < all.size(); ++i)
        if (std::isinf(all[i])) reject(static_cast<int>(i), all[i], "not in view");
      renew();
      if (!may_go_on()) return false;
    }
    return true;
  }

  /// Points whose rays are parallel.
  void leave_out(const std::vector<std::size_t>& groups) {
    for (const std::size_t g : groups) {
      const Group& group = layout_.groups[g];
      for (const int i : group.observations) network().observations[i].used = false;
      disputed_.push_back(network().name_of(group.block) +
                          " is not determined by its rays and is left out");
    }
  }

  bool note(const Minimised& minimised) {
    std::ostringstream text;
    text.precision(3);
    text << (minimised.ending == Ending::iterations ? "the iterations were used up"
                                                    : "no step makes the residuals smaller")
         << "; the next step would be " << minimised.step_sigma << " sigma";
    const NetworkState state(network());
    NormalEquations normal;
    build(network(), layout_, state, {}, 0, options_.threads, normal);
    const ReducedSystem system(normal, reduced_gauge(network(), layout_, state));
    text << "; least determined: " << names_of_unknowns(network(), layout_, system.weakest());
    return fail(Status::not_converged, text.str());
  }

  struct Candidate {
    int observation;
    double normalised;
  };

  struct Suspects {
    std::vector<Candidate> images;  ///< of image observations, the worst first
    std::vector<Candidate> distances;
  };

  /// Whose normalised residual is beyond the critical value.
  Suspects suspects() {
    const NetworkState state(network());
    NormalEquations normal;
    build(network(), layout_, state, {}, 0, options_.threads, normal);
    const ReducedSystem system(normal, reduced_gauge(network(), layout_, state));
    if (!system.determined()) return {};
    const Eigen::MatrixXd covariance = system.covariance();
    const auto all =
        residual_cofactors(network(), layout_, state, normal, covariance, options_.threads);
    const int rows = count_observations(network(), layout_);
    const int redundancy = rows - static_cast<int>(layout_.total) + datum_defect(network()).total();
    // Sigmas stated too small must not make everything suspect, nor may gross errors hide in
    // sigma0.
    const double factor = std::sqrt(variance_factor(2 * normal.cost, redundancy));
    const double scale = std::min(factor, scale_of(lengths()));
    const double quantile = normal_quantile(1 - options_.false_alarm / (2.0 * rows));
    const double critical = scale * quantile;
    constexpr double blind = 1e-4;  // of redundancy: an error would not show at all
    Suspects found;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!all[i].used) continue;
      double worst = 0;
      const Eigen::Matrix2d left = all[i].left();
      for (int k = 0; k < 2; ++k)
        if (left(k, k) > blind)
          worst = std::max(worst, std::abs(all[i].residual[k]) / std::sqrt(left(k, k)));
      if (worst > critical) found.images.push_back({static_cast<int>(i), worst});
    }
    for (std::size_t i = 0; i < network().distances.size(); ++i) {
      const DistanceCofactor one =
          distance_cofactor(network(), layout_, state, network().distances[i], covariance);
      if (!one.used || one.left < blind) continue;
      const double w = std::abs(one.residual) / std::sqrt(one.left);
      if (w > quantile) found.distances.push_back({static_cast<int>(i), w});
    }
    for (auto* list : {&found.images, &found.distances})
      std::stable_sort(list->begin(), list->end(), [](const Candidate& a, const Candidate& b) {
        return a.normalised > b.normalised;
      });
    return found;
  }

  /// The worst distance goes, unless another is as bad: of two that contradict each other, nobody
  /// knows which.
  bool reject_distance(const std::vector<Candidate>& found) {
    constexpr double alike = 0.98;
    contradiction_.clear();
    if (found.size() > 1 && found[1].normalised > alike * found[0].normalised) {
      contradiction_ = "distances " + std::to_string(found[0].observation) + " and " +
                       std::to_string(found[1].observation) + " contradict each other";
      return false;
    }
    network().distances[found[0].observation].used = false;
    cost_.reset();
    result_.value.rejected_distances.push_back({found[0].observation, found[0].normalised});
    return true;
  }

  bool snoop() {
    constexpr int rounds = 100;
    for (int round = 0; round < rounds; ++round) {
      const Suspects found = suspects();
      // A wrong distance pulls its points away from where images see them: it goes first.
      const bool first =
          !found.distances.empty() &&
          (found.images.empty() || found.distances[0].normalised > found.images[0].normalised);
      if (first && !reject_distance(found.distances)) return true;
      if (!first && found.images.empty()) return true;
      std::set<int> images, points, bodies;
      for (const Candidate& one : first ? std::vector<Candidate>() : found.images) {
        const ImageObservation& seen = network().observations[one.observation];
        std::set<int>& targets = seen.target.body < 0 ? points : bodies;
        const int target = seen.target.body < 0 ? seen.target.point : seen.target.body;
        if (images.count(seen.image) || targets.count(target)) continue;
        images.insert(seen.image);
        targets.insert(target);
        reject(one.observation, one.normalised, "snooping");
      }
      renew();
      if (!may_go_on() || !least_squares("snooping")) return false;
    }
    return true;
  }

  double final_cost() {
    const NetworkState state(network());
    NormalEquations normal;
    build(network(), layout_, state, {}, 0, options_.threads, normal);
    return normal.cost;
  }

  Result<Adjustment> finish() {
    Adjustment& out = result_.value;
    out.warnings = layout_.left_out;
    out.warnings.insert(out.warnings.end(), disputed_.begin(), disputed_.end());
    if (!contradiction_.empty()) out.warnings.push_back(contradiction_);
    out.cost = cost_ ? *cost_ : final_cost();
    out.observations = count_observations(network(), layout_);
    out.unknowns = static_cast<int>(layout_.total);
    out.defect = datum_defect(network()).total();
    out.redundancy = out.observations - out.unknowns + out.defect;
    if (out.redundancy > 0) out.sigma0 = std::sqrt(2 * out.cost / out.redundancy);
    if (reference_.points.size() == network().points.size() &&
        reference_.bodies.size() == network().bodies.size()) {
      Result<Network> aligned = in_datum(network(), reference_, options_.datum);
      if (aligned.ok())
        network() = std::move(aligned.value);
      else if (result_.ok())
        fail(aligned.status, aligned.message);
    }
    return std::move(result_);
  }

  const AdjustOptions& options_;
  const AdjustCallback& progress_;
  Result<Adjustment> result_;
  Network reference_;
  NetworkLayout layout_;
  std::vector<std::string> disputed_;
  std::string contradiction_;
  std::optional<double> cost_;  ///< of the last least squares, while it holds
};

}  // namespace

void AdjustOptions::validate() const {
  require(false_alarm > 0 && false_alarm < 1, "false_alarm", false_alarm, "between 0 and 1");
  require(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  require(tolerance_sigma > 0, "tolerance_sigma", tolerance_sigma, "positive");
  require(threads >= 1, "threads", threads, "at least 1");
}

Result<Adjustment> adjust(const Network& network, const AdjustOptions& options,
                          const AdjustCallback& progress) {
  options.validate();
  check_network(network);
  check_datum(network, options.datum);
  return Adjuster(network, options, progress).run();
}

std::vector<Eigen::Vector2d> image_residuals_px(const Network& network) {
  check_network(network);
  const NetworkState state(network);
  std::vector<Eigen::Vector2d> all;
  all.reserve(network.observations.size());
  for (const ImageObservation& seen : network.observations) {
    double r[2];
    if (residual_of(network, state, seen, r))
      all.emplace_back(-r[0] * seen.sigma_px[0], -r[1] * seen.sigma_px[1]);
    else
      all.push_back(Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));
  }
  return all;
}

}  // namespace occ
