// SPDX-License-Identifier: Apache-2.0
// History of a filter. It keeps the measurements of the last seconds, each with the state after it.
// A late measurement is inserted at its time and all later ones are processed again, so the result
// is that of the right order up to rounding errors.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/track/filter_update.hpp"
#include "libocc/track/internal/timeline.hpp"

namespace occ::internal::track {

/// Requirements on Model: the types State (with time_s) and Step (odometry);
/// propagate(State&, const Stretch&); update(State&, const PoseObservation&) -> FilterUpdate.
template <typename Model>
class Replay {
 public:
  using State = typename Model::State;
  using Step = typename Model::Step;

  Replay(Model model, double history_s, double imu_hold_s)
      : model_(std::move(model)), history_s_(history_s), timeline_(imu_hold_s) {}

  const Model& model() const { return model_; }
  bool started() const { return !entries_.empty(); }

  /// Drops all measurements and the motion before the state.
  void start(const State& state) {
    entries_.clear();
    entries_.push_back({std::nullopt, state, {}});
    timeline_.drop_before(state.time_s);
    newest_s_ = state.time_s;
  }

  FilterUpdate add(const PoseObservation& seen) {
    if (!started()) return {};
    if (seen.time_s < entries_.front().after.time_s) return {FilterOutcome::too_old};
    const auto later = [](double time_s, const Entry& e) { return time_s < e.after.time_s; };
    const auto next = std::upper_bound(entries_.begin(), entries_.end(), seen.time_s, later);
    const auto place = entries_.insert(next, Entry{seen, (next - 1)->after, {}});
    const auto index = static_cast<std::size_t>(place - entries_.begin());
    reprocess_from(index);
    const FilterUpdate update = entries_[index].update;
    advance(seen.time_s);
    return update;
  }

  FilterUpdate add(const Step& step) {
    if (!started()) return {};
    if (step.to_s <= entries_.front().after.time_s) return {FilterOutcome::too_old};
    if (!timeline_.add(step)) return {FilterOutcome::overlapping};
    reprocess_after(step.from_s);
    advance(step.to_s);
    return {FilterOutcome::accepted};
  }

  FilterUpdate add(const ImuSample& sample) {
    if (!started()) return {};
    timeline_.add(sample);
    reprocess_after(sample.time_s);
    advance(sample.time_s);
    return {FilterOutcome::accepted};
  }

  /// Returns the state predicted to a time; nullopt before the start and before the history.
  std::optional<State> at(double time_s) const {
    if (!started() || time_s < entries_.front().after.time_s) return std::nullopt;
    const auto later = [](double time, const Entry& e) { return time < e.after.time_s; };
    const auto next = std::upper_bound(entries_.begin(), entries_.end(), time_s, later);
    return propagated((next - 1)->after, time_s);
  }

 private:
  struct Entry {
    std::optional<PoseObservation> seen;  // empty for the first entry
    State after;
    FilterUpdate update;
  };

  State propagated(State state, double time_s) const {
    timeline_.walk(state.time_s, time_s,
                   [&](const auto& stretch) { model_.propagate(state, stretch); });
    state.time_s = time_s;
    return state;
  }

  void reprocess_from(std::size_t index) {
    for (std::size_t i = index; i < entries_.size(); ++i) {
      Entry& entry = entries_[i];
      entry.after = propagated(entries_[i - 1].after, entry.seen->time_s);
      entry.update = model_.update(entry.after, *entry.seen);
    }
  }

  void reprocess_after(double time_s) {
    std::size_t index = entries_.size();
    while (index > 1 && entries_[index - 1].after.time_s > time_s) --index;
    reprocess_from(index);
  }

  /// Moves the first entry to the beginning of the history before the newest measurement.
  void advance(double time_s) {
    newest_s_ = std::max(newest_s_, time_s);
    const double horizon_s = newest_s_ - history_s_;
    while (entries_.size() > 1 && entries_[1].after.time_s <= horizon_s) entries_.pop_front();
    Entry& first = entries_.front();
    first.seen.reset();
    // Without images the first entry is predicted forward, which bounds the memory of the timeline.
    if (first.after.time_s < horizon_s - history_s_)
      first.after = propagated(first.after, horizon_s);
    timeline_.drop_before(first.after.time_s);
  }

  Model model_;
  double history_s_;
  double newest_s_ = 0;
  Timeline<Step> timeline_;
  std::deque<Entry> entries_;  // sorted by time; the first has no measurement
};

}  // namespace occ::internal::track
