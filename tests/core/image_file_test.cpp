// SPDX-License-Identifier: Apache-2.0
// Image files: round trips, and every way a file can be wrong.
#include "libocc/core/image_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "libocc/core/random.hpp"

namespace occ {
namespace {

namespace fs = std::filesystem;

class ImageFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("occ_image_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string put(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  static std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }

  fs::path folder_;
};

Image random_image(PixelType type, int channels) {
  Image image;
  image.width = 37;
  image.height = 23;
  image.channels = channels;
  image.type = type;
  Random random(7);
  for (int i = 0; i < image.width * image.height * channels; ++i) {
    if (type == PixelType::u8) {
      image.u8.push_back(static_cast<std::uint8_t>(random.bits()));
    } else {
      image.u16.push_back(static_cast<std::uint16_t>(random.bits()));
    }
  }
  return image;
}

std::string error_of(const std::string& path) {
  try {
    read_image(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "nothing thrown";
}

::testing::AssertionResult refused(const std::string& path, const std::string& reason) {
  const std::string message = error_of(path);
  if (message.find(path) == 0 && message.find(reason) != std::string::npos) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << "message was: " << message;
}

TEST_F(ImageFile, LosslessFormatsKeepEveryBit) {
  for (const char* name : {"a.png", "b.tiff", "c.PNG"}) {
    for (const PixelType type : {PixelType::u8, PixelType::u16}) {
      for (const int channels : {1, 3, 4}) {
        const Image image = random_image(type, channels);
        write_image(path(name), image.view());
        const Image back = read_image(path(name));
        EXPECT_EQ(back.width, image.width);
        EXPECT_EQ(back.height, image.height);
        EXPECT_EQ(back.channels, channels);
        ASSERT_EQ(back.type, type) << name;
        EXPECT_EQ(back.u8, image.u8) << name << " channels " << channels;
        EXPECT_EQ(back.u16, image.u16) << name << " channels " << channels;
      }
    }
  }
}

TEST_F(ImageFile, PgmAndPpmKeepEveryBit) {
  for (const PixelType type : {PixelType::u8, PixelType::u16}) {
    for (const char* name : {"a.pgm", "a.ppm", "colour.pnm", "grey.pnm"}) {
      const bool is_grey = std::string(name) == "a.pgm" || std::string(name) == "grey.pnm";
      const Image image = random_image(type, is_grey ? 1 : 3);
      write_image(path(name), image.view());
      const Image back = read_image(path(name));
      EXPECT_EQ(back.channels, image.channels);
      EXPECT_EQ(back.u8, image.u8) << name;
      EXPECT_EQ(back.u16, image.u16) << name;
    }
  }
}

TEST_F(ImageFile, RowsMayBePadded) {
  const Image image = random_image(PixelType::u8, 1);
  ImageView left_half = image.view();
  left_half.width = 10;
  write_image(path("half.png"), left_half);
  const Image back = read_image(path("half.png"));
  ASSERT_EQ(back.width, 10);
  EXPECT_EQ(back.u8.at(10), image.u8.at(37));
}

TEST_F(ImageFile, OverwritesWholeAndLeavesNothingBeside) {
  write_image(path("a.png"), random_image(PixelType::u8, 3).view());
  const Image image = random_image(PixelType::u8, 1);
  write_image(path("a.png"), image.view());
  EXPECT_EQ(read_image(path("a.png")).u8, image.u8);
  EXPECT_EQ(files(), std::vector<std::string>{"a.png"});
}

TEST_F(ImageFile, RefusesATruncatedPngAtEveryLength) {
  write_image(path("whole.png"), random_image(PixelType::u8, 1).view());
  const std::string bytes = bytes_of(path("whole.png"));
  for (std::size_t size = 8; size < bytes.size(); size += 7) {
    EXPECT_TRUE(refused(put("cut.png", bytes.substr(0, size)), "truncated")) << size;
  }
  EXPECT_TRUE(refused(put("cut.png", bytes.substr(0, bytes.size() - 1)), "truncated"));
  EXPECT_NO_THROW(read_image(put("longer.png", bytes + "what a camera appended")));
}

TEST_F(ImageFile, RefusesATruncatedJpegAtEveryLength) {
  write_image(path("whole.jpg"), random_image(PixelType::u8, 3).view());
  const std::string bytes = bytes_of(path("whole.jpg"));
  for (std::size_t size = 3; size < bytes.size(); size += 11) {
    EXPECT_TRUE(refused(put("cut.jpg", bytes.substr(0, size)), "truncated")) << size;
  }
  EXPECT_TRUE(refused(put("cut.jpg", bytes.substr(0, bytes.size() - 1)), "truncated"));
  EXPECT_NO_THROW(read_image(put("longer.jpg", bytes + "what a camera appended")));
}

TEST_F(ImageFile, AThumbnailsEndIsNotTheJpegsEnd) {
  write_image(path("whole.jpg"), random_image(PixelType::u8, 1).view());
  std::string bytes = bytes_of(path("whole.jpg"));
  bytes.insert(2, std::string("\xFF\xE1\x00\x06\xFF\xD8\xFF\xD9", 8));
  EXPECT_NO_THROW(read_image(put("thumbnail.jpg", bytes)));
  EXPECT_TRUE(refused(put("cut.jpg", bytes.substr(0, bytes.size() / 2)), "truncated"));
}

TEST_F(ImageFile, RefusesWhatIsNotAnImage) {
  EXPECT_TRUE(refused(path("missing.png"), "No such file"));
  EXPECT_TRUE(refused(folder_.string(), "directory"));
  EXPECT_TRUE(refused(put("empty.png", ""), "empty"));
  EXPECT_TRUE(refused(put("text.png", "lamps: 4\n"), "not an image"));
  EXPECT_TRUE(refused(put("header.png", "\x89PNG"), "not an image"));
}

TEST_F(ImageFile, RefusesFloatingPointPixels) {
  const std::string one_float_pixel("Pf\n1 1\n-1.0\n\0\0\x80\x3f", 16);
  EXPECT_TRUE(refused(put("float.pfm", one_float_pixel), "8- or 16-bit unsigned"));
}

TEST_F(ImageFile, RefusesToWriteWhatItCannot) {
  const Image image = random_image(PixelType::u8, 1);
  const Image deep = random_image(PixelType::u16, 1);
  EXPECT_THROW(write_image(path("no_folder/a.png"), image.view()), std::runtime_error);
  EXPECT_THROW(write_image(path("a"), image.view()), std::runtime_error);
  EXPECT_THROW(write_image(path("a.nonsense"), image.view()), std::runtime_error);
  EXPECT_THROW(write_image(path("deep.jpg"), deep.view()), std::runtime_error);
  EXPECT_THROW(write_image(path("a.png"), ImageView{}), std::invalid_argument);
  EXPECT_TRUE(files().empty());
}

TEST_F(ImageFile, NamesWhatAFormatDoesNotStore) {
  const auto message = [](const std::string& extension, const Image& image) -> std::string {
    try {
      encode_image(extension, image.view());
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "encoded";
  };
  const Image grey = random_image(PixelType::u8, 1), colour = random_image(PixelType::u8, 3);
  const Image alpha = random_image(PixelType::u8, 4), deep = random_image(PixelType::u16, 1);
  EXPECT_EQ(message(".webp", grey),
            "cannot be encoded as \".webp\"; the formats are .png, .jpg, .jpeg, .tif, .tiff, .pgm, "
            ".ppm, .pnm");
  EXPECT_EQ(message(".jpg", deep), "16-bit pixels need .png, .tiff, .pgm or .ppm, got \".jpg\"");
  EXPECT_EQ(message(".jpg", alpha), "\".jpg\" cannot store 4-channel images; use .png or .tiff");
  EXPECT_EQ(message(".pgm", colour), "\".pgm\" cannot store 3-channel images; use .png or .tiff");
  EXPECT_EQ(message(".ppm", grey), "\".ppm\" cannot store 1-channel images; use .png or .tiff");
  Image wide = grey;
  wide.width = 70000, wide.height = 1;
  wide.u8.resize(70000);
  EXPECT_NE(message(".jpg", wide).find("cannot be encoded as JPEG: "), std::string::npos);
}

TEST_F(ImageFile, AFailedRenameLeavesNothingBeside) {
  fs::create_directories(path("folder.png"));
  const Image image = random_image(PixelType::u8, 1);
  EXPECT_THROW(write_image(path("folder.png"), image.view()), std::runtime_error);
  EXPECT_EQ(files(), std::vector<std::string>{"folder.png"});
}

}  // namespace
}  // namespace occ
