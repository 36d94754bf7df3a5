// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/decode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "libocc/core/require.hpp"
#include "libocc/decode/lamp_rows.hpp"

namespace occ {
namespace {

template <typename T>
void keep_brighter(std::vector<T>& kept, const std::vector<T>& other) {
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = std::max(kept[i], other[i]);
}

/// Pixel-wise maximum of the frames [from, to).
Image brightest(const std::vector<Image>& frames, std::size_t from, std::size_t to) {
  Image kept = frames[from];
  for (std::size_t f = from + 1; f < to; ++f) {
    keep_brighter(kept.u8, frames[f].u8);
    keep_brighter(kept.u16, frames[f].u16);
  }
  return kept;
}

std::vector<FrameBlobs> blobs_of(const std::vector<SequenceFrame>& frames, const Sensor& sensor,
                                 const DecodeOptions& options) {
  DetectOptions detecting = options.detect;
  detecting.sensor = sensor;
  detecting.stripes = false;
  detecting.max_blobs = std::min(detecting.max_blobs, options.max_lamps);
  std::vector<Image> grey;
  for (const SequenceFrame& frame : frames) grey.push_back(to_grey(frame.image));
  const std::size_t n = frames.size();
  const auto half = static_cast<std::size_t>(options.join_frames / 2);
  std::vector<FrameBlobs> found(n);
  for (std::size_t f = 0; f < n; ++f) {
    found[f].time_s = frames[f].time_s;
    if (options.join_frames == 0 && f > 0) {
      found[f].blobs = found[0].blobs;
      continue;
    }
    const std::size_t from = options.join_frames == 0 || f < half ? 0 : f - half;
    const std::size_t to = options.join_frames == 0 ? n : std::min(n, f + half + 1);
    found[f].blobs = detect(brightest(grey, from, to).view(), detecting);
  }
  return found;
}

const Blob* blob_of(const TrackPoint& point, const std::vector<FrameBlobs>& found) {
  if (!point.blob) return nullptr;
  return &found[point.frame].blobs[*point.blob];
}

/// Blob of a lamp in a frame. Without a blob in that frame, the last one before it (else the first
/// after it), moved to the position of the track.
Blob blob_at(int frame, const Track& track, const std::vector<FrameBlobs>& found,
             const DecodeOptions& options) {
  Blob blob;
  for (const TrackPoint& point : track.points)
    if (const Blob* seen = blob_of(point, found))
      if (point.frame <= frame || blob.area_px == 0) blob = *seen;
  if (options.join_frames == 0) return blob;
  const Eigen::Vector2d place = track.points[frame].px;
  const Eigen::Vector2i by = (place - blob.centroid_px).array().round().cast<int>();
  blob.x0 += by.x();
  blob.x1 += by.x();
  blob.y0 += by.y();
  blob.y1 += by.y();
  blob.ellipse.centre_px += place - blob.centroid_px;
  blob.centroid_px = place;
  blob.covariance_px2 += std::pow(options.track.position_sigma_px, 2) * Eigen::Matrix2d::Identity();
  blob.rim.clear();
  return blob;
}

/// Half the size of a lamp's blobs: 90 % quantile, because neighbours may enlarge a few of them.
Eigen::Vector2d half_size(const Track& track, const std::vector<FrameBlobs>& found) {
  constexpr double edge_px = 2;  // light just outside the box, below the threshold
  std::array<std::vector<double>, 2> sizes;
  for (const TrackPoint& point : track.points)
    if (const Blob* blob = blob_of(point, found)) {
      sizes[0].push_back(0.5 * (blob->x1 - blob->x0 + 1));
      sizes[1].push_back(0.5 * (blob->y1 - blob->y0 + 1));
    }
  for (std::vector<double>& s : sizes) std::sort(s.begin(), s.end());
  const std::size_t at = sizes[0].size() * 9 / 10;
  return {sizes[0][at] + edge_px, sizes[1][at] + edge_px};
}

/// Light of a lamp's lines in every frame.
std::vector<std::vector<LineLight>> lines_of(const Track& track, const Eigen::Vector2d& half,
                                             const std::vector<SequenceFrame>& frames,
                                             const Sensor& sensor) {
  std::vector<std::vector<LineLight>> lines;
  for (const TrackPoint& point : track.points) {
    const SequenceFrame& frame = frames[point.frame];
    lines.push_back(lamp_lines(frame.image, sensor, frame.time_s, {point.px, half.x(), half.y()}));
  }
  return lines;
}

std::vector<LightSample> with_channel(std::vector<LightSample> samples, int channel) {
  for (LightSample& sample : samples) sample.channel = channel;
  return samples;
}

double distance_px(const Track& a, const Track& b) {
  double sum = 0;
  for (std::size_t f = 0; f < a.points.size(); ++f) sum += (a.points[f].px - b.points[f].px).norm();
  return sum;
}

bool better(const DecodedCode& a, const DecodedCode& b) {
  return std::tuple(a.ok(), a.explained) > std::tuple(b.ok(), b.explained);
}

/// Decodes a lamp with each of its three nearest neighbours as the reference; keeps the best
/// result.
void decode_pair(std::size_t lamp, const std::vector<std::vector<LightSample>>& samples,
                 const DecodeOptions& options, std::vector<DecodedLamp>& lamps) {
  constexpr std::size_t most = 3;
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < lamps.size(); ++i)
    if (i != lamp) others.push_back(i);
  std::sort(others.begin(), others.end(), [&](std::size_t a, std::size_t b) {
    return distance_px(lamps[lamp].track, lamps[a].track) <
           distance_px(lamps[lamp].track, lamps[b].track);
  });
  others.resize(std::min(most, others.size()));
  for (const std::size_t other : others) {
    std::vector<LightSample> both = with_channel(samples[lamp], 0);
    const std::vector<LightSample> reference = with_channel(samples[other], 1);
    both.insert(both.end(), reference.begin(), reference.end());
    DecodedCode read = decode_samples(both, options.code, options.samples);
    if (!better(read, lamps[lamp].code)) continue;
    lamps[lamp].code = std::move(read);
    lamps[lamp].reference = static_cast<int>(other);
  }
}

/// Tracks with at least min_seen blobs, in their order. If there are more than max_lamps, those
/// with the most blobs.
std::vector<Track> lasting_tracks(const std::vector<FrameBlobs>& found,
                                  const DecodeOptions& options) {
  std::vector<Track> tracks = track_blobs(found, options.track);
  std::vector<int> seen;
  for (const Track& track : tracks) seen.push_back(track.seen);
  std::sort(seen.begin(), seen.end(), std::greater<>());
  int min_seen = std::min(options.min_seen, static_cast<int>(found.size()));
  const auto max_tracks = static_cast<std::size_t>(options.max_lamps);
  if (seen.size() > max_tracks) min_seen = std::max(min_seen, seen[max_tracks - 1]);
  tracks.erase(std::remove_if(tracks.begin(), tracks.end(),
                              [&](const Track& track) { return track.seen < min_seen; }),
               tracks.end());
  tracks.resize(std::min(tracks.size(), max_tracks));
  return tracks;
}

void check(const std::vector<SequenceFrame>& frames) {
  require(!frames.empty(), "frames", frames.size(), "one at least");
  std::vector<double> times_s;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const std::string name = "frames[" + std::to_string(f) + "]";
    const ImageView &image = frames[f].image, &first = frames[0].image;
    image.validate(name);
    const bool same =
        image.width == first.width && image.height == first.height && image.type == first.type;
    if (!same)
      require(false, name, std::to_string(image.width) + " x " + std::to_string(image.height),
              "like the first, " + std::to_string(first.width) + " x " +
                  std::to_string(first.height) + " of the same type");
    times_s.push_back(frames[f].time_s);
  }
  require_in_order(times_s);
}

