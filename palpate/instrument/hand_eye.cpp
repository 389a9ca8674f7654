#include "palpate/instrument/hand_eye.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "palpate/core/errors.h"
#include "palpate/core/kabsch.h"
#include "palpate/core/quantile.h"

namespace palpate {

namespace {

constexpr double kLongestGap_s = 0.1, kSameTime_s = 1e-3;
constexpr double kNotARotation = 1e-3;
constexpr size_t kMinFrames = 20;
/// Of the frames in which a tip was seen, as many have to lie within the track's time.
constexpr double kMinOverlap = 0.5;
/// The delay is searched in steps of the first, then around the best in steps of the second.
constexpr double kCoarseStep_s = 0.02, kFineStep_s = 0.001;
/// Frames farther off than this many times the median, and than a good measurement, do not fit.
constexpr double kMaxMedians = 3, kGood_mm = 0.5;
constexpr int kFits = 4;
/// Errors of a tip that is followed stay for about so many frames.
constexpr double kAlikeFrames = 10;
/// How far the tip has to move, RMS: at all, and across the line that it follows most.
constexpr double kMinMotion_mm = 3, kMinSpread_mm = 0.7;

struct Pair {
  Vec3 seen_mm, track_mm;
};

std::vector<Pair> pairs_at(const std::vector<SeenTip>& seen, const TipTrack& track, double offset_s) {
  std::vector<Pair> pairs;
  for (const SeenTip& tip : seen)
    if (const auto row = row_at(track, tip.time_s + offset_s)) pairs.push_back({tip.tip_mm, row->tip_mm});
  return pairs;
}

CameraFromRobot fit(const std::vector<Pair>& pairs) {
  Vec3 seen = Vec3::Zero(), track = Vec3::Zero();
  for (const Pair& pair : pairs) {
    seen += pair.seen_mm / static_cast<double>(pairs.size());
    track += pair.track_mm / static_cast<double>(pairs.size());
  }
  std::vector<Vec3> from, to;
  for (const Pair& pair : pairs) {
    from.push_back(pair.track_mm - track);
    to.push_back(pair.seen_mm - seen);
  }
  CameraFromRobot result;
  result.rotation = rotation_onto(from, to);
  result.translation_mm = seen - result.rotation * track;
  return result;
}

double median_distance_mm(const std::vector<Pair>& pairs, const CameraFromRobot& camera_from_robot) {
  std::vector<double> distances;
  for (const Pair& pair : pairs) distances.push_back((pair.seen_mm - camera_from_robot(pair.track_mm)).norm());
  return median_of(distances);
}

/// The pairs that fit, and the motion that they agree on.
struct Agreement {
  std::vector<Pair> pairs;
  CameraFromRobot camera_from_robot;
  double rms_mm = 0;
};

Agreement agree(const std::vector<Pair>& all) {
  Agreement agreement{all, fit(all)};
  for (int i = 1; i < kFits; ++i) {
    const double max_mm = std::max(kGood_mm, kMaxMedians * median_distance_mm(all, agreement.camera_from_robot));
    agreement.pairs.clear();
    for (const Pair& pair : all)
      if ((pair.seen_mm - agreement.camera_from_robot(pair.track_mm)).norm() <= max_mm) agreement.pairs.push_back(pair);
    agreement.camera_from_robot = fit(agreement.pairs);
  }
  double squared = 0;
  for (const Pair& pair : agreement.pairs)
    squared += (pair.seen_mm - agreement.camera_from_robot(pair.track_mm)).squaredNorm();
  agreement.rms_mm = std::sqrt(squared / static_cast<double>(agreement.pairs.size()));
  return agreement;
}

struct Delay {
  double offset_s = 0;
  double median_mm = std::numeric_limits<double>::infinity();
};

Delay best_delay(const std::vector<SeenTip>& seen, const TipTrack& track, double first_s, double last_s,
                 double step_s) {
  Delay best;
  for (double offset_s = first_s; offset_s <= last_s + 1e-9; offset_s += step_s) {
    const std::vector<Pair> pairs = pairs_at(seen, track, offset_s);
    if (static_cast<double>(pairs.size()) < kMinOverlap * static_cast<double>(seen.size())) continue;
    const double median_mm = median_distance_mm(pairs, agree(pairs).camera_from_robot);
    if (median_mm < best.median_mm) best = {offset_s, median_mm};
  }
  return best;
}

/// RMS of the motion along the three axes that it follows least, more and most.
Vec3 spreads_mm(const std::vector<Pair>& pairs) {
  Vec3 mean = Vec3::Zero();
  for (const Pair& pair : pairs) mean += pair.track_mm / static_cast<double>(pairs.size());
  Mat3 scatter = Mat3::Zero();
  for (const Pair& pair : pairs) scatter += (pair.track_mm - mean) * (pair.track_mm - mean).transpose();
  const Vec3 variances = Eigen::SelfAdjointEigenSolver<Mat3>(scatter / static_cast<double>(pairs.size())).eigenvalues();
  return variances.cwiseMax(0).cwiseSqrt();
}

}  // namespace

void describe(Settings& settings, CameraFromRobot& options) {
  settings.matrix3("rotation", options.rotation, "rows of the rotation from the track's axes to the left camera's");
  settings.vector3("translation_mm", options.translation_mm, {}, "the track's origin in the left camera frame");
  settings.after_reading([&options] {
    const Mat3& R = options.rotation;
    if ((R * R.transpose() - Mat3::Identity()).norm() > kNotARotation || R.determinant() < 0)
      throw BadInput("instrument.camera_from_robot.rotation is no rotation, expected orthonormal rows, right-handed");
  });
}

TipTrack in_camera(TipTrack track, const CameraFromRobot& camera_from_robot) {
  for (auto& [frame, row] : track.rows) row.tip_mm = camera_from_robot(row.tip_mm);
  return track;
}

std::optional<TipTrack::Row> row_at(const TipTrack& track, double track_time_s) {
  const auto later = [](double time_s, const auto& numbered) { return time_s < numbered.second.time_s; };
  auto after = std::upper_bound(track.rows.begin(), track.rows.end(), track_time_s, later);
  if (after == track.rows.begin()) {
    const bool is_first = after != track.rows.end() && after->second.time_s - track_time_s <= kSameTime_s;
    return is_first ? std::optional(after->second) : std::nullopt;
  }
  const TipTrack::Row& a = std::prev(after)->second;
  if (a.time_s == track_time_s) return a;
  if (after == track.rows.end() && track_time_s - a.time_s <= kSameTime_s) return a;
  if (after == track.rows.end() || after->second.time_s - a.time_s > kLongestGap_s) return {};
  const TipTrack::Row& b = after->second;
  const double t = (track_time_s - a.time_s) / (b.time_s - a.time_s);
  return TipTrack::Row{track_time_s, (1 - t) * a.tip_mm + t * b.tip_mm, t < 0.5 ? a.closed : b.closed};
}

std::optional<TipTrack::Row> row_of_frame(const TipTrack& track, int frame, double video_time_s, double time_offset_s) {
  if (!track.has_frames || time_offset_s != 0) return row_at(track, video_time_s + time_offset_s);
  const auto row = track.rows.find(frame);
  return row == track.rows.end() ? std::nullopt : std::optional(row->second);
}

HandEye estimate_hand_eye(const std::vector<SeenTip>& seen, const TipTrack& track) {
  if (seen.size() < kMinFrames)
    throw BadInput(fmt::format("the video shows the tip in {} frames, expected at least {} to place a track by",
                               seen.size(), kMinFrames));
  const double track_begins_s = track.rows.begin()->second.time_s, track_ends_s = track.rows.rbegin()->second.time_s;
  const Delay coarse =
      best_delay(seen, track, track_begins_s - seen.back().time_s, track_ends_s - seen.front().time_s, kCoarseStep_s);
  if (!std::isfinite(coarse.median_mm))
    throw BadInput("the track and the frames in which the tip is seen overlap by less than half at any time offset");
  const Delay fine =
      best_delay(seen, track, coarse.offset_s - kCoarseStep_s, coarse.offset_s + kCoarseStep_s, kFineStep_s);
  const Agreement agreement = agree(pairs_at(seen, track, fine.offset_s));
  const Vec3 spread = spreads_mm(agreement.pairs);
  if (spread[2] < kMinMotion_mm)
    throw BadInput(fmt::format("the tip moves by {:.1f} mm RMS, expected at least {:g} mm to place a track by",
                               spread[2], kMinMotion_mm));
  if (spread[1] < kMinSpread_mm)
    throw BadInput(
        fmt::format("the tip moves along a line ({:.1f} mm RMS beside it, expected at least {:g} mm): the "
                    "rotation about it cannot be told",
                    spread[1], kMinSpread_mm));
  HandEye result;
  result.camera_from_robot = agreement.camera_from_robot;
  result.time_offset_s = fine.offset_s;
  result.frames = static_cast<int>(agreement.pairs.size());
  result.rms_mm = agreement.rms_mm;
  // About the line of most motion only the spread across it holds the rotation.
  const double across_mm = std::hypot(spread[0], spread[1]);
  result.deviation_deg =
      180 / std::numbers::pi * agreement.rms_mm / std::sqrt(3 * result.frames / kAlikeFrames) / across_mm;
  return result;
}

}  // namespace palpate
