// SPDX-License-Identifier: Apache-2.0
// One adjustment of a network in stages: adjust.cpp has the order of the stages, least squares and
// the tests of single observations, robust_rejection.cpp the robust estimation before them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/network/adjust.hpp"
#include "libocc/network/internal/adjustment_report.hpp"
#include "libocc/network/internal/minimise_network.hpp"
#include "libocc/network/internal/network_checks.hpp"
#include "libocc/network/internal/outlier_tests.hpp"

namespace occ::internal::network {

/// The current network, its layout and the rejected observations.
class Adjuster {
 public:
  Adjuster(const Network& network, const AdjustOptions& options, const AdjustCallback& progress)
      : options_(options), progress_(progress) {
    result_.value.network = network;
  }

  Result<Adjustment> run();

 private:
  Network& network() { return result_.value.network; }
  void update_layout() { layout_ = layout_of(network()); }
  bool fail(Status status, const std::string& message);
  bool check_data();
  /// Moves each point that is out of some image's view at the start to the intersection of its
  /// rays.
  void reintersect_points(NetworkState& state);
  /// Runs one stage from the current state.
  Minimised stage(const char* name, const Loss& loss, int iterations, double min_fall);
  bool stopped(const Minimised& minimised);
  /// Length of the residual of each used observation, -1 for others; infinite when not in view.
  std::vector<double> residual_lengths();
  static double scale_of(const std::vector<double>& residual_lengths);
  void reject(int observation, double normalised, const char* reason);
  /// reject_robustly() with image points only, then use_known(). False, with nothing changed, if
  /// distances and control points are not redundant, or the images do not determine the network
  /// without them; also if the caller stops it.
  bool reject_by_images();
  /// Uses the distances and control points of `given` and rejects those that contradict the others;
  /// where no majority agrees, contradiction_ says so.
  bool use_known(const Network& given);
  /// Robust estimation, then rejection of all observations beyond Tukey's limit.
  bool reject_robustly();
  void apply_station_consensus(double limit);
  void reject_for(int observation, double length, const char* reason);
  void apply_body_consensus(double limit, bool last, const std::vector<double>& lengths);
  /// Moves each point to the consensus of its images; if `last`, also rejects the outliers.
  void apply_point_consensus(double limit, bool last);
  /// Least squares without loss function. False when the adjustment must stop; the status gives the
  /// reason.
  bool least_squares(const char* name);
  /// Leaves out stations whose targets do not determine their pose; returns whether there are any.
  /// Such a station would end the adjustment, or its covariance would be wrong.
  bool leave_out_undetermined_stations(const std::vector<Index>& suspects = {});
  /// Leaves out stations, with the number of their targets within the reason. False without any, or
  /// if no station would remain.
  bool leave_out(const std::vector<WeakStation>& weak, const std::string& before_count,
                 const std::string& after_count);
  /// Excludes points whose rays are parallel.
  void leave_out(const std::vector<std::size_t>& groups);
  bool fail_to_converge(const Minimised& minimised);
  std::vector<Index> weakest_unknowns();
  OutlierCandidates outliers();
  /// True if all observations of one kind agree without this one.
  bool agree_without(bool is_distance, int index);
  /// Rejects the distance or control point with the largest residual. If all agree without it, but
  /// without another one as well, either may be wrong, and none is rejected.
  bool reject_known(const std::vector<OutlierCandidate>& found, bool is_distance);
  void reject_distance(const OutlierCandidate& one);
  void reject_control(const OutlierCandidate& one);
  void reject_images(const std::vector<OutlierCandidate>& found);
  /// Uses rejected distances and control points again that agree with the result.
  bool readmit();
  bool snoop();
  double final_cost();
  Result<Adjustment> finish();

  const AdjustOptions& options_;
  const AdjustCallback& progress_;
  Result<Adjustment> result_;
  Network given_;      ///< before the adjustment
  Network reference_;  ///< start values that define the datum
  NetworkLayout layout_;
  LeftOutReasons reasons_;
  std::string contradiction_;   ///< observations of which one must be wrong
  bool is_stopped_ = false;     ///< the caller has stopped it
  std::optional<double> cost_;  ///< cost of the last least squares while it is valid
};

}  // namespace occ::internal::network
