// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/adjust.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/network/internal/adjuster.hpp"
#include "libocc/network/internal/consensus.hpp"

namespace occ::internal::network {

namespace {

/// Median of the length of two residuals of sigma 1 (Rayleigh distribution): sqrt(2 ln 2).
constexpr double rayleigh_median = 1.17741;

}  // namespace

Result<Adjustment> Adjuster::run() {
  given_ = network();
  update_layout();
  if (!check_data()) return finish();
  reference_ = without_observations(network());
  if (options_.robust && !reject_by_images() && (is_stopped_ || !reject_robustly()))
    return finish();
  if (!contradiction_.empty()) return finish();
  if (!least_squares("least squares")) return finish();
  if (options_.snooping && !snoop()) return finish();
  return finish();
}

bool Adjuster::fail(Status status, const std::string& message) {
  result_.status = status;
  result_.message = message;
  return false;
}

bool Adjuster::check_data() {
  // Without a station, targets may keep one image and thus further stations too few targets.
  while (leave_out(weak_stations(network(), layout_), "keeps only ",
                   " targets that others observe too; three are needed"))
    continue;
  const CheckOutcome check = check_solvable(network(), layout_);
  if (check.status != Status::ok) return fail(check.status, check.message);
  const int redundancy = count_observations(network(), layout_) - static_cast<int>(layout_.total) +
                         datum_defect(network()).total();
  if (redundancy < 0)
    return fail(Status::degenerate,
                std::to_string(-redundancy) + " more observations than given are needed");
  return true;
}

void Adjuster::reintersect_points(NetworkState& state) {
  const std::vector<std::vector<int>> observations = observations_of_points(network(), layout_);
  for (std::size_t p = 0; p < observations.size(); ++p) {
    const bool out_of_view =
        std::any_of(observations[p].begin(), observations[p].end(), [&](int i) {
          double r[2];
          return !residual_of(network(), state, network().observations[i], r);
        });
    if (!out_of_view) continue;
    if (const auto point = intersect_observations(network(), state, observations[p]))
      state.points[p] = reference_.points[p].position_m = *point;
  }
}

Minimised Adjuster::stage(const char* name, const Loss& loss, int iterations, double min_fall) {
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
  const Minimised minimised =
      first ? minimise(network(), layout_, state, options, report,
                       [&](NetworkState& start) { reintersect_points(start); })
            : minimise(network(), layout_, state, options, report);
  state.write_to(network());
  result_.value.iterations += minimised.iterations;
  return minimised;
}

bool Adjuster::stopped(const Minimised& minimised) {
  if (minimised.ending != Ending::stopped) return false;
  is_stopped_ = true;
  fail(Status::not_converged, "stopped by the caller");
  return true;
}

std::vector<double> Adjuster::residual_lengths() {
  const NetworkState state(network());
  std::vector<double> lengths(network().observations.size(), -1);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const ImageObservation& observation = network().observations[i];
    if (!observation.used || !layout_.is_determined(observation.target)) continue;
    double r[2];
    lengths[i] = residual_of(network(), state, observation, r)
                     ? std::hypot(r[0], r[1])
                     : std::numeric_limits<double>::infinity();
  }
  return lengths;
}

double Adjuster::scale_of(const std::vector<double>& residual_lengths) {
  std::vector<double> visible;
  for (const double length : residual_lengths)
    if (length >= 0 && std::isfinite(length)) visible.push_back(length);
  return std::max(1.0, median(std::move(visible)) / rayleigh_median);
}

void Adjuster::reject(int observation, double normalised, const char* reason) {
  network().observations[observation].used = false;
  cost_.reset();
  result_.value.rejected.push_back({observation, normalised, reason});
}

