#pragma once

#include "palpate/session/scene_file.h"

namespace palpate {

/// A scene that DejaVu can make, drawn from its number alone, the same on every machine: organ, law and stiffness,
/// radius, gesture (grasp and pull, push or drag; press; slide), looks, and in half of the scenes breathing and
/// heartbeat of 0 to 3 mm beneath a hand that stands. In every third scene the instrument grasps and the truth is not
/// the estimator's model: an ellipse, a soft rim or two jaws, on four times as many elements. 70 to 90 frames.
/// `attempt`: a scene may miss its organ or have no equilibrium; the next attempt draws other numbers.
SceneFile random_scene(int number, int attempt = 0);

/// "pear, neo-hookean, 21 kPa, 3.4 mm, slide, moves 2.1 mm, two_jaws".
std::string describe_random_scene(const SceneFile& scene);

}  // namespace palpate
