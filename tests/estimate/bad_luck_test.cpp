#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "palpate/palpate.h"
#include "tests/support/reference_data.h"

namespace palpate {
namespace {

/// The first pictures of a rendered sequence (contact from frame 15 on) with its map.
struct Sequence {
  static constexpr int kFrames = 36;
  Scene scene;
  Rectification rectification;
  std::vector<StereoFrame> frames;
  TissueMap map;

  Sequence() {
    const std::filesystem::path folder = test::reference_data() / "rendered_uterus";
    scene = read_scene(folder / "scene.yaml");
    Recording recording(scene.recording);
    rectification = make_rectification(read_rig(scene.recording.calibration), recording.size());
    while (static_cast<int>(frames.size()) < kFrames) frames.push_back(*recording.next());
    map = build_tissue_map(frames[0], rectification, scene.map, scene.tissue, scene.attachments);
  }
};

class BadLuck : public testing::Test {
 protected:
  void SetUp() override {
    PALPATE_NEEDS_REFERENCE("rendered_uterus");
    static const Sequence kSequence;
    sequence_ = &kSequence;
  }

  StereoFrame frame(int index) const {
    const StereoFrame& f = sequence_->frames[static_cast<size_t>(index)];
    return {f.index, f.time_s, f.left.clone(), f.right.clone()};
  }

  ForceEstimator estimator(int static_frame = 0) const {
    const Scene& scene = sequence_->scene;
    return ForceEstimator(sequence_->map, frame(static_frame), sequence_->rectification, scene.instrument,
                          scene.contact);
  }

  /// Answers to every frame after `spoil` did its work; a frame for which it says false is dropped.
  std::vector<ForceEstimate> run(const std::function<bool(StereoFrame&)>& spoil, int static_frame = 0) const {
    ForceEstimator estimating = estimator(static_frame);
    std::vector<ForceEstimate> answers;
    for (int i = 0; i < Sequence::kFrames; ++i) {
      StereoFrame spoilt = frame(i);
      if (spoil(spoilt)) answers.push_back(estimating.update(spoilt));
    }
    return answers;
  }

  /// What the same pictures give when nothing is wrong with them.
  const std::vector<ForceEstimate>& undisturbed() const {
    static const std::vector<ForceEstimate> kAnswers = run([](StereoFrame&) { return true; });
    return kAnswers;
  }

  /// No answer that claims to be right is wrong: `ok` and `no_contact` lie within a tenth of the peak of what the
  /// pictures give when nothing is wrong. `shown`: the frame that is really to be seen.
  void expect_no_wrong_force(
      const std::vector<ForceEstimate>& answers, const std::function<int(int)>& shown = [](int i) { return i; }) const {
    double peak_N = 0;
    for (const ForceEstimate& answer : undisturbed()) peak_N = std::max(peak_N, answer.force_N.norm());
    ASSERT_GT(peak_N, 5);
    for (const ForceEstimate& answer : answers) {
      EXPECT_TRUE(answer.force_N.allFinite()) << answer.frame;
      if (answer.status != FrameStatus::ok && answer.status != FrameStatus::no_contact) continue;
      const ForceEstimate& expected = undisturbed()[static_cast<size_t>(shown(answer.frame))];
      EXPECT_LT((answer.force_N - expected.force_N).norm(), 0.1 * peak_N) << answer.frame;
    }
  }

