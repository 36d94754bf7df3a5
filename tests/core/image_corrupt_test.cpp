// SPDX-License-Identifier: Apache-2.0
// Corrupt, forged and unsupported image files: an error with its reason, never a crash, output on
// stderr, or memory out of proportion to the file.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <string>

#include "libocc/core/image_file.hpp"
#include "tests/core/image_samples.hpp"

namespace occ {
namespace {

using namespace test;
using namespace std::string_literals;

class ImageBytes : public ::testing::Test {
 protected:
  void SetUp() override { ::testing::internal::CaptureStderr(); }
  void TearDown() override { EXPECT_EQ(::testing::internal::GetCapturedStderr(), ""); }

  Image read(const std::string& bytes) const { return read_image(file_.with(bytes)); }

  /// Text of the error after the file's name; "read" if there is none.
  std::string error_of(const std::string& bytes) const {
    try {
      read(bytes);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(file_.path().size() + 2);
    }
    return "read";
  }

  ::testing::AssertionResult refused(const std::string& bytes, const std::string& reason) const {
    const std::string error = error_of(bytes);
    if (error.find(reason) != std::string::npos) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "message was: " << error;
  }

  /// False for a consistent image; another exception than std::runtime_error fails the test.
  bool fails(const std::string& bytes) const {
    try {
      const Image image = read(bytes);
      image.view().validate();
      return false;
    } catch (const std::runtime_error&) {
      return true;
    }
  }

  MemoryFile file_;
};

std::vector<std::string> small_files() {
  std::vector<std::string> files = {"P2\n3 2\n255\n0 1 2\n200 254 255\n", "P3 1 1 1000 1 2 999\n",
                                    "P5\n4 3\n255\n" + random_bytes(12, 1),
                                    "P6\n2 3\n65535\n" + random_bytes(36, 1)};
  for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_PALETTE, PNG_COLOR_TYPE_RGB_ALPHA}) {
    files.push_back(png_sample({type, 8, type == PNG_COLOR_TYPE_GRAY}, 9, 7));
  }
  files.push_back(png_sample({PNG_COLOR_TYPE_PALETTE, 2, false, true}, 9, 7));
  for (const bool progressive : {false, true}) {
    files.push_back(jpeg_sample({1, 1, 1, progressive}, 9, 7));
    files.push_back(jpeg_sample({3, 2, 2, progressive, false, false, 2}, 9, 7));
  }
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
    files.push_back(tiff_sample({1, 8, compression}));
    files.push_back(tiff_sample({3, 16, compression, true, true}));
  }
  files.push_back(tiff_sample({4, 8, COMPRESSION_LZW, false, false, -1, 0, "wb8"}));
  return files;
}

TEST_F(ImageBytes, FlippedBytesGiveAnErrorOrAnImage) {
  Random random(5);
  int errors = 0, images = 0;
  for (const std::string& file : small_files()) {
    ASSERT_EQ(error_of(file), "read");
    for (int i = 0; i < 400; ++i) {
      std::string bytes = file;
      for (int flips = 1 + random.below(3); flips > 0; --flips) {
        const auto at = static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())));
        bytes[at] = static_cast<char>(random.bits());
      }
      if (i % 2 == 0 && bytes.compare(1, 3, "PNG") == 0) {  // otherwise check sums hide the rest
        bytes = with_png_chunks(bytes, [](std::string&, std::size_t, std::size_t) {});
      }
      ++(fails(bytes) ? errors : images);
    }
  }
  EXPECT_GT(errors, 1000);
  EXPECT_GT(images, 100);
}

TEST_F(ImageBytes, CutFilesGiveAnError) {
  for (const std::string& file : small_files()) {
    for (std::size_t size = 0; size < file.size(); size += 1 + file.size() / 100) {
      const bool is_text = file[1] == '2' || file[1] == '3';
      if (is_text && size + 5 > file.size()) break;  // the last number may be shorter
      EXPECT_TRUE(fails(file.substr(0, size))) << file.substr(0, 4) << size;
    }
  }
}

