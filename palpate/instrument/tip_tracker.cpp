#include "palpate/instrument/tip_tracker.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>

#include "palpate/core/errors.h"
#include "palpate/instrument/eye_lag.h"
#include "palpate/instrument/find_tip.h"
#include "palpate/instrument/rigid_motion.h"
#include "palpate/instrument/segment.h"
#include "palpate/instrument/tip_filter.h"

namespace palpate {

namespace {

constexpr double kTemplateWidths = 2.5;       // length of the followed part behind the tip, in shaft widths
constexpr double kGoodAgreement = 0.6;        // below, a keyframe has become too unlike what is seen
constexpr double kLeastAgreementAlone = 0.5;  // for a frame in which the mask gives no tip
constexpr double kKeyframeReach_px = 40;      // motion after which a fresh keyframe is better
constexpr int kMostFramesAlone = 5;           // without any tip from the masks
constexpr int kMostRejected = 3;              // detections outside the gate before the filter starts anew
constexpr double kThinnest_mm = 0.8;          // shaft of an instrument
constexpr double kThickest_mm = 25;
constexpr double kTipDeviation_px = 0.7;  // where the mask ends against where the jaws end
constexpr double kDisparityFloor_px = 0.05;
constexpr double kBias_mm = 0.25;  // what does not average out over frames: outline, one side of the jaws seen
constexpr double kMotionFloor_mm = 0.02;
constexpr double kMotionModelShare = 0.04;  // of a displacement: light that does not move along, depths of the template

/// One eye in one frame.
struct EyeView {
  cv::Mat mask;
  std::optional<ImageTip> tip;
  ImageLayers layers;
};

double followed_length_px(const ImageTip& tip) {
  return std::clamp(kTemplateWidths * tip.width_px, 60.0, 220.0);
}

cv::Rect region_around(const ImageTip& tip) {
  const double margin = 0.6 * tip.width_px + 36;
  const cv::Point2d back = tip.tip_px - followed_length_px(tip) * tip.axis;
  const double x0 = std::min(tip.tip_px.x, back.x) - margin, x1 = std::max(tip.tip_px.x, back.x) + margin;
  const double y0 = std::min(tip.tip_px.y, back.y) - margin, y1 = std::max(tip.tip_px.y, back.y) + margin;
  return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 - x0), static_cast<int>(y1 - y0)};
}

/// What a frame says about the tip without the frames before it; rectified frame.
struct Detection {
  InstrumentPlane plane;
  PatchTemplate left_template;
  Vec3 tip_mm = Vec3::Zero();
  Mat3 covariance_mm2 = Mat3::Identity();
};

Vec3 rectified_point(const Rectification& r, const cv::Point2d& left_px, double disparity) {
  const double z = r.depth_mm(disparity);
  return {(left_px.x - r.principal_x_px) * z / r.focal_px, (left_px.y - r.principal_y_px) * z / r.focal_px, z};
}

cv::Point2d left_pixel(const Rectification& r, const Vec3& p) {
  return {r.focal_px * p.x() / p.z() + r.principal_x_px, r.focal_px * p.y() / p.z() + r.principal_y_px};
}

std::optional<Detection> detect(const EyeView& left, const EyeView& right, const Rectification& r) {
  if (!left.tip || !right.tip) return {};
  const double guess = left.tip->tip_px.x - right.tip->tip_px.x;
  const double rows = std::abs(left.tip->tip_px.y - right.tip->tip_px.y);
  if (guess < 1 || rows > 4 + 0.15 * left.tip->width_px || left.tip->axis.dot(right.tip->axis) < 0.9) return {};
  Detection detection;
  detection.left_template = make_template(left.layers, left.mask, *left.tip, followed_length_px(*left.tip));
  const auto plane = match_instrument(detection.left_template, left.tip->tip_px, right.layers, guess, r.focal_px);
  if (!plane) return {};
  // Both masks end at the same tip: the match of the whole far part must not contradict them.
  if (std::abs(plane->disparity[0] - guess) > 4 + 0.1 * left.tip->width_px) return {};
  const double width_mm = left.tip->width_px * r.depth_mm(plane->disparity[0]) / r.focal_px;
  if (width_mm < kThinnest_mm || width_mm > kThickest_mm) return {};
  detection.plane = *plane;
  detection.tip_mm = rectified_point(r, left.tip->tip_px, plane->disparity[0]);
  const double z = detection.tip_mm.z();
  const double across = kTipDeviation_px * z / r.focal_px;
  const double along =
      z * z / (r.focal_px * r.baseline_mm) * std::max(plane->disparity_deviation_px, kDisparityFloor_px);
  const Vec3 ray = detection.tip_mm / z;  // an error of depth moves the point along its viewing ray
  detection.covariance_mm2 = across * across * Mat3::Identity() + along * along * ray * ray.transpose();
  return detection;
}

