// SPDX-License-Identifier: Apache-2.0
// Files that are complete or unchanged, whatever happens while they are written.
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

std::string watched;                      // path of the file that is written
std::vector<std::string> content_synced;  // content of `watched` at each call of fsync

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

// Replaces the C library's function for the library under test, too.
extern "C" int fsync(int descriptor) {
  if (!watched.empty()) content_synced.push_back(content(watched));
  return static_cast<int>(::syscall(SYS_fsync, descriptor));
}

namespace occ {
namespace {

TEST(WriteFile, BytesAreOnTheDiskBeforeTheFileIsRenamed) {
  const test::Folder folder;
  Image image;
  image.width = image.height = 8;
  image.u8.resize(64, 7);
  watched = folder.file("image.png", "before");
  content_synced.clear();
  write_image(watched, image.view());
  ASSERT_EQ(content_synced.size(), 1u);
  EXPECT_EQ(content_synced[0], "before");
  EXPECT_NE(content(watched), "before");
  watched.clear();
}

}  // namespace
}  // namespace occ