long max_memory_kib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST_F(ImageBytes, ForgedSizesAreRefusedWithoutTheirMemory) {
  const std::string png = png_sample({}), jpeg = jpeg_sample({}),
                    progressive = jpeg_sample({3, 2, 2, true});
  const std::string strips = tiff_sample({}), tiles = tiff_sample({1, 8, COMPRESSION_LZW, true});
  const long before = max_memory_kib();
  const std::string many = "268435456 pixels are allowed", few = "bytes cannot contain";
  const std::string wrong = "cannot be decoded as TIFF: ";
  EXPECT_TRUE(refused(with_tiff_tag(strips, TIFFTAG_IMAGEWIDTH, 1u << 31), many));
  EXPECT_TRUE(refused(with_tiff_tag(strips, TIFFTAG_IMAGEWIDTH, 1u << 20), few));
  EXPECT_TRUE(refused(with_png_size(png, 1u << 30, 1u << 30), many));
  EXPECT_TRUE(refused(with_png_size(png, 16384, 16384), few));
  EXPECT_TRUE(refused(with_png_size(png, 0, 5), "width is zero"));
  EXPECT_TRUE(refused(with_jpeg_size(jpeg, 65500, 65500), many));
  EXPECT_TRUE(refused(with_jpeg_size(jpeg, 16000, 16000), few));
  EXPECT_TRUE(refused(with_jpeg_size(progressive, 16000, 16000), few));
  EXPECT_TRUE(refused(with_tiff_tag(strips, TIFFTAG_IMAGELENGTH, 1u << 31), wrong));
  EXPECT_TRUE(refused(with_tiff_tag(strips, TIFFTAG_IMAGELENGTH, 1u << 20), wrong));
  EXPECT_TRUE(refused(with_tiff_tag(tiles, TIFFTAG_IMAGELENGTH, 1u << 22), wrong));
  EXPECT_TRUE(fails(with_tiff_tag(tiles, TIFFTAG_TILEWIDTH, 1u << 30)));
  EXPECT_TRUE(fails(with_tiff_tag(tiles, TIFFTAG_TILELENGTH, 1u << 20)));
  EXPECT_TRUE(refused("P5\n100000 100000\n255\nabc", many));
  EXPECT_TRUE(refused("P6\n16384 16384\n65535\nabc", few));
  EXPECT_TRUE(refused("P2\n16384 16384\n255\n1 2 3", few));
  EXPECT_TRUE(refused("P5\n0 3\n255\n", many));
  EXPECT_LT(max_memory_kib() - before, 50000);
}

TEST_F(ImageBytes, CorruptPngGivesTheReason) {
  const std::string png = png_sample({});
  std::string bad_sum = png;
  bad_sum[bad_sum.find("IDAT") + 40] ^= 1;
  EXPECT_TRUE(refused(bad_sum, "cannot be decoded as PNG: IDAT: "));
  EXPECT_TRUE(refused(with_png_size(png, sample_width, sample_height + 1), "cannot be decoded"));
  EXPECT_TRUE(refused(with_png_size(png, sample_width, sample_height - 1), "cannot be decoded"));
  EXPECT_TRUE(refused("\x89PNG\r\n\x1a\n"s, "truncated"));
}

TEST_F(ImageBytes, PngWithAFaultyColourProfileIsRead) {
  std::string png = png_sample({});
  png.insert(33, big_endian(4, 4) + "iCCP" + "none" + big_endian(0, 4));
  png = with_png_chunks(png, [](std::string&, std::size_t, std::size_t) {});
  EXPECT_EQ(error_of(png), "read");
}