InstrumentKeyframe make_keyframe(Detection detection, const EyeView& right) {
  InstrumentKeyframe keyframe;
  ImageTip right_tip = *right.tip;
  right_tip.tip_px = detection.plane.origin_px - cv::Point2d(detection.plane.disparity[0], 0);
  keyframe.right = make_template(right.layers, right.mask, right_tip, followed_length_px(right_tip));
  keyframe.left = std::move(detection.left_template);
  keyframe.plane = detection.plane;
  keyframe.tip_mm = detection.tip_mm;
  return keyframe;
}

}  // namespace

struct TipTracker::State {
  Rectification rectification;
  std::optional<TipTrack> track;
  std::array<SegmentationModel, 2> models;

  TipFilter filter;
  EyeLag eye_lag;
  bool eyes_out_of_step = false;                          ///< as last found; it stays so while nothing moves
  std::optional<ImageTip> last_left_tip, last_right_tip;  ///< where to look when a mask shows none
  std::optional<InstrumentKeyframe> keyframe;
  std::optional<InstrumentKeyframe> fresh_keyframe;  ///< of the last frame, should it be marked
  RigidMotion motion;                                ///< since the keyframe, as last measured
  std::optional<double> last_time_s;
  int frames_alone = 0;
  int rejected = 0;
  bool visible = false;

  bool marked = false;
  std::optional<RigidMotion> motion_at_mark;  ///< since the keyframe; none when the mark came without a keyframe
  Vec3 tip_at_mark_mm = Vec3::Zero();         ///< rectified frame, or left camera frame with a track
  Mat3 covariance_at_mark_mm2 = Mat3::Zero();

  EyeView view(const cv::Mat& bgr, const SegmentationModel& model, const std::optional<ImageTip>& expected) const;
  std::optional<RigidMotion> motion_since_keyframe(const EyeView& left, const EyeView& right,
                                                   const std::optional<Detection>& detection, double seconds) const;
  void use_fresh_keyframe();
  void advance(const std::optional<RigidMotion>& measured, bool followed, const std::optional<Detection>& detection,
               double seconds);
  void lose();
  TipObservation from_track(const RectifiedPair& pair);
  void report_since_mark(TipObservation& observation) const;
};

EyeView TipTracker::State::view(const cv::Mat& bgr, const SegmentationModel& model,
                                const std::optional<ImageTip>& expected) const {
  EyeView eye;
  eye.mask = segment_instrument(bgr, model);
  eye.tip = find_tip(eye.mask, model.picture_area);
  const std::optional<ImageTip>& look_at = eye.tip ? eye.tip : expected;
  if (look_at) eye.layers = make_layers(bgr, region_around(*look_at), model);
  return eye;
}

std::optional<RigidMotion> TipTracker::State::motion_since_keyframe(const EyeView& left, const EyeView& right,
                                                                    const std::optional<Detection>& detection,
                                                                    double seconds) const {
  if (!keyframe) return {};
  RigidMotion guess = motion;
  if (filter.started()) guess.translation_mm += seconds * filter.velocity_mm_per_s();
  const Light light = marked ? Light::gain_and_ramp : Light::offset;
  auto best = measure_motion(*keyframe, left.layers, right.layers, rectification, guess, light);
  if (best && best->agreement > kGoodAgreement) return best;
  if (detection) {
    guess.translation_mm = detection->tip_mm - keyframe->tip_mm;
    const auto other = measure_motion(*keyframe, left.layers, right.layers, rectification, guess, light);
    if (other && (!best || other->agreement > best->agreement)) best = other;
  }
  return best;
}

void TipTracker::State::use_fresh_keyframe() {
  keyframe = std::move(fresh_keyframe);
  fresh_keyframe.reset();
  motion = RigidMotion();
  motion.agreement = 1;
}

