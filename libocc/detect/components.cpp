// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/components.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/bright_pixels.hpp"
#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

constexpr int word = 64;       // pixels that share one threshold: the bits of one machine word
constexpr int band_rows = 64;  // rows that share the thresholds of a word

struct Run {
  int x0, x1;  ///< both ends included
  int label;
};

/// Node of the union-find forest: a growing component, or a link to the one it was merged into.
struct Tree {
  Component part;
  int parent;
};

template <typename P>
class Pass {
 public:
  Pass(const P& pixels, const Background& background, const ThresholdRule& rule)
      : pixels_(pixels),
        background_(background),
        rule_(rule),
        full_scale_(static_cast<int>(std::ceil(std::min(rule.full_scale_dn, 65536.0)))),
        local_(static_cast<std::size_t>((pixels.width() + word - 1) / word)),
        threshold_(local_.size()) {}

  std::vector<Component> run() {
    for (int y = 0; y < pixels_.height(); y += band_rows) {
      set_levels(std::min(y + band_rows / 2, pixels_.height() - 1));
      scan_band(y, std::min(y + band_rows, pixels_.height()));
    }
    current_.clear();
    retire();
    return std::move(done_);
  }

 private:
  using Value = typename P::Value;

  void set_levels(int y) {
    constexpr double top = std::numeric_limits<int>::max() / 2;
    background_.row(y, 0.5 * (word - 1), word, local_);
    lowest_ = std::numeric_limits<int>::max();
    for (std::size_t w = 0; w < local_.size(); ++w) {
      const double limit_dn =
          rule_.level_dn.value_or(local_[w].level_dn + rule_.sigma * local_[w].noise_dn);
      const double limit = std::clamp(std::floor(limit_dn * P::scale), -1.0, top);
      threshold_[w] = static_cast<int>(limit);
      lowest_ = std::min(lowest_, threshold_[w]);
    }
  }

  void scan_band(int y, int end) {
    for (; y < end; ++y) {
      if (current_.empty()) y = first_bright_row(y, end);
      if (y == end) return;
      scan_row(y);
      if (trees_.size() > retire_at_) retire();
    }
  }

  /// First row that may contain a bright pixel. Rows without padding are scanned as one array.
  int first_bright_row(int y, int end) const {
    const int values = pixels_.width() * P::channels;
    if (lowest_ < 0 || pixels_.row(y) + values != pixels_.row(y + 1)) return y;
    const int hit =
        first_block_above(pixels_.row(y), 0, (end - y) * values, channel_limit<P>(lowest_));
    return y + hit / values;
  }

  /// Skips dark blocks and collects the runs of bright pixels of all other words.
  void scan_row(int y) {
    std::swap(above_, current_);
    current_.clear();
    next_above_ = 0;
    const Value* row = pixels_.row(y);
    const int values = pixels_.width() * P::channels;
    const Value limit = channel_limit<P>(lowest_);
    int open = -1;  // start of a run that has reached the end of the last word
    int end = 0;    // end of the last word
    while (end < pixels_.width()) {
      const int from = end * P::channels;
      const int hit = lowest_ < 0 ? from : first_block_above(row, from, values, limit);
      if (hit >= values) break;
      const int x0 = hit / (word * P::channels) * word;
      if (open >= 0 && x0 != end) add_run(y, std::exchange(open, -1), end - 1);
      const int count = std::min(word, pixels_.width() - x0);
      const int threshold = threshold_[x0 / word];
      read_bits(bright_pixels<P>(row, x0, count, threshold), x0, y, open);
      end = x0 + count;
    }
    if (open >= 0) add_run(y, open, end - 1);
  }

  void read_bits(std::uint64_t bits, int x0, int y, int& open) {
    for (int at = 0;;) {
      if (open < 0) {
        const std::uint64_t set = bits >> at;
        if (!set) return;
        at += __builtin_ctzll(set);
        open = x0 + at;
      }
      const std::uint64_t clear = ~bits >> at;
      if (!clear) return;  // bright to the end of the word
      at += __builtin_ctzll(clear);
      add_run(y, std::exchange(open, -1), x0 + at - 1);
    }
  }

  void add_run(int y, int x0, int x1) {
    while (next_above_ < above_.size() && above_[next_above_].x1 < x0 - 1) ++next_above_;
    int label = -1;
    for (std::size_t k = next_above_; k < above_.size() && above_[k].x0 <= x1 + 1; ++k) {
      const int root = find(above_[k].label);
      label = label < 0 ? root : unite(label, root);
    }
    if (label < 0) {
      label = static_cast<int>(trees_.size());
      trees_.push_back({Component{}, label});
    }
    current_.push_back({x0, x1, label});
    Component& component = trees_[label].part;
    for (int x = x0; x <= x1;) {
      const int last = std::min(x1, x - x % word + word - 1);
      component += measure(y, x, last);
      x = last + 1;
    }
  }

