// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/budget.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>

#include "libocc/codes/code_kinds.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

/// Requirements of a code.
struct Needs {
  double chip_hz = 0;       ///< rate of the chips (ufsook, s2psk: half periods)
  double chips = 0;         ///< min number of chips in one image
  double max_exposure = 1;  ///< [chips]
};
Needs needs_of(const Code& code) {
  switch (code.kind) {
    case CodeKind::c_ook:
      return {code.clock_hz, static_cast<double>(c_ook_sub_packet_chips(code)), 1};
    case CodeKind::ufsook:
      return {2 * ufsook_tones(code).mark_hz, 0, 0.5};
    case CodeKind::s2psk:
      return {2 * s2psk_hz(code), 0, 0.5};
    case CodeKind::csk:
      return {code.clock_hz, 1, 1};
  }
  throw std::invalid_argument("kind is not a CodeKind");
}

/// Part of a packet that one frame covers sufficiently, for any phase of the frame.
double part_seen(const Code& code, const CodeBudget& budget, bool exact_times) {
  const double in_view = budget.chips_in_view / (budget.period_s * code.clock_hz);
  if (code.kind != CodeKind::c_ook || exact_times) return in_view;
  const double repeats = std::max(code.repeats, 2);  // one repeat may be cut at each end
  return (repeats - 1) / repeats / c_ook_sub_packets(code);
}

/// Number of frames after which the largest gap between the phases of the frames is at most `part`
/// of the packet; infinity if the phases repeat before.
double frames_for_packet(const Code& code, double period_s, double part) {
  if (code.kind == CodeKind::ufsook || code.kind == CodeKind::s2psk)
    return std::ceil(period_s * code.frame_rate_hz);
  constexpr int max_frames = 1000;  // more are regarded as never
  const double step = 1 / (code.frame_rate_hz * period_s);
  std::set<double> begun;
  for (int frame = 0; frame < max_frames; ++frame) {
    begun.insert(step * frame - std::floor(step * frame));
    double before = *begun.rbegin() - 1, gap = 0;
    for (const double at : begun) {
      gap = std::max(gap, at - before);
      before = at;
    }
    if (gap <= part) return frame + 1;
  }
  return std::numeric_limits<double>::infinity();
}

/// Reason why the code does not fit; empty if it does.
std::string reason(const Code& code, const CodeBudget& budget, const Needs& needs) {
  std::ostringstream text;
  text.precision(3);
  if (budget.exposure_chips > needs.max_exposure)
    text << "the exposure is " << budget.exposure_chips << " of the "
         << (needs.chips > 0 ? "chips" : "half periods") << " of " << to_string(code.kind)
         << ", must be at most " << needs.max_exposure;
  else if (budget.row_chips > 0.5)
    text << "rows are " << budget.row_chips << " chips apart, must be at most 0.5";
  else if (budget.chips_in_view < budget.chips_needed)
    text << "the lamp's image holds " << budget.chips_in_view << " chips, " << to_string(code.kind)
         << " needs " << budget.chips_needed;
  else if (std::isinf(budget.frames_needed))
    text << "frames at " << code.frame_rate_hz << " Hz always fall on the same parts of packets of "
         << budget.period_s << " s";
  return text.str();
}

}  // namespace

CodeBudget code_budget(const Code& code, double rows, double row_time_s, double exposure_s,
                       bool exact_times) {
  require(rows >= 0 && std::isfinite(rows), "rows", rows, "zero or positive");
  require(row_time_s >= 0 && std::isfinite(row_time_s), "row_time_s", row_time_s,
          "zero or positive");
  require(exposure_s > 0 && std::isfinite(exposure_s), "exposure_s", exposure_s, "positive");
  const SlotCode slots = slot_code(code);
  const Needs needs = needs_of(code);
  CodeBudget budget;
  budget.chips_in_view = rows * row_time_s * needs.chip_hz;
  budget.chips_needed = exact_times ? std::min(1.0, needs.chips) : needs.chips;
  budget.exposure_chips = exposure_s * needs.chip_hz;
  budget.row_chips = needs.chips > 0 ? row_time_s * needs.chip_hz : 0;
  budget.period_s = slots.chips / slots.chip_rate_hz;
  budget.frames_needed =
      frames_for_packet(code, budget.period_s, part_seen(code, budget, exact_times));
  budget.message = reason(code, budget, needs);
  budget.fits = budget.message.empty();
  return budget;
}

}  // namespace occ