/// True if two blobs are so close that they may be parts of one lamp that noise has split.
bool at_same_place(const Blob& a, const Blob& b) {
  const double reach_x = 0.75 * (a.x1 - a.x0 + b.x1 - b.x0) + 2;
  const double reach_y = 0.75 * (a.y1 - a.y0 + b.y1 - b.y0) + 2;
  const Eigen::Vector2d apart = (a.centroid_px - b.centroid_px).cwiseAbs();
  return apart.x() <= reach_x && apart.y() <= reach_y;
}

/// Role of a blob among those with the same decoded id.
enum class Role {
  main,       ///< the only one at its place, or the brightest part of a lamp
  part,       ///< part of a lamp with a brighter part
  duplicate,  ///< another place has the same id
};
Role role_of(const DecodedLamp& lamp, const std::vector<DecodedLamp>& lamps) {
  Role role = Role::main;
  for (const DecodedLamp& other : lamps) {
    if (&other == &lamp || other.code.id != lamp.code.id) continue;
    if (!at_same_place(lamp.blob, other.blob)) return Role::duplicate;
    const auto order = [](const DecodedLamp& l) { return std::pair(l.blob.flux_dn, &l); };
    if (order(other) > order(lamp)) role = Role::part;
  }
  return role;
}

}  // namespace

