// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_window.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

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

int modest_stride(const LineBox& box) {
  return 1 + static_cast<int>(static_cast<double>(box.lines()) * box.length() / 65536);
}

double robust_peak(const LineWindow& window, double lit) {
  std::vector<float> values;
  for (std::size_t i = 0; i < window.signal.size(); i += 3)  // a third tells as much
    if (window.signal[i] > lit) values.push_back(window.signal[i]);
  if (values.empty()) return 0;
  const std::size_t rank = std::min(values.size() - 1, values.size() / 50);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end(), std::greater<>());
  return *at;
}

}  // namespace occ::internal::detect
