#include "palpate/stereo/network.h"

#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/match.h"
#include "tests/stereo/files.h"
#include "tests/stereo/truth_cases.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

using test::sentence_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

// Empty where there is no Python.
std::filesystem::path make_network(const TemporaryFolder& folder, const std::string& arguments) {
  const std::filesystem::path script = std::filesystem::path(__FILE__).parent_path() / "make_network.py";
  const std::filesystem::path file = folder / "network.onnx";
  const std::string command = "python3 '" + script.string() + "' '" + file.string() + "' " + arguments;
  return std::system(command.c_str()) == 0 ? file : std::filesystem::path();
}

// Random texture; the right camera sees it `shift` px further left.
struct Pair {
  cv::Mat left = cv::Mat(96, 160, CV_8UC3), right;
  explicit Pair(int shift) {
    cv::RNG random(5);
    random.fill(left, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(left, left, {5, 5}, 1.2);
    cv::warpAffine(left, right, cv::Matx23d(1, 0, -shift, 0, 1, 0), left.size(), cv::INTER_NEAREST, cv::BORDER_REFLECT);
  }
};

#define NEEDS_NETWORK(file) \
  if (file.empty()) GTEST_SKIP() << "python3, which writes the network, is missing"

TEST(StereoNetwork, ATinyNetworkFindsTheDisparityAndNothingWhereTheOtherEyeSeesNothing) {
  const TemporaryFolder folder;
  const std::filesystem::path network = make_network(folder, "--most-disparity 24");
  NEEDS_NETWORK(network);
  const Pair pair(17);
  const cv::Mat disparity = disparity_by_network(pair.left, pair.right, network);
  ASSERT_EQ(disparity.size(), pair.left.size());
  int right = 0, wrong = 0, beyond = 0;
  for (int y = 5; y < 91; ++y)
    for (int x = 0; x < 155; ++x) {
      const float d = disparity.at<float>(y, x);
      if (x < 10) beyond += !std::isnan(d);
      if (x < 25 || std::isnan(d)) continue;
      (std::abs(d - 17) < 0.1 ? right : wrong) += 1;
    }
  EXPECT_GT(right, 86 * 130 * 97 / 100);
  EXPECT_LT(wrong, 86 * 130 / 100);
  EXPECT_EQ(beyond, 0);
}

TEST(StereoNetwork, CanBeNamedAsTheMatcher) {
  PALPATE_NEEDS_REFERENCE("rendered_uterus");
  const TemporaryFolder folder;
  test::TruthCase c = test::read_truth_case("rendered_uterus");
  c.options.matcher = Matcher::network;
  c.options.network = make_network(folder, "--most-disparity 48");
  NEEDS_NETWORK(c.options.network);
  const DisparityMap map =
      match(c.pair, c.rectification, cv::Mat(c.pair.left.size(), CV_8U, cv::Scalar(255)), c.options);
  const test::MatchScore got = score(map, c);
  EXPECT_LT(got.median_px, 0.35);
  EXPECT_GT(got.covered, 0.6);
  EXPECT_EQ(map.deviation_px.size(), map.disparity_px.size());
}

TEST(StereoNetwork, SaysWhatIsWrongWithTheNetwork) {
  const TemporaryFolder folder;
  const Pair pair(9);
  const auto complaint = [&](const std::filesystem::path& file) {
    return sentence_of([&] { disparity_by_network(pair.left, pair.right, file); });
  };
  EXPECT_THAT(complaint(folder / "missing.onnx"), HasSubstr("missing.onnx: there is no such file"));
  EXPECT_THAT(complaint(folder.write("text.onnx", "no network at all")), HasSubstr("cannot be read"));
  const std::pair<const char*, const char*> flaws[] = {
      {"one-input", "\"right\" not found"},
      {"three-inputs", "does not take"},
      {"two-outputs", "2 outputs (disparity, left_grey)"},
      {"half-size", "1 x 1 x 48 x 80 for images 96 high and 160 wide"}};
  for (const auto& [flaw, words] : flaws) {
    const std::filesystem::path file = make_network(folder, std::string("--most-disparity 8 --flaw ") + flaw);
    NEEDS_NETWORK(file);
    EXPECT_THAT(complaint(file), AllOf(HasSubstr(words), HasSubstr("two inputs named left and right"))) << flaw;
  }
}

}  // namespace
}  // namespace palpate