void DecodeOptions::validate() const {
  code.validate();
  require(join_frames >= 0 && join_frames != 2, "join_frames", join_frames,
          "0 or a number of frames about one: 1, 3, 5, ...");
  require(min_seen >= 1, "min_seen", min_seen, "at least 1");
  require(max_lamps >= 1, "max_lamps", max_lamps, "at least 1");
  detect.validate();
  track.validate();
  samples.validate();
}

Result<std::vector<DecodedLamp>> decode_lamps(const std::vector<SequenceFrame>& frames,
                                              const Sensor& sensor, const DecodeOptions& options) {
  options.validate();
  sensor.validate();
  check(frames);
  if (options.code.kind == CodeKind::csk)
    require(sensor.mosaic != Mosaic::none, "sensor.mosaic", "none", "known for colour codes");
  const std::vector<FrameBlobs> found = blobs_of(frames, sensor, options);
  Result<std::vector<DecodedLamp>> out;
  std::vector<std::vector<LightSample>> samples;
  for (Track& track : lasting_tracks(found, options)) {
    const Eigen::Vector2d half = half_size(track, found);
    samples.push_back(light_samples(lines_of(track, half, frames, sensor), sensor));
    DecodedLamp& lamp = out.value.emplace_back();
    lamp.frame = std::max(0, static_cast<int>(frames.size()) - 1 - options.join_frames / 2);
    lamp.blob = blob_at(lamp.frame, track, found, options);
    const double rows = 2 * (sensor.readout == Readout::columns ? half.x() : half.y());
    lamp.budget = code_budget(options.code, rows, sensor.row_time_s, sensor.exposure_s,
                              options.samples.exact_times);
    lamp.track = std::move(track);
  }
  for (std::size_t i = 0; i < out.value.size(); ++i) {
    DecodedLamp& lamp = out.value[i];
    if (!lamp.budget.fits) {
      lamp.code.message = "not tried: " + lamp.budget.message;
    } else if (options.code.kind == CodeKind::s2psk) {
      decode_pair(i, samples, options, out.value);
    } else {
      // Other codes do not use colour: the pixels of all colours are samples of one channel.
      const bool coloured = options.code.kind == CodeKind::csk;
      lamp.code = decode_samples(coloured ? samples[i] : with_channel(samples[i], 0), options.code,
                                 options.samples);
    }
  }
  if (out.value.empty()) {
    out.status = Status::no_lamps;
    out.message = "no lamp was detected in any frame";
  }
  return out;
}

Result<std::vector<Blob>> identified_blobs(const std::vector<DecodedLamp>& lamps, const Scene& map,
                                           const Code& code) {
  std::map<int, int> lamp_of_id;
  for (const Lamp& lamp : map.lamps) {
    if (!lamp.code || lamp.code->code.kind != code.kind || lamp.code->channel != 0) continue;
    const bool is_new = lamp_of_id.emplace(lamp.code->id, lamp.id).second;
    require(is_new, "map: code id", lamp.code->id, "of one lamp only");
  }
  Result<std::vector<Blob>> out;
  std::string unknown, duplicate;
  for (const DecodedLamp& lamp : lamps) {
    Blob& blob = out.value.emplace_back(lamp.blob);
    if (!lamp.code.id) continue;
    const int id = static_cast<int>(*lamp.code.id);
    const auto entry = lamp_of_id.find(id);
    if (entry == lamp_of_id.end())
      unknown += " " + std::to_string(id);
    else if (const Role role = role_of(lamp, lamps); role == Role::duplicate)
      duplicate += " " + std::to_string(id);
    else if (role == Role::main)
      blob.lamp_id = entry->second;
  }
  if (lamps.empty()) out.status = Status::no_lamps;
  if (!unknown.empty()) out.message += "not in the map:" + unknown + ". ";
  if (!duplicate.empty())
    out.message += "read at several places, so not assigned to any lamp:" + duplicate + ". ";
  return out;
}

}  // namespace occ