TEST_F(ImageBytes, CorruptJpegGivesTheReason) {
  const std::string jpeg = jpeg_sample({3, 2, 2, false, false, false, 1});
  std::string restarts = jpeg;
  const std::size_t marker = restarts.find("\xFF\xD2");
  ASSERT_NE(marker, std::string::npos);
  EXPECT_TRUE(refused(restarts.erase(marker, 2), "cannot be decoded as JPEG: Corrupt JPEG data"));
  std::string more = jpeg;
  more.insert(more.size() - 2, "abc");
  EXPECT_TRUE(refused(more, "extraneous bytes"));
  EXPECT_TRUE(refused("\xFF\xD8\xFF\xD9"s, "cannot be decoded as JPEG"));
}

TEST_F(ImageBytes, JpegOfThousandsOfScansIsRefused) {
  const std::string jpeg = jpeg_sample({3, 1, 1, false, true});
  const std::size_t last = jpeg.rfind("\xFF\xDA");
  const std::string scan = jpeg.substr(last, jpeg.size() - 2 - last);
  std::string many = jpeg.substr(0, last);
  for (int i = 0; i < 1000; ++i) many += scan;
  EXPECT_TRUE(refused(many + "\xFF\xD9", "more than 200 scans"));
}

TEST_F(ImageBytes, JpegOfOtherColoursIsRefused) {
  EXPECT_TRUE(refused(jpeg_sample({4, 1, 1}), "CMYK; convert it to RGB"));
  EXPECT_TRUE(refused(jpeg_sample({3, 1, 1, false, false, true}), "arithmetic coding"));
}

TEST_F(ImageBytes, TiffOfOtherKindsIsRefused) {
  const auto tiff = [](auto&& change) {
    TiffKind kind;
    change(kind);
    return tiff_sample(kind);
  };
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.bits = 1; }), "8- or 16-bit unsigned, got 1-bit"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.bits = 32, k.sample_format = SAMPLEFORMAT_IEEEFP; }),
                      "8- or 16-bit unsigned, got 32-bit floating point"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.bits = 16, k.sample_format = SAMPLEFORMAT_INT; }),
                      "got 16-bit signed"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.samples = 2; }), "2 channels"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.photometric = PHOTOMETRIC_PALETTE; }),
                      "photometric 3; grey (0, 1) and RGB (2) are read"));
  EXPECT_TRUE(
      refused(tiff([](TiffKind& k) { k.samples = 4, k.photometric = PHOTOMETRIC_SEPARATED; }),
              "photometric 5"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.compression = COMPRESSION_PACKBITS; }),
                      "compression 32773; none (1), LZW (5) and deflate (8, 32946) are read"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.is_thumbnail = true; }), "thumbnail"));
  EXPECT_TRUE(refused(tiff([](TiffKind& k) { k.is_dng = true; }), "DNG"));
}

TEST_F(ImageBytes, CorruptTiffGivesTheReason) {
  const std::string lzw = tiff_sample({1, 8, COMPRESSION_LZW});
  std::string bad = lzw;
  for (std::size_t i = 40; i < 80; ++i) bad[i] = '\xFF';
  EXPECT_TRUE(refused(bad, "cannot be decoded as TIFF: "));
  EXPECT_TRUE(refused("II*\0\x08\0\0\0"s, "cannot be decoded as TIFF"));
  EXPECT_TRUE(refused(with_tiff_tag(lzw, TIFFTAG_STRIPOFFSETS, 0x7FFFFFFF), "cannot be decoded"));
}