bool Adjuster::least_squares(const char* name) {
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    const Minimised minimised = stage(name, {}, options_.max_iterations, 0);
    if (stopped(minimised)) return false;
    cost_ = minimised.cost;
    const bool is_whole = minimised.out_of_view == 0 && minimised.singular_groups.empty();
    if (is_whole || !minimised.undetermined.empty()) {
      std::vector<Index> suspects = minimised.undetermined;
      if (suspects.empty() && minimised.ending != Ending::converged) suspects = weakest_unknowns();
      if (leave_out_undetermined_stations(suspects)) {
        if (!check_data()) return false;
        --round;  // at most once for each station
        continue;
      }
      if (!minimised.undetermined.empty())
        return fail(Status::degenerate,
                    "no observation determines " +
                        names_of_unknowns(network(), layout_, minimised.undetermined));
      return minimised.ending == Ending::converged || fail_to_converge(minimised);
    }
    cost_.reset();
    leave_out(minimised.singular_groups);
    const std::vector<double> lengths = residual_lengths();
    for (std::size_t i = 0; i < lengths.size(); ++i)
      if (std::isinf(lengths[i])) reject(static_cast<int>(i), lengths[i], "not in view");
    update_layout();
    if (!check_data()) return false;
  }
  return true;
}

bool Adjuster::leave_out_undetermined_stations(const std::vector<Index>& suspects) {
  return leave_out(undetermined_stations(network(), layout_, suspects), "has a pose that its ",
                   " targets hardly determine: they are on a line, or the camera is near their "
                   "danger cylinder");
}

bool Adjuster::leave_out(const std::vector<WeakStation>& weak, const std::string& before_count,
                         const std::string& after_count) {
  if (weak.empty() || weak.size() == count_observing_stations(network(), layout_)) return false;
  std::vector<char> is_weak(network().stations.size());
  for (const WeakStation& one : weak) {
    is_weak[one.station] = 1;
    reasons_[{LeftOut::Kind::station, one.station}] =
        before_count + std::to_string(one.targets) + after_count;
  }
  for (ImageObservation& observation : network().observations)
    if (is_weak[network().images[observation.image].station]) observation.used = false;
  cost_.reset();
  update_layout();
  return true;
}

void Adjuster::leave_out(const std::vector<std::size_t>& groups) {
  for (const std::size_t g : groups) {
    const Group& group = layout_.groups[g];
    for (const int i : group.observations) network().observations[i].used = false;
    const bool is_point = group.block.body < 0;
    reasons_[{is_point ? LeftOut::Kind::point : LeftOut::Kind::body,
              is_point ? group.block.point : group.block.body}] = "is not determined by its rays";
  }
}

bool Adjuster::fail_to_converge(const Minimised& minimised) {
  std::ostringstream text;
  text.precision(3);
  text << (minimised.ending == Ending::iterations ? "the maximum number of iterations was reached"
                                                  : "no step decreases the residuals")
       << "; the next step would be " << minimised.step_sigma << " sigma";
  text << "; least determined: " << names_of_unknowns(network(), layout_, weakest_unknowns());
  return fail(Status::not_converged, text.str());
}

std::vector<Index> Adjuster::weakest_unknowns() {
  const NetworkState state(network());
  NormalEquations normal;
  build(network(), layout_, state, {}, 0, options_.threads, normal);
  return ReducedSystem(normal, reduced_gauge(network(), layout_, state)).weakest();
}

OutlierCandidates Adjuster::outliers() {
  return find_outliers(network(), layout_, scale_of(residual_lengths()), options_.false_alarm,
                       options_.threads);
}

bool Adjuster::agree_without(bool is_distance, int index) {
  Network trial = network();
  (is_distance ? trial.distances[index].used : trial.control[index].used) = false;
  const NetworkLayout layout = layout_of(trial);
  NetworkState state(trial);
  MinimiseOptions options;
  options.max_iterations = options_.max_iterations;
  options.tolerance_sigma = options_.tolerance_sigma;
  options.threads = options_.threads;
  minimise(trial, layout, state, options, [](int, double) { return true; });
  state.write_to(trial);
  const OutlierCandidates found = find_outliers(trial, layout, scale_of(residual_lengths()),
                                                options_.false_alarm, options_.threads);
  return (is_distance ? found.distances : found.control).empty();
}

bool Adjuster::reject_known(const std::vector<OutlierCandidate>& found, bool is_distance) {
  const auto name = [&](int index) {
    return is_distance ? name_of_distance(network(), index) : name_of_control(network(), index);
  };
  const OutlierCandidate& worst = found[0];
  // Test values of observations that cannot be told apart are equal, apart from the
  // linearisation.
  constexpr double min_ratio = 0.5;
  if (found.size() > 1 && found[1].normalised > min_ratio * worst.normalised &&
      agree_without(is_distance, found[1].index) && agree_without(is_distance, worst.index)) {
    contradiction_ = contradiction_of({name(worst.index), name(found[1].index)});
    return false;
  }
  is_distance ? reject_distance(worst) : reject_control(worst);
  return true;
}

