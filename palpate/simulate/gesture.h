#pragma once

#include <vector>

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// What the instrument does at one moment.
struct GesturePose {
  bool in_contact = false;
  Vec3 move_mm = Vec3::Zero();  ///< from the contact point at rest: outward normal, tangents a and b
  double away = 0;              ///< distance back along the shaft, 0 = at the contact, 1 = where it begins and ends
  double opening = 0;           ///< of the jaws, 0 closed .. 1 open; a push keeps them closed
};

/// Throws BadInput, naming the row (counted from 1), unless the rows are: approach, grasp or push, moves, release, with
/// holds in between, and each row is one action.
void check_gesture(const std::vector<GestureRow>& rows);

/// Length of the whole gesture, s.
double gesture_duration_s(const std::vector<GestureRow>& rows);

/// Pose at a time from the start. Minimum jerk within each row (rest to rest), so that positions, velocities and
/// accelerations are continuous over row ends. The contact begins at its moment and lasts until the release shows:
/// through the first moments of it, in which neither jaws nor tip have moved visibly.
GesturePose gesture_at(const std::vector<GestureRow>& rows, double time_s);

/// The tip is not tied to the tissue.
bool is_push(const std::vector<GestureRow>& rows);

/// How far along the tangents the moves go, at most.
double longest_drag_mm(const std::vector<GestureRow>& rows);

/// When the contact begins, s; the end of the gesture where there is none.
double touch_time_s(const std::vector<GestureRow>& rows);

/// The row in which the tissue is approached.
const GestureRow& approach_row(const std::vector<GestureRow>& rows);

/// 10 t^3 - 15 t^4 + 6 t^5 (Flash and Hogan 1985), 0 before t = 0 and 1 after t = 1.
double minimum_jerk(double t);

}  // namespace palpate