void TipTracker::State::advance(const std::optional<RigidMotion>& measured, bool followed,
                                const std::optional<Detection>& detection, double seconds) {
  const TipFilter before = filter;
  std::optional<RigidMotion> taken = measured;
  const auto corrected = [&] { return filter.correct(detection->tip_mm, detection->covariance_mm2); };
  if (followed) {
    const Mat3 floor = kMotionFloor_mm * kMotionFloor_mm * Mat3::Identity();
    filter.move(measured->translation_mm - motion.translation_mm, measured->covariance_mm2 + floor, seconds);
  } else if (filter.started()) {
    filter.predict(seconds);
  }
  if (detection && (!filter.started() || rejected >= kMostRejected)) {
    filter.start(detection->tip_mm, detection->covariance_mm2);
    rejected = 0;
  } else if (detection && corrected()) {
    rejected = 0;
  } else if (detection) {
    // Motion and detection contradict each other: the one that continues the path so far is right, or comes nearer to
    // it; a marked template, which the contact hangs on, has proved itself.
    const TipFilter as_followed = filter;
    filter = before;
    filter.predict(seconds);
    const Vec3 predicted_mm = filter.position_mm();
    const bool is_nearer =
        (detection->tip_mm - predicted_mm).norm() < (as_followed.position_mm() - predicted_mm).norm();
    const bool continues = corrected();
    if (followed && !marked && (continues || is_nearer)) {
      if (!continues) filter.start(detection->tip_mm, detection->covariance_mm2);
      taken.reset();
      rejected = 0;
    } else {
      filter = as_followed;
      ++rejected;
    }
  }
  if (taken)
    motion = *taken;
  else
    motion.agreement = 0;
}

void TipTracker::State::lose() {
  visible = false;
  filter.stop();
  if (!marked) keyframe.reset();
  fresh_keyframe.reset();
  frames_alone = rejected = 0;
}

TipObservation TipTracker::State::from_track(const RectifiedPair& pair) {
  TipObservation observation;
  if (!pair.left.empty()) observation.left_mask = segment_instrument(pair.left, models[0]);
  if (!pair.right.empty()) observation.right_mask = segment_instrument(pair.right, models[1]);
  const auto row = track->rows.find(pair.index);
  visible = row != track->rows.end();
  if (!visible) return observation;
  observation.visible = true;
  observation.tip_mm = row->second.tip_mm;
  observation.closed = row->second.closed;
  observation.covariance_mm2 = kBias_mm * kBias_mm * Mat3::Identity();
  if (row != track->rows.begin()) {
    const TipTrack::Row& before = std::prev(row)->second;
    const double seconds = row->second.time_s - before.time_s;
    if (seconds > 0) observation.velocity_mm_per_s = (row->second.tip_mm - before.tip_mm) / seconds;
  }
  filter.start(observation.tip_mm, observation.covariance_mm2);
  if (marked) {
    observation.since_mark_mm = observation.tip_mm - tip_at_mark_mm;
    observation.since_mark_covariance_mm2 = kMotionFloor_mm * kMotionFloor_mm * Mat3::Identity();
  }
  return observation;
}

void TipTracker::State::report_since_mark(TipObservation& observation) const {
  if (!marked) return;
  const Mat3 left_from_rectified = rectification.rectified_from_left.transpose();
  Vec3 since = filter.position_mm() - tip_at_mark_mm;
  Mat3 covariance = filter.position_covariance_mm2() + covariance_at_mark_mm2;
  if (motion_at_mark && motion.agreement > 0) {
    since = motion.translation_mm - motion_at_mark->translation_mm;
    const double model = kMotionModelShare * since.norm();
    covariance = motion.covariance_mm2 + motion_at_mark->covariance_mm2 +
                 (kMotionFloor_mm * kMotionFloor_mm + model * model) * Mat3::Identity();
  }
  observation.since_mark_mm = left_from_rectified * since;
  observation.since_mark_covariance_mm2 = left_from_rectified * covariance * left_from_rectified.transpose();
}

void describe(Settings& settings, InstrumentOptions& options) {
  settings.text("segmentation", options.segmentation, "how the instrument is found in the images: colour");
  settings.path("track", options.track, "tip.csv (frame,time_s,x_mm,y_mm,z_mm[,closed]) instead of the images");
  settings.after_reading([&options] {
    if (options.segmentation == "colour") return;
    if (options.segmentation.ends_with(".onnx"))
      throw BadInput(fmt::format("instrument.segmentation is '{}': networks are not there yet, expected colour",
                                 options.segmentation));
    throw BadInput(fmt::format("instrument.segmentation is '{}', expected colour", options.segmentation));
  });
}

