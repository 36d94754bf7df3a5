// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_links.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "libocc/survey/internal/tag_views.hpp"

namespace occ::internal::survey {
namespace {

int track_of(const SurveyPicture& picture, std::size_t blob) {
  return picture.tracks.empty() ? -1 : picture.tracks[blob];
}

/// Ids that two blobs of one picture have, with a note for each.
std::set<int> repeated_ids(const std::vector<SurveyPicture>& pictures,
                           std::vector<std::string>& notes) {
  std::set<int> repeated;
  for (const SurveyPicture& picture : pictures) {
    std::set<int> seen;
    for (const Blob& blob : picture.blobs)
      if (blob.lamp_id && !tag_of(blob) && !seen.insert(*blob.lamp_id).second &&
          repeated.insert(*blob.lamp_id).second)
        notes.push_back(picture.name + ": several blobs have the id " +
                        std::to_string(*blob.lamp_id) + ", which is therefore not used");
  }
  return repeated;
}

}  // namespace

LampLinks::LampLinks(const std::vector<SurveyPicture>& pictures, std::vector<std::string>& notes) {
  const std::set<int> unreliable = repeated_ids(pictures, notes);
  const auto id_of = [&](const Blob& blob) {
    const bool is_used = !tag_of(blob) && blob.lamp_id && unreliable.count(*blob.lamp_id) == 0;
    return is_used ? blob.lamp_id : std::nullopt;
  };
  std::map<int, std::map<int, int>> reads;  // of each id, by track
  for (const SurveyPicture& picture : pictures)
    for (std::size_t b = 0; b < picture.blobs.size(); ++b)
      if (const auto id = id_of(picture.blobs[b]); id && track_of(picture, b) >= 0)
        ++reads[track_of(picture, b)][*id];
  std::map<int, int> id_of_track;
  std::set<int> changed;  // tracks that went from one lamp to another
  for (const auto& [track, ids] : reads) {
    if (ids.size() == 1) {
      id_of_track[track] = ids.begin()->first;
      continue;
    }
    changed.insert(track);
    notes.push_back("track " + std::to_string(track) + " shows lamps with the ids " +
                    std::to_string(ids.begin()->first) + " and " +
                    std::to_string(ids.rbegin()->first) + "; neither is used there");
  }
  std::map<int, int> link_of_id, link_of_track;
  const auto link_of = [&](std::map<int, int>& links, int key, std::optional<int> code) {
    const auto [entry, is_new] = links.emplace(key, count());
    if (is_new) code_of_link_.push_back(code);
    return entry->second;
  };
  for (const SurveyPicture& picture : pictures) {
    std::vector<int>& links = links_.emplace_back();
    for (std::size_t b = 0; b < picture.blobs.size(); ++b) {
      const int track = track_of(picture, b);
      std::optional<int> id = id_of(picture.blobs[b]);
      if (const auto known = id_of_track.find(track); known != id_of_track.end())
        id = known->second;
      const Blob& blob = picture.blobs[b];
      if (changed.count(track) > 0 || blob.cut_by_border || blob.merged)
        links.push_back(-1);
      else if (id)
        links.push_back(link_of(link_of_id, *id, id));
      else
        links.push_back(track < 0 ? -1 : link_of(link_of_track, track, std::nullopt));
    }
    const std::vector<int> all = links;
    for (int& link : links)
      if (std::count(all.begin(), all.end(), link) > 1) link = -1;
  }
}

std::optional<int> LampLinks::code(int link) const {
  return link < 0 ? std::nullopt : code_of_link_[link];
}

}  // namespace occ::internal::survey
