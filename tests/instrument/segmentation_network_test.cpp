#include "palpate/instrument/segmentation_network.h"

#include <cstdlib>

#include "palpate/instrument/instrument_tracker.h"
#include "tests/instrument/drawn_scene.h"
#include "tests/stereo/files.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

/// Empty where there is no Python.
std::filesystem::path make_network(const TemporaryFolder& folder, const std::string& arguments) {
  const auto script = std::filesystem::path(__FILE__).parent_path() / "make_segmentation_network.py";
  const std::filesystem::path file = folder / "model.onnx";
  const std::string command =
      "PYTHONDONTWRITEBYTECODE=1 python3 '" + script.string() + "' '" + file.string() + "' " + arguments;
  return std::system(command.c_str()) == 0 ? file : std::filesystem::path();
}

double overlap(const cv::Mat& a, const cv::Mat& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

#define NEEDS_NETWORK(file) \
  if (file.empty()) GTEST_SKIP() << "python3, which writes the network, is missing"

TEST(SegmentationNetwork, FindsTheInstrumentWithOneChannelOrSeveralAndInImagesOfAnotherSize) {
  const TemporaryFolder folder;
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  for (const char* arguments :
       {"--output sigmoid", "--output logit", "--output classes", "--output sigmoid --size 180 320"}) {
    const std::filesystem::path file = make_network(folder, arguments);
    NEEDS_NETWORK(file);
    const SegmentationNetwork network(file, {}, image.size());
    const cv::Mat mask = network.mask(image);
    ASSERT_EQ(mask.size(), image.size()) << arguments;
    EXPECT_GT(overlap(mask, truth), 0.93) << arguments;
  }
}

TEST(SegmentationNetwork, LetterBoxesImagesForAFixedInput) {
  const TemporaryFolder folder;
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  for (const char* arguments : {"--output logit --size 256 256", "--output classes --size 400 300",
                                "--output sigmoid --size 256 320 --channels-last"}) {
    const std::filesystem::path file = make_network(folder, arguments);
    NEEDS_NETWORK(file);
    EXPECT_GT(overlap(SegmentationNetwork(file, {}, image.size()).mask(image), truth), 0.9) << arguments;
  }
}

TEST(SegmentationNetwork, NormalizesTheInputAsToldByKeys) {
  const TemporaryFolder folder;
  const std::filesystem::path file = make_network(folder, "--output logit --normalized 0.45 0.22");
  NEEDS_NETWORK(file);
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  const Vec3 mean = Vec3::Constant(0.45), deviation = Vec3::Constant(0.22);
  EXPECT_GT(overlap(SegmentationNetwork(file, {1, mean, deviation}, image.size()).mask(image), truth), 0.93);
  EXPECT_LT(overlap(SegmentationNetwork(file, {}, image.size()).mask(image), truth), 0.9);
}

TEST(SegmentationNetwork, OfTheProjectRunsOnImagesOfAnySize) {
  for (const cv::Size size : {cv::Size(960, 540), cv::Size(640, 480), cv::Size(360, 288), cv::Size(1280, 1024)}) {
    const SegmentationNetwork network(size);
    const cv::Mat probability = network.probability(cv::Mat(size, CV_8UC3, cv::Scalar(60, 60, 140)));
    EXPECT_TRUE(cv::checkRange(probability, true, nullptr, 0, 1 + 1e-6)) << size;
    EXPECT_NEAR(1.0 * probability.cols / probability.rows, 1.0 * size.width / size.height, 0.2) << size;
    EXPECT_EQ(network.mask(cv::Mat(size, CV_8UC3, cv::Scalar(60, 60, 140))).size(), size);
  }
}

TEST(SegmentationNetwork, TellsClassesApart) {
  const TemporaryFolder folder;
  const std::filesystem::path file = make_network(folder, "--output classes");
  NEEDS_NETWORK(file);
  const test::DrawnInstrument instrument;
  const cv::Mat image = test::draw_pair({}, instrument, 1).left, truth = test::drawn_mask(instrument);
  EXPECT_GT(overlap(SegmentationNetwork(file, {.instrument_class = 0}, image.size()).mask(image), ~truth), 0.93);
  EXPECT_EQ(cv::countNonZero(SegmentationNetwork(file, {.instrument_class = 2}, image.size()).mask(image)), 0);
}

TEST(SegmentationNetwork, ReplacesTheColours) {
  const TemporaryFolder folder;
  InstrumentOptions options;
  options.segmentation = make_network(folder, "--output logit");
  NEEDS_NETWORK(options.segmentation);
  test::DrawnInstrument instrument;
  InstrumentTracker tracker(options, test::drawn_rectification(), test::draw_pair({.instrument = false}, {}, 0), {});
  for (int frame = 1; frame < 4; ++frame) {
    instrument.tip_mm += Vec3(-1, 0.3, 0.4);
    const auto seen = tracker.update(test::draw_pair({}, instrument, frame));
    ASSERT_TRUE(seen.tips[0].visible) << "frame " << frame;
    EXPECT_LT((seen.tips[0].tip_mm - instrument.tip_mm).norm(), 1.2) << "frame " << frame;
  }
}

TEST(SegmentationNetwork, SaysWhatIsWrongWithIt) {
  const TemporaryFolder folder;
  const auto complaint = [&](const std::filesystem::path& file, int instrument_class = 1) {
    return sentence_of([&] { SegmentationNetwork(file, {.instrument_class = instrument_class}, {640, 360}); });
  };
  EXPECT_THAT(complaint(folder / "missing.onnx"), HasSubstr("missing.onnx: there is no such file"));
  EXPECT_THAT(complaint(folder.write("text.onnx", "no network at all")), HasSubstr("cannot be read"));
  const std::filesystem::path classes = make_network(folder, "--output classes");
  NEEDS_NETWORK(classes);
  EXPECT_THAT(complaint(classes, 3), AllOf(HasSubstr("instrument.class is 3"), HasSubstr("0 to 2")));
  EXPECT_THAT(complaint(make_network(folder, "--flaw unknown-layer --output logit")), HasSubstr("Bernoulli"));
  EXPECT_THAT(complaint(make_network(folder, "--flaw two-outputs --output logit")), HasSubstr("2 outputs"));
  EXPECT_THAT(complaint(make_network(folder, "--flaw flat --output logit")), HasSubstr("the output is 1 x 245760"));
}

}  // namespace
}  // namespace palpate