TEST_F(ImageBytes, PnmKeepsTheValuesOfItsFile) {
  for (const std::string& file : {"P2 3 1 15 0 7 15"s, "P5 3 1 15\n\0\x07\x0F"s}) {
    EXPECT_EQ(read(file).u8, (std::vector<std::uint8_t>{0, 7, 15})) << file.substr(0, 2);
  }
  EXPECT_EQ(read("P3 1 1 9 1 2 3").u8, (std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_EQ(read("P6 1 1 256\n\0\1\0\2\1\0"s).u16, (std::vector<std::uint16_t>{1, 2, 256}));
}

TEST_F(ImageBytes, FaultyPnmIsRefused) {
  EXPECT_TRUE(refused("P2 2 2 255 1 2 3 ", "is truncated: no sample"));
  EXPECT_TRUE(refused("P2 2 1 255 1 x", "byte 13: sample must be a decimal number"));
  EXPECT_TRUE(refused("P2 2 1 100 1 101", "sample of 101, above the maximum of its header, 100"));
  EXPECT_TRUE(refused("P2 1 1 0 1", "maximum must be 1 to 65535, got 0"));
  EXPECT_TRUE(refused("P5 1 1 65536\nabcd", "got 65536"));
  EXPECT_TRUE(refused("P5 12345678901 1 255\nabcd", "width is too large"));
  EXPECT_TRUE(refused("P5 1 1 255abcd", "white space must follow"));
  EXPECT_TRUE(refused("P5 1 1 255", "truncated"));
  EXPECT_TRUE(refused("P5 2 2 255\nabc", "truncated"));
  EXPECT_TRUE(refused("P5 # no end", "truncated: no width"));
  EXPECT_TRUE(refused("P1 1 1 0", "PBM"));
  EXPECT_TRUE(refused("P4 1 1\n1", "PBM"));
  EXPECT_TRUE(refused("P7\nWIDTH 1\n", "PAM"));
}

TEST_F(ImageBytes, OtherFormatsAreNamedWithAdvice) {
  const auto is = [&](const std::string& bytes, const std::string& start) {
    EXPECT_EQ(error_of(bytes + "and more").find("is " + start + ", which libocc does not read; "),
              0u)
        << error_of(bytes + "and more");
  };
  const std::string box("\0\0\0\x20", 4);
  is(box + "ftypheic", "a HEIC picture");
  is(box + "ftypheix", "a HEIC picture");
  is(box + "ftyphevc", "a HEIC picture");
  is(box + "ftypmif1", "a HEIF picture");
  is(box + "ftypmsf1", "a HEIF picture");
  is(box + "ftypavif", "an AVIF picture");
  is(box + "ftypcrx ", "a raw file of a camera (CR3)");
  is(box + "ftypisom", "a video file (MP4, MOV)");
  is("\0\0\0\x0CjP  \r\n\x87\n"s, "a JPEG 2000 picture");
  is("\xFF\x4F\xFF\x51", "a JPEG 2000 picture");
  is("\0\0\0\x0CJXL \r\n\x87\n"s, "a JPEG XL picture");
  is("\xFF\x0A", "a JPEG XL picture");
  is("RIFF\x10\0\0\0WEBPVP8 "s, "a WebP picture");
  is("RIFF\x10\0\0\0AVI LIST"s, "a video file (AVI)");
  is("GIF89a", "a GIF picture");
  is("BM\x36\0\0\0"s, "a BMP picture");
  is("\x76\x2F\x31\x01", "an OpenEXR picture");
  is("#?RADIANCE\n", "a Radiance HDR picture");
  is("8BPS", "a Photoshop document");
  is("%PDF-1.7\n", "a PDF document");
  is("FUJIFILMCCD-RAW ", "a raw file of a camera (RAF)");
  is("IIU\0"s, "a raw file of a camera (RW2)");
  is("IIRO", "a raw file of a camera (ORF)");
  is("\x93NUMPY", "a NumPy array");
  is("\x1A\x45\xDF\xA3", "a video file (Matroska, WebM)");
  is("PK\x03\x04", "a ZIP archive");
  is("\x1F\x8B", "a gzip archive");
  is("<svg ", "an SVG drawing");
  is("<?xml ", "an XML document");
  is("<!DOCTYPE html>", "a web page");
  is("<html>", "a web page");
  EXPECT_EQ(error_of(box + "ftypheic"),
            "is a HEIC picture, which libocc does not read; convert it to JPEG or PNG, e.g. with "
            "heif-convert, or set the phone's camera to \"most compatible\"");
  EXPECT_EQ(error_of("lamps"), "is not an image that libocc reads (PNG, JPEG, TIFF, PGM or PPM)");
  EXPECT_EQ(error_of(""), "is empty, not an image");
}

}  // namespace
}  // namespace occ
