#include "palpate/simulate/gesture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

enum class Action { approach, grasp, push, move, hold, release };

const double kJaws_s = 0.16;        // time in which the jaws open or close
const double kStillClosed = 0.02;   // opening up to which the jaws hold: less than a tenth of a pixel shows
const double kSameMoment_s = 1e-9;  // times of frames and rows agree up to rounding

std::vector<Action> actions_of(const GestureRow& row) {
  std::vector<Action> actions;
  if (row.approach_s > 0) actions.push_back(Action::approach);
  if (row.grasp) actions.push_back(Action::grasp);
  if (row.push) actions.push_back(Action::push);
  if (row.during_s > 0) actions.push_back(Action::move);
  if (row.hold_s > 0) actions.push_back(Action::hold);
  if (row.release) actions.push_back(Action::release);
  return actions;
}

Action action_of(const GestureRow& row) {
  return actions_of(row).at(0);
}

double duration_s(const GestureRow& row) {
  switch (action_of(row)) {
    case Action::approach:
      return row.approach_s;
    case Action::move:
      return row.during_s;
    case Action::hold:
      return row.hold_s;
    case Action::release:
      return row.leave_s;
    case Action::grasp:
    case Action::push:
      return 0;
  }
  return 0;
}

// Start of the first row with this action.
double start_of(const std::vector<GestureRow>& rows, Action action) {
  double start_s = 0;
  for (const GestureRow& row : rows) {
    if (action_of(row) == action) return start_s;
    start_s += duration_s(row);
  }
  return start_s;
}

}  // namespace

double minimum_jerk(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 - 15 * t + 6 * t * t);
}

void check_gesture(const std::vector<GestureRow>& rows) {
  const auto fail = [](size_t i, const std::string& what) {
    throw BadInput(fmt::format("simulate.gesture row {}: {}", i + 1, what));
  };
  if (rows.empty()) throw BadInput("simulate.gesture: no rows; expected approach_s, grasp or push, moves, release");
  bool approached = false, held = false, released = false;
  for (size_t i = 0; i < rows.size(); ++i) {
    const GestureRow& row = rows[i];
    const auto actions = actions_of(row);
    if (actions.size() != 1)
      fail(i, fmt::format("{} of approach_s, grasp, push, during_s, hold_s, release are given; expected exactly one",
                          actions.size()));
    if (row.move_mm != Vec3::Zero() && actions[0] != Action::move) fail(i, "move_mm needs during_s");
    if (row.leave_s > 0 && !row.release) fail(i, "leave_s needs release: true");
    switch (actions[0]) {
      case Action::approach:
        if (approached) fail(i, "a second approach_s; one contact per gesture");
        approached = true;
        break;
      case Action::grasp:
      case Action::push:
        if (!approached || held || released)
          fail(i, fmt::format("{} has to follow approach_s, once", row.push ? "push" : "grasp"));
        held = true;
        break;
      case Action::move:
        if (!held) fail(i, "during_s moves the tissue, so it has to stand between grasp or push and release");
        break;
      case Action::release:
        if (!held) fail(i, "release without a grasp or push before it");
        held = false;
        released = true;
        break;
      case Action::hold:
        break;
    }
  }
  if (!approached) throw BadInput("simulate.gesture: no row with approach_s and at_px");
}

bool is_push(const std::vector<GestureRow>& rows) {
  return std::any_of(rows.begin(), rows.end(), [](const GestureRow& row) { return row.push; });
}

double gesture_duration_s(const std::vector<GestureRow>& rows) {
  double total = 0;
  for (const GestureRow& row : rows) total += duration_s(row);
  return total;
}

double touch_time_s(const std::vector<GestureRow>& rows) {
  return start_of(rows, is_push(rows) ? Action::push : Action::grasp);
}

const GestureRow& approach_row(const std::vector<GestureRow>& rows) {
  for (const GestureRow& row : rows)
    if (row.approach_s > 0) return row;
  throw std::invalid_argument("approach_row: the gesture has none");
}

double longest_drag_mm(const std::vector<GestureRow>& rows) {
  double longest = 0;
  for (const GestureRow& row : rows) longest = std::max(longest, row.move_mm.tail<2>().norm());
  return longest;
}

GesturePose gesture_at(const std::vector<GestureRow>& rows, double time_s) {
  GesturePose pose;
  pose.away = 1;
  double start_s = 0;
  for (const GestureRow& row : rows) {
    if (time_s < start_s - kSameMoment_s) break;
    const double length_s = duration_s(row);
    const double progress = length_s > 0 ? minimum_jerk((time_s + kSameMoment_s - start_s) / length_s) : 1;
    switch (action_of(row)) {
      case Action::approach:
        pose.away = 1 - progress;
        break;
      case Action::grasp:
      case Action::push:
        pose.in_contact = true;
        break;
      case Action::move:
        pose.move_mm = pose.move_mm + progress * (row.move_mm - pose.move_mm);
        break;
      case Action::hold:
        break;
      case Action::release:
        pose.in_contact &= length_s > 0 && minimum_jerk((time_s - start_s) / kJaws_s) < kStillClosed;
        pose.away = progress;
        break;
    }
    start_s += length_s;
  }
  if (is_push(rows)) return pose;
  const double closed_s = start_of(rows, Action::grasp);
  const double opened_s = start_of(rows, Action::release);
  pose.opening =
      1 - minimum_jerk((time_s - closed_s + kJaws_s) / kJaws_s) + minimum_jerk((time_s - opened_s) / kJaws_s);
  return pose;
}

}  // namespace palpate