TipTracker::TipTracker(const InstrumentOptions& options, const Rectification& rectification,
                       const RectifiedPair& static_frame, const cv::Mat& organ_mask)
    : state_(std::make_unique<State>()) {
  state_->rectification = rectification;
  if (!options.track.empty()) state_->track = read_tip_track(options.track);
  tbb::parallel_invoke([&] { state_->models[0] = learn_segmentation(static_frame.left, organ_mask); },
                       [&] { state_->models[1] = learn_segmentation(static_frame.right, organ_mask); });
}

TipTracker::~TipTracker() = default;
TipTracker::TipTracker(TipTracker&&) noexcept = default;

TipObservation TipTracker::update(const RectifiedPair& pair) {
  State& s = *state_;
  if (s.track) return s.from_track(pair);

  EyeView left, right;
  tbb::parallel_invoke([&] { left = s.view(pair.left, s.models[0], s.last_left_tip); },
                       [&] { right = s.view(pair.right, s.models[1], s.last_right_tip); });
  TipObservation observation;
  observation.left_mask = left.mask;
  observation.right_mask = right.mask;
  const double seconds = s.last_time_s ? std::max(pair.time_s - *s.last_time_s, 1e-3) : 0.04;
  s.last_time_s = pair.time_s;

  std::optional<Detection> detection = detect(left, right, s.rectification);
  const auto measured = s.motion_since_keyframe(left, right, detection, seconds);
  s.frames_alone = detection ? 0 : s.frames_alone + 1;
  const bool followed = measured && s.filter.started() && s.frames_alone <= kMostFramesAlone &&
                        (detection || measured->agreement > kLeastAgreementAlone);
  if (!detection && !followed) {
    s.lose();
    return observation;
  }

  s.advance(measured, followed, detection, seconds);
  s.visible = true;

  if (detection) {
    s.eye_lag.add(pair.index, left.tip->tip_px.y, right.tip->tip_px.y);
    s.eyes_out_of_step = s.eye_lag.frames().value_or(s.eyes_out_of_step ? 1 : 0) != 0;
  }
  observation.eyes_out_of_step = s.eyes_out_of_step;
  if (left.tip) s.last_left_tip = left.tip;
  if (right.tip) s.last_right_tip = right.tip;
  s.report_since_mark(observation);

  const double travelled_px = s.keyframe
                                  ? cv::norm(left_pixel(s.rectification, s.keyframe->tip_mm) -
                                             left_pixel(s.rectification, s.keyframe->tip_mm + s.motion.translation_mm))
                                  : 0;
  const bool stale = !s.keyframe || s.motion.agreement < kGoodAgreement || travelled_px > kKeyframeReach_px;
  if (detection && s.rejected == 0) {
    s.fresh_keyframe = make_keyframe(std::move(*detection), right);
    if (stale && !s.marked) s.use_fresh_keyframe();
  } else {
    s.fresh_keyframe.reset();
  }

  const Mat3 left_from_rectified = s.rectification.rectified_from_left.transpose();
  observation.visible = true;
  observation.tip_mm = left_from_rectified * s.filter.position_mm();
  observation.velocity_mm_per_s = left_from_rectified * s.filter.velocity_mm_per_s();
  observation.covariance_mm2 =
      left_from_rectified * s.filter.position_covariance_mm2() * left_from_rectified.transpose() +
      kBias_mm * kBias_mm * Mat3::Identity();
  return observation;
}

void TipTracker::mark() {
  State& s = *state_;
  s.marked = s.visible;
  s.motion_at_mark.reset();
  if (!s.visible) return;
  s.tip_at_mark_mm = s.filter.position_mm();
  s.covariance_at_mark_mm2 = s.filter.position_covariance_mm2();
  if (s.track) return;
  if (s.fresh_keyframe) s.use_fresh_keyframe();
  if (s.keyframe) s.motion_at_mark = s.motion;
}

void TipTracker::unmark() {
  state_->marked = false;
  state_->motion_at_mark.reset();
}

}  // namespace palpate
