// SPDX-License-Identifier: Apache-2.0
// A filter's memory. Measurements of the last seconds are kept, each with the state after it, so
// that one which arrives late (or odometry that does) is put in its place and what came after it is
// done again: the result is that of the right order, to rounding.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/track/filter_update.hpp"
#include "libocc/track/internal/timeline.hpp"

namespace occ::internal::track {

/// Model: types State (with time_s) and Step (odometry); propagate(State&, const Stretch&);
/// update(State&, const PoseObservation&) -> FilterUpdate.
template <typename Model>
class Replay {
 public:
  using State = typename Model::State;
  using Step = typename Model::Step;

  Replay(Model model, double history_s, double imu_hold_s)
      : model_(std::move(model)), history_s_(history_s), timeline_(imu_hold_s) {}

  const Model& model() const { return model_; }
  bool started() const { return !entries_.empty(); }

  /// Forgets all measurements and what the motion was before.
  void start(const State& state) {
    entries_.clear();
    entries_.push_back({std::nullopt, state, {}});
    timeline_.forget_before(state.time_s);
    newest_s_ = state.time_s;
  }

  FilterUpdate add(const PoseObservation& seen) {
    if (!started()) return {};
    if (seen.time_s < entries_.front().after.time_s) return {FilterOutcome::too_old};
    const auto later = [](double time_s, const Entry& e) { return time_s < e.after.time_s; };
    const auto next = std::upper_bound(entries_.begin(), entries_.end(), seen.time_s, later);
    const auto place = entries_.insert(next, Entry{seen, (next - 1)->after, {}});
    const auto index = static_cast<std::size_t>(place - entries_.begin());
    redo_from(index);
    const FilterUpdate update = entries_[index].update;
    remember(seen.time_s);
    return update;
  }

  FilterUpdate add(const Step& step) {
    if (!started()) return {};
    if (step.to_s <= entries_.front().after.time_s) return {FilterOutcome::too_old};
    if (!timeline_.add(step)) return {FilterOutcome::overlapping};
    redo_after(step.from_s);
    remember(step.to_s);
    return {FilterOutcome::accepted};
  }

  FilterUpdate add(const ImuSample& sample) {
    if (!started()) return {};
    timeline_.add(sample);
    redo_after(sample.time_s);
    remember(sample.time_s);
    return {FilterOutcome::accepted};
  }

  /// Nothing before the start, and of a time that is forgotten.
  std::optional<State> at(double time_s) const {
    if (!started() || time_s < entries_.front().after.time_s) return std::nullopt;
    const auto later = [](double time, const Entry& e) { return time < e.after.time_s; };
    const auto next = std::upper_bound(entries_.begin(), entries_.end(), time_s, later);
    return propagated((next - 1)->after, time_s);
  }

  /// Of the newest measurement.
  double newest_s() const { return newest_s_; }

 private:
  struct Entry {
    std::optional<PoseObservation> seen;  // none: the beginning
    State after;
    FilterUpdate update;
  };

  State propagated(State state, double time_s) const {
    timeline_.walk(state.time_s, time_s,
                   [&](const auto& stretch) { model_.propagate(state, stretch); });
    state.time_s = time_s;
    return state;
  }

  void redo_from(std::size_t index) {
    for (std::size_t i = index; i < entries_.size(); ++i) {
      Entry& entry = entries_[i];
      entry.after = propagated(entries_[i - 1].after, entry.seen->time_s);
      entry.update = model_.update(entry.after, *entry.seen);
    }
  }

  void redo_after(double time_s) {
    std::size_t index = entries_.size();
    while (index > 1 && entries_[index - 1].after.time_s > time_s) --index;
    redo_from(index);
  }

  /// What is older than the memory becomes the beginning.
  void remember(double time_s) {
    newest_s_ = std::max(newest_s_, time_s);
    const double horizon_s = newest_s_ - history_s_;
    while (entries_.size() > 1 && entries_[1].after.time_s <= horizon_s) entries_.pop_front();
    Entry& first = entries_.front();
    first.seen.reset();
    // Without measurements for long the beginning moves on by itself: memory is bounded.
    if (first.after.time_s < horizon_s - history_s_)
      first.after = propagated(first.after, horizon_s);
    timeline_.forget_before(first.after.time_s);
  }

  Model model_;
  double history_s_;
  double newest_s_ = 0;
  Timeline<Step> timeline_;
  std::deque<Entry> entries_;  // in the order of their times; the first is the beginning
};

}  // namespace occ::internal::track
