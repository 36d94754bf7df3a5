// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/expose.hpp"
#include "libocc/simulate/internal/mosaic.hpp"

namespace occ::internal::simulate {

using namespace internal::radiometry;
namespace {

// The sensor without the effects that the plan leaves out.
Sensor simplified(const Frame& frame) {
  Sensor sensor = frame.scene.sensor;
  for (const EffectModel* model : effect_models())
    if (model->remove && !frame.plan.applies(model->effect)) model->remove(sensor);
  return sensor;
}

// Functions on rows may write beyond `count`, up to a whole batch.
constexpr int batch = Digitiser::batch;
static_assert(batch <= Signal::padding && batch <= LitNoise::batch && batch <= DarkNoise::padding);

template <Simd>
LIBOCC_INLINE void with_base_body(const double* signal, double even, double odd, int count,
                                  float* __restrict to) {
  for (int first = 0; first < count; first += batch)
    for (int i = first; i < first + batch; ++i)
      to[i] = static_cast<float>(signal[i] + (i % 2 == 0 ? even : odd));
}
LIBOCC_MULTIVERSION(with_base,
                    (const double* signal, double even, double odd, int count, float* to),
                    (signal, even, odd, count, to))

}  // namespace

bool SensorRows::Key::operator==(const Key& other) const {
  return std::tie(mosaic, response, saturation, noise, everywhere) ==
         std::tie(other.mosaic, other.response, other.saturation, other.noise, other.everywhere);
}

SensorRows::Key SensorRows::key_of(const Frame& frame, const Signal& signal) {
  return {frame.plan.applies(Effect::mosaic), frame.plan.applies(Effect::response),
          frame.plan.applies(Effect::saturation), frame.plan.applies(Effect::noise),
          signal.everywhere()};
}

SensorRows::SensorRows(Simd simd, const Frame& frame, const Key& key)
    : simd_(simd),
      key_(key),
      full_well_e_(simplified(frame).full_well_e),
      width_(static_cast<std::uint32_t>(frame.scene.camera.width())),
      lit_noise_(simplified(frame)) {
  const Sensor all = simplified(frame);
  for (std::size_t place = 0; place < kinds_.size(); ++place) {
    const double base_e = all.electrons(0) + key.everywhere[place];
    const bool by_colour = all.mosaic != Mosaic::none && !all.channels.empty();
    const std::size_t colour = by_colour ? colour_at(all.mosaic, place) : 0;
    for (std::size_t other = 0; other < place && !kinds_[place]; ++other)
      if (kinds_[other]->base_e == base_e && kinds_[other]->colour == colour)
        kinds_[place] = kinds_[other];
    if (kinds_[place]) continue;
    const Sensor sensor = sensor_at(all, place);
    auto kind = std::make_shared<Kind>(Kind{colour, base_e, Digitiser(sensor), {}});
    if (key.noise) kind->dark.emplace(sensor, kind->digitiser, base_e);
    kinds_[place] = kind;
  }
  const std::size_t width = width_;
  mean_e_.resize(width + LitNoise::batch);
  drawn_e_.resize(width + LitNoise::batch);
  levels_.resize(width + DarkNoise::padding);
  others_.resize(width + DarkNoise::padding);
}

std::array<int, 4> SensorRows::background_dn() const {
  std::array<int, 4> levels;
  for (std::size_t place = 0; place < levels.size(); ++place)
    levels[place] =
        kinds_[place]->digitiser.grey_level(std::min(kinds_[place]->base_e, full_well_e_));
  return levels;
}

// Combines the levels of the two kinds of pixels that a row has at most. levels_of(kind, to)
// computes all pixels as if they were of one kind.
template <typename Levels>
const std::vector<std::uint16_t>& SensorRows::for_kinds(const RowPart& part, Levels levels_of) {
  const Kind &first = kind(part.x0, part.y), &second = kind(part.x0 + 1, part.y);
  levels_of(first, levels_.data());
  if (&first == &second) return levels_;
  levels_of(second, others_.data());
  for (std::size_t i = 1; i < static_cast<std::size_t>(part.count); i += 2) levels_[i] = others_[i];
  return levels_;
}

const std::vector<std::uint16_t>& SensorRows::without_noise(const RowPart& part) {
  return for_kinds(part, [&](const Kind& kind, std::uint16_t* levels) {
    kind.digitiser.grey_levels(simd_, kind.base_e, full_well_e_, part.signal, part.count, levels);
  });
}

// Draws electrons for the means in mean_e_.
void SensorRows::draw_lit(const NoiseKey& noise, const RowPart& part) {
  lit_noise_.draw(simd_, noise, lit_words_.of(simd_, noise, pixels_of(part)), part.first,
                  part.count, mean_e_.data(), drawn_e_.data());
}

const std::vector<std::uint16_t>& SensorRows::dark(const NoiseKey& noise, const RowPart& part) {
  return for_kinds(part, [&](const Kind& kind, std::uint16_t* levels) {
    if (kind.dark->tabulated())
      return kind.dark->draw(simd_, noise, dark_words_.of(simd_, noise, pixels_of(part)),
                             part.first, part.count, levels);
    std::fill_n(mean_e_.begin(), part.count, static_cast<float>(kind.base_e));
    draw_lit(noise, part);
    kind.digitiser.grey_levels(simd_, drawn_e_.data(), part.count, levels);
  });
}

const std::vector<std::uint16_t>& SensorRows::lit(const NoiseKey& noise, const RowPart& part) {
  with_base_for(simd_)(part.signal, kind(part.x0, part.y).base_e, kind(part.x0 + 1, part.y).base_e,
                       part.count, mean_e_.data());
  draw_lit(noise, part);
  return for_kinds(part, [&](const Kind& kind, std::uint16_t* levels) {
    kind.digitiser.grey_levels(simd_, drawn_e_.data(), part.count, levels);
  });
}

}  // namespace occ::internal::simulate
