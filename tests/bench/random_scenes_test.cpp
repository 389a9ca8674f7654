#include "bench/accuracy/random_scenes.h"

#include <gtest/gtest.h>

#include <set>

#include "bench/accuracy/sequences.h"
#include "palpate/simulate/gesture.h"

namespace palpate {
namespace {

TEST(RandomScenes, AreTheSameForTheSameNumberAndOthersForOthers) {
  std::set<std::string> texts;
  for (int number = 1; number <= 40; ++number) {
    const std::string text = scene_text(dejavu_text(random_scene(number)));
    EXPECT_EQ(text, scene_text(dejavu_text(random_scene(number))));
    texts.insert(text);
  }
  EXPECT_EQ(texts.size(), 40u);
  EXPECT_NE(scene_text(dejavu_text(random_scene(7, 1))), scene_text(dejavu_text(random_scene(7, 0))));
}

TEST(RandomScenes, MoveInHalfOfThemAndHaveAnotherTruthInAThird) {
  int moving = 0, other_truth = 0, pushes = 0;
  std::set<std::string> shapes;
  for (int number = 1; number <= 40; ++number) {
    const SceneFile scene = random_scene(number);
    const SimulateOptions& simulate = scene.simulate;
    EXPECT_NO_THROW(check_gesture(simulate.gesture));
    const double frames = gesture_duration_s(simulate.gesture) * simulate.camera.fps;
    EXPECT_GE(frames, 65);
    EXPECT_LE(frames, 90);
    const double motion_mm = simulate.breathing.motion_mm.norm() + simulate.heart.motion_mm.norm();
    EXPECT_LE(motion_mm, 3);
    moving += motion_mm > 0;
    const bool is_disc = simulate.truth.patch == SimulatedTruth::Patch::disc;
    EXPECT_EQ(is_disc, number % 3 != 0);
    if (!is_disc) {
      EXPECT_FALSE(is_push(simulate.gesture));
      EXPECT_GE(simulate.body.elements, 16000);
    }
    other_truth += !is_disc;
    pushes += is_push(simulate.gesture);
    shapes.insert(simulate.body.shape.string());
  }
  EXPECT_GE(moving, 14);
  EXPECT_LE(moving, 26);
  EXPECT_EQ(other_truth, 13);
  EXPECT_GE(pushes, 8);
  EXPECT_EQ(shapes.size(), 3u);
}

}  // namespace
}  // namespace palpate
