// SPDX-License-Identifier: Apache-2.0
// Images read and written here and by OpenCV are the same bits.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "tests/core/image_samples.hpp"

namespace occ {
namespace {

using namespace test;

/// Reads from a file, because OpenCV 4.6 fails for some TIFF files in memory.
cv::Mat opencv_image(const std::string& bytes) {
  const MemoryFile file;
  return cv::imread(file.with(bytes), cv::IMREAD_UNCHANGED);
}

/// Exchanges red and blue: OpenCV has them in the reverse order.
cv::Mat with_red_and_blue_exchanged(const cv::Mat& mat) {
  if (mat.channels() < 3) return mat;
  std::vector<cv::Mat> planes;
  cv::split(mat, planes);
  std::swap(planes[0], planes[2]);
  cv::Mat out;
  cv::merge(planes, out);
  return out;
}

Image read_bytes(const std::string& bytes) {
  const MemoryFile file;
  return read_image(file.with(bytes));
}

::testing::AssertionResult same(const Image& image, const cv::Mat& by_opencv) {
  const cv::Mat expected = with_red_and_blue_exchanged(by_opencv);
  const int type = CV_MAKETYPE(image.type == PixelType::u8 ? CV_8U : CV_16U, image.channels);
  if (image.width != expected.cols || image.height != expected.rows || type != expected.type()) {
    return ::testing::AssertionFailure()
           << image.width << " x " << image.height << ' ' << cv::typeToString(type)
           << " instead of " << expected.cols << " x " << expected.rows << ' '
           << cv::typeToString(expected.type());
  }
  const ImageView view = image.view();
  if (std::memcmp(view.data, expected.data,
                  view.row_bytes * static_cast<std::size_t>(view.height)) == 0) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << "pixels differ";
}

::testing::AssertionResult read_as_by_opencv(const std::string& bytes) {
  return same(read_bytes(bytes), opencv_image(bytes));
}

Image random_image(PixelType type, int channels) {
  Image image{sample_width, sample_height, channels, type, {}, {}};
  Random random(11);
  for (int i = 0; i < image.width * image.height * channels; ++i) {
    const std::uint32_t bits = random.bits();
    if (type == PixelType::u8) image.u8.push_back(static_cast<std::uint8_t>(bits));
    if (type == PixelType::u16) image.u16.push_back(static_cast<std::uint16_t>(bits));
  }
  return image;
}

cv::Mat as_mat(const Image& image) {
  const ImageView view = image.view();
  const int depth = image.type == PixelType::u8 ? CV_8U : CV_16U;
  return with_red_and_blue_exchanged(
      {view.height, view.width, CV_MAKETYPE(depth, view.channels), const_cast<void*>(view.data)});
}

TEST(ImageOracle, PngOfEveryKindHasTheSameBits) {
  for (const PngKind& kind : png_kinds()) {
    for (const int width : {1, 3, sample_width}) {
      EXPECT_TRUE(read_as_by_opencv(png_sample(kind, width, 9)))
          << "type " << kind.type << " bits " << kind.bits << " interlaced " << kind.interlaced
          << " transparent " << kind.transparent << " width " << width;
    }
  }
}

TEST(ImageOracle, JpegOfEveryKindHasTheSameBits) {
  for (const JpegKind& kind : jpeg_kinds()) {
    for (const int width : {1, 16, sample_width, 200}) {
      EXPECT_TRUE(read_as_by_opencv(jpeg_sample(kind, width, 31)))
          << kind.channels << " channels, sampling " << kind.horizontal << " x " << kind.vertical
          << " progressive " << kind.progressive << " restart " << kind.restart << " width "
          << width;
    }
  }
}

/// OpenCV 4.6 multiplies 8-bit colours by a separate alpha, reads planes of 16 bits as if their
/// samples were interleaved, and does not invert 16-bit images whose zero is white.
bool opencv_reads_it(const TiffKind& kind) {
  if (kind.bits == 8) return kind.alpha != EXTRASAMPLE_UNASSALPHA;
  return (!kind.separate || kind.samples == 1) && kind.photometric != PHOTOMETRIC_MINISWHITE;
}

Image expected_tiff(const TiffKind& kind) {
  Image image{sample_width, sample_height, kind.samples, PixelType::u8, {}, {}};
  if (kind.bits == 16) image.type = PixelType::u16;
  const unsigned flip = kind.photometric == PHOTOMETRIC_MINISWHITE ? (1u << kind.bits) - 1 : 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < kind.samples; ++c) {
        const unsigned value = tiff_value(x, y, c, kind.bits) ^ flip;
        if (kind.bits == 8) image.u8.push_back(static_cast<std::uint8_t>(value));
        if (kind.bits == 16) image.u16.push_back(static_cast<std::uint16_t>(value));
      }
    }
  }
  return image;
}

