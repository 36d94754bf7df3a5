// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_bodies.hpp"

#include <algorithm>
#include <utility>

namespace occ::internal::detect {

bool stacked(const LineBox& a, const LineBox& b) {
  const LineBox& longer = a.length() >= b.length() ? a : b;
  const LineBox& shorter = a.length() >= b.length() ? b : a;
  const int middle = (shorter.pos0 + shorter.pos1) / 2;
  const int gap = std::max(a.line0, b.line0) - std::min(a.line1, b.line1) - 1;
  return middle >= longer.pos0 && middle <= longer.pos1 && 2 * gap <= longer.length();
}

namespace {

struct Part {
  LineBox box;
  int area = 0;
};

struct Run {
  int pos0, pos1, part;
};

int root(std::vector<int>& parent, int i) {
  while (parent[i] != i) {
    int& up = parent[i];
    up = parent[up];
    i = up;
  }
  return i;
}

std::vector<Run> runs_above(const LineWindow& window, int line, double level) {
  std::vector<Run> runs;
  const float* signal = window.line(line);
  for (int i = 0; i < window.samples; ++i) {
    if (!(signal[i] > level)) continue;
    const int first = i;
    while (i < window.samples && signal[i] > level) ++i;
    runs.push_back({window.pos(first), std::min(window.pos(i) - 1, window.box.pos1), -1});
  }
  return runs;
}

/// Connected sets (8 neighbours) of pixels above the level.
std::vector<Part> connected_parts(const LineWindow& window, double level) {
  std::vector<Part> parts;
  std::vector<int> parent;
  std::vector<Run> above;
  for (int line = window.box.line0; line <= window.box.line1; ++line) {
    std::vector<Run> runs = runs_above(window, line, level);
    for (Run& run : runs) {
      for (const Run& other : above) {
        if (other.pos0 > run.pos1 + 1 || other.pos1 < run.pos0 - 1) continue;
        const int with = root(parent, other.part);
        if (run.part < 0)
          run.part = with;
        else
          parent[with] = root(parent, run.part);
      }
      if (run.part < 0) {
        run.part = static_cast<int>(parts.size());
        parent.push_back(run.part);
        parts.push_back({{line, line, run.pos0, run.pos1}, 0});
      }
      Part& part = parts[run.part];
      part.box += {line, line, run.pos0, run.pos1};
      part.area += run.pos1 - run.pos0 + 1;
    }
    above = std::move(runs);
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto to = static_cast<std::size_t>(root(parent, static_cast<int>(i)));
    if (to == i) continue;
    parts[to].box += parts[i].box;
    parts[to].area += parts[i].area;
    parts[i].area = 0;
  }
  parts.erase(
      std::remove_if(parts.begin(), parts.end(), [](const Part& part) { return part.area == 0; }),
      parts.end());
  return parts;
}

/// Pieces of one stripe, side by side: they share lines and nearly touch.
bool side_by_side(const LineBox& a, const LineBox& b) {
  const int shared = std::min(a.line1, b.line1) - std::max(a.line0, b.line0) + 1;
  const int gap = std::max(a.pos0, b.pos0) - std::min(a.pos1, b.pos1) - 1;
  return 2 * shared >= std::min(a.lines(), b.lines()) &&
         gap <= std::max(2, std::max(a.length(), b.length()) / 16);
}

/// Merges what `together` says, in place, until nothing changes.
template <typename F>
void merge_boxes(std::vector<LineBox>& boxes, F&& together) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = i + 1; j < boxes.size();) {
      if (!together(boxes[i], boxes[j])) {
        ++j;
        continue;
      }
      boxes[i] += boxes[j];
      boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(j));
      j = i + 1;
    }
  }
}

/// Where a stack of stripes (sorted by line) falls into two lamps: index of the first stripe of the
/// second, or 0.
std::size_t break_in(const std::vector<LineBox>& stripes) {
  const std::size_t n = stripes.size();
  if (n < 4) return 0;
  std::vector<int> gaps;
  for (std::size_t i = 1; i < n; ++i) gaps.push_back(stripes[i].line0 - stripes[i - 1].line1 - 1);
  std::vector<int> sorted = gaps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const int usual = sorted[sorted.size() / 2];
  const auto widest = std::max_element(gaps.begin(), gaps.end());
  if (*widest > 1.8 * usual + 2) return static_cast<std::size_t>(widest - gaps.begin()) + 1;
  // A waist: a stripe much shorter than one before and one behind it.
  for (std::size_t i = 1; i + 1 < n; ++i) {
    int before = 0, behind = 0;
    for (std::size_t k = 0; k < i; ++k) before = std::max(before, stripes[k].length());
    for (std::size_t k = i + 1; k < n; ++k) behind = std::max(behind, stripes[k].length());
    if (stripes[i].length() < 0.6 * std::min(before, behind))
      return stripes[i].line0 - stripes[i - 1].line1 > stripes[i + 1].line0 - stripes[i].line1
                 ? i
                 : i + 1;
  }
  return 0;
}

void add_bodies(std::vector<LineBox> stripes, std::vector<LineBox>& bodies) {
  if (const std::size_t split = break_in(stripes)) {
    const auto middle = stripes.begin() + static_cast<std::ptrdiff_t>(split);
    add_bodies({stripes.begin(), middle}, bodies);
    add_bodies({middle, stripes.end()}, bodies);
    return;
  }
  LineBox body = stripes.front();
  for (const LineBox& stripe : stripes) body += stripe;
  bodies.push_back(body);
}

}  // namespace

std::vector<LineBox> find_bodies(const LineWindow& window, double level) {
  std::vector<Part> parts = connected_parts(window, level);
  int largest = 0;
  for (const Part& part : parts) largest = std::max(largest, part.area);
  std::vector<LineBox> stripes;
  for (const Part& part : parts)
    if (25 * part.area >= largest) stripes.push_back(part.box);  // smaller ones are speckle
  if (stripes.size() > 500) return {};  // texture, and the search below is quadratic
  merge_boxes(stripes, side_by_side);
  std::sort(stripes.begin(), stripes.end(), [](const LineBox& a, const LineBox& b) {
    return a.line0 + a.line1 < b.line0 + b.line1;
  });

  std::vector<std::vector<LineBox>> stacks;
  for (const LineBox& stripe : stripes) {
    const auto fits = [&](const std::vector<LineBox>& stack) {
      return stacked(stack.back(), stripe);
    };
    const auto stack = std::find_if(stacks.begin(), stacks.end(), fits);
    if (stack == stacks.end())
      stacks.push_back({stripe});
    else
      stack->push_back(stripe);
  }
  std::vector<LineBox> bodies;
  for (std::vector<LineBox>& stack : stacks) add_bodies(std::move(stack), bodies);
  return bodies;
}

}  // namespace occ::internal::detect
