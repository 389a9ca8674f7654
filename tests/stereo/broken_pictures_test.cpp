#include <unistd.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>

#include "palpate/stereo/frame_source.h"
#include "palpate/stereo/read_through.h"
#include "tests/stereo/small_recordings.h"

namespace palpate {
namespace {

using test::camera;
using test::kLeftLevel;
using test::kRightLevel;
using test::sentence_of;
using test::TemporaryFolder;
using test::write_video;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kPatience_s = 60;

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

/// What `call` throws as Unfinished; empty when it throws none.
template <class Call>
std::string loss_of(const Call& call) {
  try {
    call();
  } catch (const Unfinished& reason) {
    return reason.what();
  }
  return {};
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
  EXPECT_THAT(loss_of([&] { read_through(options, kPatience_s); }), HasSubstr("right_1.jpg is cut short"));
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

TEST(BrokenPictures, AVideoThatIsCutIsFoundByReadingItThrough) {
  const TemporaryFolder folder;
  RecordingOptions options;
  options.left = folder / "left.avi";
  options.right = folder / "right.avi";
  write_video(options.left, camera(kLeftLevel, 60));
  write_video(options.right, camera(kRightLevel, 60));
  EXPECT_THAT(read_through(options, kPatience_s), IsEmpty());
  EXPECT_THAT(read_through(options, 0),
              ElementsAre(HasSubstr("left.avi: of 60 frames the first 0 were looked at"), HasSubstr("right.avi")));
  cut(options.right, 0.7);
  EXPECT_THAT(loss_of([&] { read_through(options, kPatience_s); }),
              AllOf(HasSubstr("recording.right"), HasSubstr("right.avi ends after"), HasSubstr("its header states")));
}

class DamagedVideo : public test::MadeByFfmpeg {};

TEST_F(DamagedVideo, ItsDamagedFramesAreCountedAndTheFirstIsNamed) {
  // Key frames only: each stands alone.
  make("left.avi", "-vf noise=alls=60:allf=t -c:v libx264 -profile:v baseline -g 1 -pix_fmt yuv420p", "left.mp4");
  make("right.avi", "-c:v libx264 -pix_fmt yuv420p", "right.mp4");
  EXPECT_THAT(read_through(options("left.mp4", "right.mp4"), kPatience_s), IsEmpty());
  std::string bytes = read("left.mp4");
  const size_t pictures = bytes.find("mdat");
  for (const double part : {0.46, 0.76})
    for (size_t i = 0; i < 100; ++i)
      bytes[pictures + static_cast<size_t>(part * static_cast<double>(bytes.size() - pictures)) + i] = '\0';
  folder_.write("left.mp4", bytes);
  EXPECT_THAT(read_through(options("left.mp4", "right.mp4"), kPatience_s),
              ElementsAre(HasSubstr("left.mp4: 2 of the frames read from it are damaged, the first is frame 4")));
  Recording recording(options("left.mp4", "right.mp4"));
  int frames = 0;
  while (recording.next()) ++frames;
  EXPECT_EQ(frames, 10);
  EXPECT_THAT(recording.damages(), ElementsAre(HasSubstr("left.mp4: at least")));
}

}  // namespace
}  // namespace palpate
