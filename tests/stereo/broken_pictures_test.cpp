#include <unistd.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>

#include "palpate/stereo/frame_source.h"
#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

cv::Mat textured() {
  cv::Mat image(120, 160, CV_8UC3);
  cv::setRNGSeed(1);
  cv::randu(image, 0, 255);
  cv::GaussianBlur(image, image, {}, 2);
  return image;
}

void cut(const std::filesystem::path& file, double part) {
  std::filesystem::resize_file(file,
                               static_cast<uintmax_t>(part * static_cast<double>(std::filesystem::file_size(file))));
}

TEST(BrokenPictures, ACutImageIsRefusedAndNotShownInPart) {
  const TemporaryFolder folder;
  for (const char* ending : {"png", "jpg", "bmp", "webp", "tif", "ppm", "jp2"})
    for (const double part : {0.5, 0.95}) {
      const std::filesystem::path file = folder / fmt::format("image.{}", ending);
      cv::imwrite(file.string(), textured());
      ASSERT_EQ(sentence_of([&] { open_frame_source(file, "recording.left", 0); }), "") << ending;
      cut(file, part);
      EXPECT_THAT(sentence_of([&] { open_frame_source(file, "recording.left", 0); }),
                  AllOf(HasSubstr("recording.left"), HasSubstr(file.string())))
          << ending << " cut at " << part;
    }
  cv::imwrite((folder / "image.jpg").string(), textured(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  cut(folder / "image.jpg", 0.6);
  EXPECT_THAT(sentence_of([&] { open_frame_source(folder / "image.jpg", "recording.left", 0); }),
              HasSubstr("image.jpg is cut short"));
}

TEST(BrokenPictures, AnImageThatIsCutInTheMiddleIsNamedWhenItIsItsTurn) {
  const TemporaryFolder folder;
  for (int i = 0; i < 3; ++i)
    for (const char* side : {"left", "right"})
      cv::imwrite((folder / fmt::format("{}_{}.jpg", side, i)).string(), textured());
  cut(folder / "right_1.jpg", 0.5);
  RecordingOptions options;
  options.left = folder / "left_%d.jpg";
  options.right = folder / "right_%d.jpg";
  Recording recording(options);
  EXPECT_TRUE(recording.next());
  EXPECT_THAT(sentence_of([&] { recording.next(); }), HasSubstr("right_1.jpg is cut short"));
}

/// As a user who may not read everything.
std::string sentence_as_nobody(const std::filesystem::path& images) {
  constexpr uid_t kNobody = 65534;
  const bool is_root = geteuid() == 0;
  if (is_root && seteuid(kNobody) != 0) return "the user does not change";
  const std::string sentence = sentence_of([&] { open_frame_source(images, "recording.left", 0); });
  if (is_root && seteuid(0) != 0) return "the user does not change back";
  return sentence;
}

TEST(BrokenPictures, AnImageThatMayNotBeReadSaysSo) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "image7.png";
  cv::imwrite(file.string(), textured());
  std::filesystem::permissions(file, std::filesystem::perms::none);
  for (const std::filesystem::path& images : {file, folder / "image%d.png"})
    EXPECT_THAT(sentence_as_nobody(images), AllOf(HasSubstr("image7.png"), HasSubstr("Permission denied"))) << images;
}

TEST(BrokenPictures, AnAddressToWhichNothingIsSentIsGivenUp) {
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_THAT(sentence_of([] { open_frame_source("udp://127.0.0.1:59467", "recording.left", 0); }),
              AllOf(HasSubstr("recording.left: udp://127.0.0.1:59467"), HasSubstr("no picture within 5 s")));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(20));
}

}  // namespace
}  // namespace palpate