TEST(ImageOracle, TiffOfEveryKindHasTheSameBits) {
  int compared = 0;
  for (const TiffKind& kind : tiff_kinds()) {
    const std::string bytes = tiff_sample(kind);
    const std::string text = std::to_string(kind.samples) + " samples of " +
                             std::to_string(kind.bits) + " bits, compression " +
                             std::to_string(kind.compression) + (kind.tiled ? ", tiled" : "") +
                             (kind.separate ? ", separate" : "");
    EXPECT_TRUE(same(read_bytes(bytes), as_mat(expected_tiff(kind)))) << text;
    if (!opencv_reads_it(kind)) continue;
    EXPECT_TRUE(read_as_by_opencv(bytes)) << text;
    ++compared;
  }
  EXPECT_GT(compared, 80);
}

TEST(ImageOracle, TiffIsNotRotatedByItsTag) {
  TiffKind kind;
  kind.orientation = ORIENTATION_RIGHTTOP;
  EXPECT_TRUE(same(read_bytes(tiff_sample(kind)), as_mat(expected_tiff(kind))));
}

TEST(ImageOracle, PnmHasTheSameBits) {
  const std::string pixels = random_bytes(6 * 5 * 4, 4);
  for (const char* header : {"P5\n5 4\n255\n", "P5 5 4 65535\n", "P6\n# comment\n5 4 255\n",
                             "P6\n5\n4\n65535\n", "P5\n5 4 15\n", "P5\n5 4\n1000\n"}) {
    EXPECT_TRUE(read_as_by_opencv(header + pixels)) << header;
  }
  for (const char* text : {"P2\n3 2\n255\n0 1 2\n200 254 255\n", "P2 3 1 65535 0 256 65535\n",
                           "P3\n1 2\n255\n1 2 3 4 5 6\n", "P3 2 1 1000 1 2 3 998 999 1000\n",
                           "P2\n# a\n3 1 # b\n255\n0 # c\n7 25\n"}) {
    EXPECT_TRUE(read_as_by_opencv(text)) << text;
  }
}

TEST(ImageOracle, OpenCvReadsWhatIsWritten) {
  for (const char* extension : {".png", ".tiff", ".pgm", ".ppm", ".pnm"}) {
    for (const PixelType type : {PixelType::u8, PixelType::u16}) {
      for (const int channels : {1, 3, 4}) {
        const bool is_png = std::string(extension) == ".png";
        const bool is_tiff = std::string(extension) == ".tiff";
        if (channels == 4 && !is_png && !(is_tiff && type == PixelType::u16)) continue;
        if (channels == (std::string(extension) == ".pgm" ? 3 : 1) && extension[2] != 'n' &&
            !is_tiff) {
          continue;
        }
        const Image image = random_image(type, channels);
        const std::vector<unsigned char> bytes = encode_image(extension, image.view());
        EXPECT_TRUE(same(image, opencv_image({bytes.begin(), bytes.end()})))
            << extension << " channels " << channels;
      }
    }
  }
}

TEST(ImageOracle, JpegIsWrittenWithTheSameBytes) {
  for (const int channels : {1, 3}) {
    const Image image = random_image(PixelType::u8, channels);
    std::vector<unsigned char> expected;
    ASSERT_TRUE(cv::imencode(".jpg", as_mat(image), expected));
    EXPECT_EQ(encode_image(".jpg", image.view()), expected);
  }
}

}  // namespace
}  // namespace occ
