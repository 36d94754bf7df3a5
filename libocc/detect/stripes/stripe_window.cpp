// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_window.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "libocc/core/statistics.hpp"

namespace occ::internal::detect {

LineBox& LineBox::operator+=(const LineBox& other) {
  line0 = std::min(line0, other.line0);
  line1 = std::max(line1, other.line1);
  pos0 = std::min(pos0, other.pos0);
  pos1 = std::max(pos1, other.pos1);
  return *this;
}

LineBox LineBox::grown(int by_lines, int by_pos) const {
  return {line0 - by_lines, line1 + by_lines, pos0 - by_pos, pos1 + by_pos};
}

LineBox LineBox::cut_to(const LineBox& other) const {
  return {std::max(line0, other.line0), std::min(line1, other.line1), std::max(pos0, other.pos0),
          std::min(pos1, other.pos1)};
}

bool LineBox::meets(const LineBox& other) const {
  const LineBox common = cut_to(other);
  return common.lines() > 0 && common.length() > 0;
}

bool LineBox::holds(double line, double pos) const {
  return line >= line0 && line <= line1 && pos >= pos0 && pos <= pos1;
}

LineBox line_box(const Component& c, bool columns) {
  return columns ? LineBox{c.x0, c.x1, c.y0, c.y1} : LineBox{c.y0, c.y1, c.x0, c.x1};
}

LineBox line_box(const LinearImage& image, bool columns) {
  const int width = image.width(), height = image.height();
  return columns ? LineBox{0, width - 1, 0, height - 1} : LineBox{0, height - 1, 0, width - 1};
}

LineWindow::LineWindow(const LinearImage& image, const LineBox& part, bool columns,
                       double background_dn, int every)
    : box(part), stride(every), samples((part.length() + every - 1) / every) {
  const auto lines = static_cast<std::size_t>(box.lines());
  const auto length = static_cast<std::size_t>(samples), step = static_cast<std::size_t>(stride);
  const auto background = static_cast<float>(image.linear_dn(background_dn));
  signal.resize(lines * length);
  std::vector<float> row(columns ? lines : static_cast<std::size_t>(box.length()));
  if (columns) {
    for (std::size_t i = 0; i < length; ++i) {
      image.read(box.line0, pos(static_cast<int>(i)), box.lines(), 1, row.data());
      for (std::size_t line = 0; line < lines; ++line)
        signal[line * length + i] = row[line] - background;
    }
  } else {
    for (std::size_t line = 0; line < lines; ++line) {
      image.read(box.pos0, box.line0 + static_cast<int>(line), box.length(), 1, row.data());
      for (std::size_t i = 0; i < length; ++i)
        signal[line * length + i] = row[i * step] - background;
    }
  }
}

int LineWindow::sample_from(double pos) const {
  const double sample = std::ceil((pos - box.pos0) / stride);
  return static_cast<int>(std::clamp(sample, 0.0, static_cast<double>(samples)));
}

int limited_stride(const LineBox& box) {
  return 1 + static_cast<int>(static_cast<double>(box.lines()) * box.length() / 65536);
}

double robust_peak(const LineWindow& window, double lit) {
  std::vector<float> values;
  for (std::size_t i = 0; i < window.signal.size(); i += 3)  // a third of the samples suffices
    if (window.signal[i] > lit) values.push_back(window.signal[i]);
  if (values.empty()) return 0;
  const std::size_t rank = std::min(values.size() - 1, values.size() / 50);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end(), std::greater<>());
  return *at;
}

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

struct LineRun {
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

std::vector<LineRun> runs_above(const LineWindow& window, int line, double level) {
  std::vector<LineRun> runs;
  const float* signal = window.line(line);
  for (int i = 0; i < window.samples; ++i) {
    if (!(signal[i] > level)) continue;
    const int first = i;
    while (i < window.samples && signal[i] > level) ++i;
    runs.push_back({window.pos(first), std::min(window.pos(i) - 1, window.box.pos1), -1});
  }
  return runs;
}

/// Connected components (8 neighbours) of pixels above the level.
std::vector<Part> connected_parts(const LineWindow& window, double level) {
  std::vector<Part> parts;
  std::vector<int> parent;
  std::vector<LineRun> above;
  for (int line = window.box.line0; line <= window.box.line1; ++line) {
    std::vector<LineRun> runs = runs_above(window, line, level);
    for (LineRun& run : runs) {
      for (const LineRun& other : above) {
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

/// True for pieces of one stripe side by side: they have lines in common and nearly touch.
bool side_by_side(const LineBox& a, const LineBox& b) {
  const int shared = std::min(a.line1, b.line1) - std::max(a.line0, b.line0) + 1;
  const int gap = std::max(a.pos0, b.pos0) - std::min(a.pos1, b.pos1) - 1;
  return 2 * shared >= std::min(a.lines(), b.lines()) &&
         gap <= std::max(2, std::max(a.length(), b.length()) / 16);
}

/// Merges, in place, all pairs of boxes for which together(a, b) is true.
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

/// Returns where a stack of stripes (sorted by line) splits into two lamps: the index of the first
/// stripe of the second lamp, or 0 for one lamp.
std::size_t find_break(const std::vector<LineBox>& stripes) {
  const std::size_t n = stripes.size();
  if (n < 4) return 0;
  std::vector<double> gaps;
  for (std::size_t i = 1; i < n; ++i) gaps.push_back(stripes[i].line0 - stripes[i - 1].line1 - 1);
  const auto widest = std::max_element(gaps.begin(), gaps.end());
  // Nearly twice the median gap: a missing stripe, or two lamps.
  if (*widest > 1.8 * median(gaps) + 2) return static_cast<std::size_t>(widest - gaps.begin()) + 1;
  // A waist: a stripe much shorter than one before and one after it.
  for (std::size_t i = 1; i + 1 < n; ++i) {
    int before = 0, after = 0;
    for (std::size_t k = 0; k < i; ++k) before = std::max(before, stripes[k].length());
    for (std::size_t k = i + 1; k < n; ++k) after = std::max(after, stripes[k].length());
    if (stripes[i].length() < 0.6 * std::min(before, after))
      return stripes[i].line0 - stripes[i - 1].line1 > stripes[i + 1].line0 - stripes[i].line1
                 ? i
                 : i + 1;
  }
  return 0;
}

/// Appends the boxes of the lamps in a stack of stripes.
void add_regions(std::vector<LineBox> stripes, std::vector<LineBox>& regions) {
  if (const std::size_t split = find_break(stripes)) {
    const auto middle = stripes.begin() + static_cast<std::ptrdiff_t>(split);
    add_regions({stripes.begin(), middle}, regions);
    add_regions({middle, stripes.end()}, regions);
    return;
  }
  LineBox region = stripes.front();
  for (const LineBox& stripe : stripes) region += stripe;
  regions.push_back(region);
}

}  // namespace

std::vector<LineBox> find_lamp_regions(const LineWindow& window, double level) {
  std::vector<Part> parts = connected_parts(window, level);
  int largest = 0;
  for (const Part& part : parts) largest = std::max(largest, part.area);
  std::vector<LineBox> stripes;
  for (const Part& part : parts)
    if (25 * part.area >= largest) stripes.push_back(part.box);  // smaller ones are noise
  if (stripes.size() > 500) return {};  // texture; bounds the quadratic search below
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
  std::vector<LineBox> regions;
  for (std::vector<LineBox>& stack : stacks) add_regions(std::move(stack), regions);
  return regions;
}

}  // namespace occ::internal::detect