  const Sequence* sequence_ = nullptr;
};

cv::Mat shifted(const cv::Mat& image, double x, double y) {
  const cv::Matx23d by(1, 0, x, 0, 1, y);
  cv::Mat result;
  cv::warpAffine(image, result, by, image.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

TEST_F(BadLuck, ABumpedCameraIsAMotionOfTheSceneAndNoForce) {
  for (const int bump : {8, 26}) {
    const auto answers = run([bump](StereoFrame& f) {
      if (f.index >= bump) f.left = shifted(f.left, 9, 6), f.right = shifted(f.right, 9, 6);
      return true;
    });
    expect_no_wrong_force(answers);
    EXPECT_EQ(status_name(answers.back().status), "ok");
    EXPECT_GT(answers.back().scene_mm.norm(), 0.5);
  }
}

TEST_F(BadLuck, AnotherSceneMakesTheMapStale) {
  const auto answers = run([this](StereoFrame& f) {
    if (f.index < 26) return true;
    cv::flip(frame(0).left, f.left, -1);
    cv::flip(frame(0).right, f.right, -1);
    return true;
  });
  for (const ForceEstimate& answer : answers) {
    const bool admits = answer.status == FrameStatus::map_stale || answer.status == FrameStatus::tool_lost;
    EXPECT_EQ(admits, answer.frame >= 26) << answer.frame << ' ' << status_name(answer.status);
  }
}

TEST_F(BadLuck, EyesOffByOneFrameAreWarnedOf) {
  const auto answers = run([this](StereoFrame& f) {
    if (f.index > 0) f.right = frame(f.index - 1).right;
    return true;
  });
  int warned = 0;
  for (const ForceEstimate& answer : answers)
    warned += std::count(answer.warnings.begin(), answer.warnings.end(), "eyes_out_of_step");
  EXPECT_GT(warned, 0);
  for (const ForceEstimate& answer : undisturbed()) EXPECT_TRUE(answer.warnings.empty()) << answer.frame;
}

TEST_F(BadLuck, RepeatedFramesAreNoTipThatCameToRest) {
  const auto answers = run([this](StereoFrame& f) {
    if (f.index % 3 == 2) {
      const StereoFrame before = frame(f.index - 1);
      f.left = before.left;
      f.right = before.right;
    }
    return true;
  });
  expect_no_wrong_force(answers, [](int i) { return i % 3 == 2 ? i - 1 : i; });
  for (const ForceEstimate& answer : answers) EXPECT_FALSE(answer.in_contact && answer.frame < 14) << answer.frame;
  EXPECT_TRUE(answers.back().in_contact);
}

TEST_F(BadLuck, DroppedFramesLoseNoContact) {
  const auto answers =
      run([](StereoFrame& f) { return f.index < 9 || (f.index > 12 && f.index < 21) || f.index > 27; });
  expect_no_wrong_force(answers);
  EXPECT_EQ(status_name(answers.back().status), "ok");
}

TEST_F(BadLuck, SmokeIsNeverAForce) {
  const auto answers = run([](StereoFrame& f) {
    const double smoke = f.index > 22 && f.index < 29 ? 0.9 - 0.15 * std::abs(f.index - 26) : 0;
    for (cv::Mat* image : {&f.left, &f.right}) {
      cv::GaussianBlur(*image, *image, {}, 0.1 + 3 * smoke);
      *image = (1 - smoke) * *image + cv::Scalar::all(170 * smoke);
    }
    return true;
  });
  expect_no_wrong_force(answers);
  EXPECT_EQ(status_name(answers.back().status), "ok");
}

TEST_F(BadLuck, AnInstrumentInTheStaticFrameIsStillFollowed) {
  const auto answers = run([](StereoFrame&) { return true; }, 12);
  expect_no_wrong_force(answers);
  EXPECT_EQ(status_name(answers.back().status), "ok");
}

TEST_F(BadLuck, ABlackEyeIsAToolLost) {
  const auto answers = run([](StereoFrame& f) {
    if (f.index == 10 || f.index == 25) f.right.setTo(0);
    return true;
  });
  expect_no_wrong_force(answers);
  for (const int index : {10, 25})
    EXPECT_EQ(status_name(answers[static_cast<size_t>(index)].status), "tool_lost") << index;
  EXPECT_EQ(status_name(answers.back().status), "ok");
}

TEST_F(BadLuck, AHoldLostForTenFramesIsFoundAgainWithItsForce) {
  const auto answers = run([](StereoFrame& f) {
    if (f.index >= 22 && f.index < 32) f.left.setTo(0), f.right.setTo(0);
    return true;
  });
  expect_no_wrong_force(answers);
  for (int i = 22; i < 32; ++i) EXPECT_EQ(status_name(answers[static_cast<size_t>(i)].status), "tool_lost") << i;
  for (int i = 34; i < 36; ++i) EXPECT_EQ(status_name(answers[static_cast<size_t>(i)].status), "ok") << i;
}

TEST_F(BadLuck, AnInstrumentThatComesBackElsewhereHoldsNothing) {
  const auto answers = run([this](StereoFrame& f) {
    if (f.index >= 22 && f.index < 28) f.left.setTo(0), f.right.setTo(0);
    if (f.index < 28) return true;
    const StereoFrame away = frame(f.index - 22);
    f.left = away.left;
    f.right = away.right;
    return true;
  });
  expect_no_wrong_force(answers, [](int i) { return i < 28 ? i : i - 22; });
  for (const ForceEstimate& answer : answers) EXPECT_FALSE(answer.in_contact && answer.frame >= 28) << answer.frame;
}

}  // namespace
}  // namespace palpate
