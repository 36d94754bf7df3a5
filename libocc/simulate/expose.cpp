// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/expose.hpp"

#include <algorithm>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::simulate {
namespace {

template <Simd>
LIBOCC_INLINE void to_bytes_body(const std::uint16_t* levels, int count, std::uint8_t* to) {
  for (int i = 0; i < count; ++i) to[i] = static_cast<std::uint8_t>(levels[i]);
}
LIBOCC_MULTIVERSION(to_bytes, (const std::uint16_t* levels, int count, std::uint8_t* to),
                    (levels, count, to))

void copy_levels(Simd simd, const std::uint16_t* levels, int count, std::uint8_t* to) {
  to_bytes_for(simd)(levels, count, to);
}
void copy_levels(Simd, const std::uint16_t* levels, int count, std::uint16_t* to) {
  std::copy_n(levels, count, to);
}

template <typename Pixel>
std::vector<Pixel>& pixels_of(Image& image) {
  if constexpr (sizeof(Pixel) == 1)
    return image.u8;
  else
    return image.u16;
}

template <typename Pixel>
class Writer {
 public:
  Writer(const Signal& signal, const Frame& frame, SensorRows& rows, Rendered& out)
      : signal_(signal),
        rows_(rows),
        simd_(frame.storage.simd()),
        noise_{frame.options.seed, frame.options.frame},
        noisy_(frame.plan.applies(Effect::noise)),
        noisy_everywhere_(noisy_ && frame.options.noise_area == NoiseArea::everywhere),
        pixels_(pixels_of<Pixel>(out.image)) {}

  bool noisy() const { return noisy_; }
  bool noisy_everywhere() const { return noisy_everywhere_; }

  void write(const PixelRectangle& part, const std::array<int, 4>& level) {
    for (int y = part.y0; y < part.y0 + part.height; ++y) {
      Pixel* to = at(part.x0, y);
      const auto first = static_cast<Pixel>(level[place_of(part.x0, y)]);
      const auto second = static_cast<Pixel>(level[place_of(part.x0 + 1, y)]);
      if (first == second) {
        std::fill_n(to, part.width, first);
        continue;
      }
      for (int i = 0; i < part.width; ++i) to[i] = i % 2 == 0 ? first : second;
    }
  }

  void write_darkness(const PixelRectangle& part) {
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      copy(rows_.dark(noise_, row(part, y)), part, y);
  }

  void write_unlit_rows(const PixelRectangle& part) {
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      if (const RowPart here = row(part, y); !is_lit(here)) copy(rows_.dark(noise_, here), part, y);
  }

  /// Pixels of a lit row without signal are drawn by the same method; their distribution is the
  /// same.
  void write_lit_rows(const PixelRectangle& part) {
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      if (const RowPart here = row(part, y); is_lit(here)) copy(rows_.lit(noise_, here), part, y);
  }

  void write_signal(const PixelRectangle& part) {
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      copy(rows_.without_noise(row(part, y)), part, y);
  }

 private:
  Pixel* at(int x, int y) { return &pixels_[index(x, y)]; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(signal_.width()) +
           static_cast<std::size_t>(x);
  }
  RowPart row(const PixelRectangle& part, int y) const {
    return {part.x0,
            y,
            part.width,
            static_cast<std::uint32_t>(part.y0 + part.height - y),
            static_cast<std::uint32_t>(index(part.x0, y)),
            signal_.row(y) + part.x0};
  }
  static bool is_lit(const RowPart& row) {
    return std::any_of(row.signal, row.signal + row.count, [](double e) { return e > 0; });
  }
  void copy(const std::vector<std::uint16_t>& levels, const PixelRectangle& part, int y) {
    copy_levels(simd_, levels.data(), part.width, at(part.x0, y));
  }

  const Signal& signal_;
  SensorRows& rows_;
  Simd simd_;
  NoiseKey noise_;
  bool noisy_, noisy_everywhere_;
  std::vector<Pixel>& pixels_;
};

template <typename Pixel>
void write_image(const Signal& signal, const Frame& frame, SensorRows& rows, Rendered& out) {
  Image& image = out.image;
  const PixelRectangle whole{0, 0, signal.width(), signal.height()};
  const auto size = static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  const std::array<int, 4> background = rows.background_dn();
  const bool known = out.background_dn == background && image.height == whole.height &&
                     pixels_of<Pixel>(image).size() == size;
  out.background_dn.reset();  // not valid while the image is incomplete
  image.width = whole.width;
  image.height = whole.height;
  pixels_of<Pixel>(image).resize(size);

  Writer<Pixel> writer(signal, frame, rows, out);
  if (writer.noisy_everywhere())
    writer.write_darkness(whole);
  else if (!known)
    writer.write(whole, background);
  else
    for (const PixelRectangle& part : out.lit) writer.write(part, background);
  out.lit = signal.touched();
  for (const PixelRectangle& part : out.lit) {
    if (!writer.noisy()) writer.write_signal(part);
    if (writer.noisy() && !writer.noisy_everywhere()) writer.write_unlit_rows(part);
  }
  if (writer.noisy())  // parts may overlap, so lit rows are written last
    for (const PixelRectangle& part : out.lit) writer.write_lit_rows(part);
  if (!writer.noisy_everywhere()) out.background_dn = background;
}

}  // namespace

void Exposure::expose(const Signal& signal, const Frame& frame, Rendered& out) {
  const SensorRows::Key key = SensorRows::key_of(frame, signal);
  if (!rows_ || !(rows_->key() == key)) rows_.emplace(simd_, frame, key);
  if (frame.scene.sensor.bit_depth > 8) {
    out.image.type = PixelType::u16;
    out.image.u8.clear();
    write_image<std::uint16_t>(signal, frame, *rows_, out);
  } else {
    out.image.type = PixelType::u8;
    out.image.u16.clear();
    write_image<std::uint8_t>(signal, frame, *rows_, out);
  }
}

}  // namespace occ::internal::simulate
