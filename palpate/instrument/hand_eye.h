#pragma once

#include <optional>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"
#include "palpate/instrument/tip_track.h"

namespace palpate {

/// `instrument.camera_from_robot`: a rigid motion.
struct CameraFromRobot {
  Mat3 rotation = Mat3::Identity();
  Vec3 translation_mm = Vec3::Zero();

  Vec3 operator()(const Vec3& in_robot_mm) const { return rotation * in_robot_mm + translation_mm; }
};

/// Throws BadInput when the rotation is none.
void describe(Settings& settings, CameraFromRobot& options);

/// The track in the left camera frame.
TipTrack in_camera(TipTrack track, const CameraFromRobot& camera_from_robot);

/// What the track says at a moment of its own clock, between its rows; nothing outside of them (a ms is granted), and
/// where they lie further apart than a tenth of a second.
std::optional<TipTrack::Row> row_at(const TipTrack& track, double track_time_s);

/// The row of a frame of the video: by its number, or by time where the track has no numbers or `time_offset_s` (track
/// time minus video time) is not 0.
std::optional<TipTrack::Row> row_of_frame(const TipTrack& track, int frame, double video_time_s, double time_offset_s);

/// A tip that was seen in the video, left camera frame.
struct SeenTip {
  double time_s = 0;
  Vec3 tip_mm = Vec3::Zero();
};

/// How the axes and the clock of a track lie to those of the video.
struct HandEye {
  CameraFromRobot camera_from_robot;
  double time_offset_s = 0;  ///< track time minus video time
  int frames = 0;            ///< that agree
  double rms_mm = 0;         ///< of these, what is left between track and video
  double deviation_deg = 0;  ///< one standard deviation of the rotation about the axis that is known worst
};

/// The rigid motion (Kabsch 1976) and the delay by which the track agrees best with the tips that the video shows;
/// frames that do not fit, where something else was taken for the tip, are left out. Throws BadInput when both overlap
/// too little, when nothing moves, or when the tip moves along a line only: the rotation about it cannot be told.
HandEye estimate_hand_eye(const std::vector<SeenTip>& seen, const TipTrack& track);

}  // namespace palpate