  /// Measures the part of a run within one word. Sums are exact integers about its first pixel.
  Component measure(int y, int x0, int x1) const {
    const Value* row = pixels_.row(y);
    int peak = 0, saturated = 0;
    std::int64_t s0 = 0, s1 = 0, s2 = 0;
    for (int i = 0, x = x0; x <= x1; ++i, ++x) {
      const int level = P::level(row, x);
      peak = std::max(peak, level);
      saturated += P::brightest(row, x) >= full_scale_;
      s0 += level;
      s1 += static_cast<std::int64_t>(level) * i;
      s2 += static_cast<std::int64_t>(level) * (i * i);
    }
    const Background::Local& local = local_[x0 / word];
    const double n = x1 - x0 + 1;
    const double i1 = n * (n - 1) / 2, i2 = (n - 1) * n * (2 * n - 1) / 6;
    const double dn = 1.0 / P::scale;
    Component part;
    part.x0 = x0;
    part.x1 = x1;
    part.y0 = part.y1 = y;
    part.area_px = x1 - x0 + 1;
    part.saturated_px = saturated;
    part.peak_dn = dn * peak;
    part.background_dn = local.level_dn;
    part.noise_dn = local.noise_dn;
    part.shape = about_origin(n, i1, i2, x0, y);
    part.grey = about_origin(dn * static_cast<double>(s0) - n * local.level_dn,
                             dn * static_cast<double>(s1) - i1 * local.level_dn,
                             dn * static_cast<double>(s2) - i2 * local.level_dn, x0, y);
    return part;
  }

  static Moments about_origin(double s0, double s1, double s2, double x0, double y) {
    const double x = s1 + x0 * s0;
    return {s0, x, y * s0, s2 + 2 * x0 * s1 + x0 * x0 * s0, y * x, y * y * s0};
  }

  int find(int label) {
    auto parent = [this](int i) -> int& { return trees_[i].parent; };
    while (parent(label) != label) {
      parent(label) = parent(parent(label));  // path halving
      label = parent(label);
    }
    return label;
  }

  int unite(int a, int b) {
    if (a == b) return a;
    if (b < a) std::swap(a, b);
    trees_[a].part += trees_[b].part;
    trees_[b].parent = a;
    return a;
  }

  /// Moves finished components (without a run in the current row) to done_.
  void retire() {
    std::vector<int> new_label(trees_.size(), -1);
    std::vector<Tree> growing;
    for (Run& run : current_) {
      const int root = find(run.label);
      int& label = new_label[root];
      if (label < 0) {
        label = static_cast<int>(growing.size());
        growing.push_back({trees_[root].part, label});
      }
      run.label = label;
    }
    for (std::size_t i = 0; i < trees_.size(); ++i)
      if (trees_[i].parent == static_cast<int>(i) && new_label[i] < 0) finish(trees_[i].part);
    trees_ = std::move(growing);
    retire_at_ = std::max<std::size_t>(1024, 2 * trees_.size());
  }

  void finish(Component& component) {
    if (component.area_px < rule_.min_area_px) return;
    component.touches_border = component.x0 == 0 || component.y0 == 0 ||
                               component.x1 == pixels_.width() - 1 ||
                               component.y1 == pixels_.height() - 1;
    done_.push_back(component);
    if (done_.size() < 2 * rule_.keep) return;
    const auto brighter = [](const Component& a, const Component& b) {
      return a.grey.sum > b.grey.sum;
    };
    std::nth_element(done_.begin(), done_.begin() + static_cast<std::ptrdiff_t>(rule_.keep),
                     done_.end(), brighter);
    done_.resize(rule_.keep);
  }

  const P& pixels_;
  const Background& background_;
  const ThresholdRule& rule_;
  const int full_scale_;
  std::vector<Background::Local> local_;  ///< background of each word in this band of rows
  std::vector<int> threshold_;  ///< level (times scale) that a bright pixel of the word exceeds
  int lowest_ = 0;              ///< smallest threshold of all words
  std::vector<Run> above_, current_;
  std::size_t next_above_ = 0;
  std::vector<Tree> trees_;
  std::size_t retire_at_ = 1024;
  std::vector<Component> done_;
};

}  // namespace

std::vector<Component> find_components(const ImageView& image, const Background& background,
                                       const ThresholdRule& rule) {
  return visit_pixels(image,
                      [&](const auto& pixels) { return Pass(pixels, background, rule).run(); });
}

}  // namespace occ::internal::detect