void Adjuster::reject_distance(const OutlierCandidate& one) {
  network().distances[one.index].used = false;
  result_.value.rejected_distances.push_back(
      {one.index, one.normalised, 0, name_of_distance(network(), one.index)});
  cost_.reset();
}

void Adjuster::reject_control(const OutlierCandidate& one) {
  network().control[one.index].used = false;
  result_.value.rejected_control.push_back(
      {one.index, one.normalised, one.coordinate, 0, name_of_control(network(), one.index)});
  cost_.reset();
}

void Adjuster::reject_images(const std::vector<OutlierCandidate>& found) {
  std::set<int> images, points, bodies;
  for (const OutlierCandidate& one : found) {
    const ImageObservation& observation = network().observations[one.index];
    std::set<int>& targets = observation.target.body < 0 ? points : bodies;
    const int target =
        observation.target.body < 0 ? observation.target.point : observation.target.body;
    if (images.count(observation.image) || targets.count(target)) continue;
    images.insert(observation.image);
    targets.insert(target);
    reject(one.index, one.normalised, "snooping");
  }
}

bool Adjuster::readmit() {
  const AgreeingObservations agreeing = find_agreeing(network(), scale_of(residual_lengths()),
                                                      options_.false_alarm, options_.threads);
  for (const int i : agreeing.distances) {
    network().distances[i].used = true;
    auto& list = result_.value.rejected_distances;
    list.erase(std::remove_if(list.begin(), list.end(),
                              [&](const auto& one) { return one.distance == i; }),
               list.end());
  }
  for (const int i : agreeing.control) {
    network().control[i].used = true;
    auto& list = result_.value.rejected_control;
    list.erase(
        std::remove_if(list.begin(), list.end(), [&](const auto& one) { return one.control == i; }),
        list.end());
  }
  return !agreeing.distances.empty() || !agreeing.control.empty();
}

bool Adjuster::snoop() {
  constexpr int rounds = 100;
  bool readmitted = false;
  for (int round = 0; round < rounds; ++round) {
    const OutlierCandidates found = outliers();
    const auto largest = [](const std::vector<OutlierCandidate>& list) {
      return list.empty() ? 0 : list[0].normalised;
    };
    // A wrong distance or control point displaces its points, so that their image residuals grow:
    // the largest residual of all kinds is rejected first.
    const double image = largest(found.images), distance = largest(found.distances),
                 control = largest(found.control);
    if (std::max({image, distance, control}) == 0) {
      if (readmitted || !readmit()) return true;
      readmitted = true;  // once, so that the rounds end
    } else if (image >= std::max(distance, control)) {
      reject_images(found.images);
    } else if (!reject_known(distance >= control ? found.distances : found.control,
                             distance >= control)) {
      return true;
    }
    update_layout();
    if (!check_data() || !least_squares("snooping")) return false;
  }
  return true;
}

double Adjuster::final_cost() {
  const NetworkState state(network());
  NormalEquations normal;
  build(network(), layout_, state, {}, 0, options_.threads, normal);
  return normal.cost;
}

Result<Adjustment> Adjuster::finish() {
  Adjustment& out = result_.value;
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
  report(given_, layout_, reasons_, contradiction_, result_);
  return std::move(result_);
}

}  // namespace occ::internal::network

namespace occ {

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
  return internal::network::Adjuster(network, options, progress).run();
}

std::vector<Eigen::Vector2d> image_residuals_px(const Network& network) {
  check_network(network);
  const internal::network::NetworkState state(network);
  std::vector<Eigen::Vector2d> residuals;
  residuals.reserve(network.observations.size());
  for (const ImageObservation& observation : network.observations) {
    double r[2];
    if (internal::network::residual_of(network, state, observation, r))
      residuals.emplace_back(-r[0] * observation.sigma_px[0], -r[1] * observation.sigma_px[1]);
    else
      residuals.push_back(Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()));
  }
  return residuals;
}

}  // namespace occ
