// SPDX-License-Identifier: Apache-2.0
// Writes the camera's pose in every image of a folder as a trajectory in TUM format:
//   follow_folder SCENE.yaml FOLDER FRAMES_PER_SECOND > walk.tum
#include <filesystem>
#include <iostream>
#include <set>

#include "libocc/core/image_file.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/scene/trajectory.hpp"
#include "libocc/track/tracker.hpp"

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: follow_folder SCENE.yaml FOLDER FRAMES_PER_SECOND\n";
    return 2;
  }
  occ::Tracker tracker(occ::read_scene(argv[1]));
  std::set<std::filesystem::path> files;  // by name
  for (const auto& entry : std::filesystem::directory_iterator(argv[2])) files.insert(entry.path());
  std::vector<occ::Waypoint> walk;
  int count = 0;
  for (const auto& file : files) {
    const occ::Image image = occ::read_image(file.string());
    const auto frame = tracker.add_image(image.view(), count++ / std::stod(argv[3]));
    std::cerr << frame.time_s << " s " << to_string(frame.state) << ' ' << frame.reason << '\n';
    if (frame.state == occ::TrackerState::tracking)
      walk.push_back({frame.time_s, frame.cam_from_world});
  }
  if (walk.empty()) return 1;
  std::cout << occ::format_trajectory(occ::Trajectory(walk));
}
