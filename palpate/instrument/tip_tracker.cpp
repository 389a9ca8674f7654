#include "palpate/instrument/tip_tracker.h"

#include <algorithm>

namespace palpate {

namespace {

constexpr double kTemplateWidths = 2.5;     // length of the followed part behind the tip, in shaft widths
constexpr double kGoodAgreement = 0.6;      // below, a keyframe has become too unlike what is seen
constexpr double kMinAgreementAlone = 0.5;  // for a frame in which the mask gives no tip
constexpr double kKeyframeReach_px = 40;    // motion after which a fresh keyframe is better
constexpr int kMaxFramesAlone = 5;          // without any tip from the masks
constexpr int kMaxFramesTrusted = 100;      // the same where the texture has to be trusted for longer
constexpr int kMaxRejected = 3;             // detections outside the gate before the filter starts anew
constexpr double kThinnest_mm = 0.8;        // shaft of an instrument
constexpr double kThickest_mm = 25;
constexpr double kTipDeviation_px = 0.7;  // where the mask ends against where the jaws end
constexpr double kDisparityFloor_px = 0.2;
constexpr double kUnfit_px = 1.5;  // of disparity, for a template of which nothing fits any more
constexpr double kClearlyBetterFit = 0.1;
constexpr double kBias_mm = 0.25;  // what does not average out over frames: outline, one side of the jaws seen
constexpr double kMotionFloor_mm = 0.02;
constexpr double kMotionModelFraction =
    0.04;  // of a displacement: light that does not move along, depths of the template

double followed_length_px(const ImageTip& tip) {
  return std::clamp(kTemplateWidths * tip.width_px, 60.0, 220.0);
}

Vec3 rectified_point(const Rectification& r, const cv::Point2d& left_px, double disparity) {
  const double z = r.depth_mm(disparity);
  return {(left_px.x - r.principal_x_px) * z / r.focal_px, (left_px.y - r.principal_y_px) * z / r.focal_px, z};
}

/// Depth that a pixel of disparity makes.
double depth_per_px(const Rectification& r, double z_mm) {
  return z_mm * z_mm / (r.focal_px * r.baseline_mm);
}

cv::Point2d left_pixel(const Rectification& r, const Vec3& p) {
  return {r.focal_px * p.x() / p.z() + r.principal_x_px, r.focal_px * p.y() / p.z() + r.principal_y_px};
}

}  // namespace

cv::Rect region_around(const ImageTip& tip) {
  const double margin = 0.6 * tip.width_px + 36;
  const cv::Point2d back = tip.tip_px - followed_length_px(tip) * tip.axis;
  const double x0 = std::min(tip.tip_px.x, back.x) - margin, x1 = std::max(tip.tip_px.x, back.x) + margin;
  const double y0 = std::min(tip.tip_px.y, back.y) - margin, y1 = std::max(tip.tip_px.y, back.y) + margin;
  return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1 - x0), static_cast<int>(y1 - y0)};
}

bool can_be_one_tip(const ImageTip& left, const ImageTip& right) {
  const double disparity = left.tip_px.x - right.tip_px.x;
  const double rows = std::abs(left.tip_px.y - right.tip_px.y);
  return disparity >= 1 && rows <= 4 + 0.15 * left.width_px && left.axis.dot(right.axis) >= 0.9;
}

/// What a frame says about the tip without the frames before it; rectified frame.
struct TipTracker::Detection {
  InstrumentPlane plane;
  PatchTemplate left_template;
  Vec3 tip_mm = Vec3::Zero();
  Mat3 covariance_mm2 = Mat3::Identity();
};

std::optional<TipTracker::Detection> TipTracker::detect(const CameraView& left, const CameraView& right) const {
  const Rectification& r = rectification_;
  if (!left.tip || !right.tip || !can_be_one_tip(*left.tip, *right.tip)) return {};
  const double guess = left.tip->tip_px.x - right.tip->tip_px.x;
  Detection detection;
  detection.left_template = make_template(left.layers, left.mask, *left.tip, followed_length_px(*left.tip));
  const PlanePrior prior{guess, rows_, last_plane_ ? &*last_plane_ : nullptr};
  const auto plane = match_instrument(detection.left_template, *left.tip, right.layers, r.focal_px, prior);
  if (!plane) return {};
  // Both masks end at the same tip: the match of the whole far part must not contradict them.
  if (std::abs(plane->disparity[0] - guess) > 4 + 0.1 * left.tip->width_px) return {};
  const double width_mm = left.tip->width_px * r.depth_mm(plane->disparity[0]) / r.focal_px;
  if (width_mm < kThinnest_mm || width_mm > kThickest_mm) return {};
  detection.plane = *plane;
  detection.tip_mm = rectified_point(r, left.tip->tip_px, plane->disparity[0]);
  const double z = detection.tip_mm.z();
  const double across = kTipDeviation_px * z / r.focal_px;
  const double along = depth_per_px(r, z) * std::max(plane->disparity_deviation_px, kDisparityFloor_px);
  const Vec3 ray = detection.tip_mm / z;  // an error of depth moves the point along its viewing ray
  detection.covariance_mm2 = across * across * Mat3::Identity() + along * along * ray * ray.transpose();
  return detection;
}

TipObservation TipTracker::update(const CameraView& left, const CameraView& right, int index, double seconds,
                                  bool touches_another) {
  last_row_.reset();
  std::optional<Detection> detection = detect(left, right);
  const auto measured = motion_since_keyframe(left, right, detection, seconds);
  frames_alone_ = detection ? 0 : frames_alone_ + 1;
  // Beside another instrument no tip can be expected from the masks; a held one lies in the tissue, which hides its
  // end, and its contact hangs on it.
  const bool trusted = touches_another || (marked_ && measured && measured->agreement > kGoodAgreement);
  const bool followed = measured && filter_.started() &&
                        frames_alone_ <= (trusted ? kMaxFramesTrusted : kMaxFramesAlone) &&
                        (detection || measured->agreement > kMinAgreementAlone);
  TipObservation observation;
  if (!detection && !followed) {
    lose();
    return observation;
  }

  if (!advance(measured, followed, detection, seconds)) {
    lose();
    return observation;
  }
  visible_ = true;

  if (detection) {
    last_plane_ = detection->plane;
    synchronization_.add(index, left.tip->tip_px.y, right.tip->tip_px.y);
    out_of_step_ = synchronization_.frames().value_or(out_of_step_ ? 1 : 0) != 0;
  }
  if (left.tip) last_tips_[0] = left.tip;
  if (right.tip) last_tips_[1] = right.tip;
  report_since_mark(observation);
  renew_keyframe(std::move(detection), right);

  const Mat3 left_from_rectified = rectification_.rectified_from_left.transpose();
  observation.visible = true;
  observation.tip_mm = left_from_rectified * filter_.position_mm();
  observation.velocity_mm_per_s = left_from_rectified * filter_.velocity_mm_per_s();
  observation.covariance_mm2 =
      left_from_rectified * filter_.position_covariance_mm2() * left_from_rectified.transpose() +
      kBias_mm * kBias_mm * Mat3::Identity();
  return observation;
}

TipObservation TipTracker::update(const std::optional<TipTrack::Row>& row) {
  TipObservation observation;
  visible_ = row.has_value();
  if (!visible_) return observation;
  observation.visible = true;
  observation.is_seen = false;
  observation.tip_mm = row->tip_mm;
  observation.closed = row->closed;
  observation.covariance_mm2 = kBias_mm * kBias_mm * Mat3::Identity();
  if (last_row_ && row->time_s > last_row_->time_s)
    observation.velocity_mm_per_s = (row->tip_mm - last_row_->tip_mm) / (row->time_s - last_row_->time_s);
  last_row_ = row;
  filter_.start(observation.tip_mm, observation.covariance_mm2);
  if (marked_) {
    observation.since_mark_mm = observation.tip_mm - tip_at_mark_mm_;
    observation.since_mark_covariance_mm2 = kMotionFloor_mm * kMotionFloor_mm * Mat3::Identity();
  }
  return observation;
}

std::optional<RigidMotion> TipTracker::motion_since_keyframe(const CameraView& left, const CameraView& right,
                                                             const std::optional<Detection>& detection,
                                                             double seconds) const {
  if (!keyframe_) return {};
  RigidMotion guess = motion_;
  if (filter_.started()) guess.translation_mm += seconds * filter_.velocity_mm_per_s();
  const Light light = marked_ ? Light::gain_and_ramp : Light::offset;
  auto best = measure_motion(*keyframe_, left.layers, right.layers, rectification_, guess, light);
  if (best && best->agreement > kGoodAgreement) return best;
  if (detection) {
    guess.translation_mm = detection->tip_mm - keyframe_->tip_mm;
    const auto other = measure_motion(*keyframe_, left.layers, right.layers, rectification_, guess, light);
    if (other && (!best || other->agreement > best->agreement)) best = other;
  }
  return best;
}

/// Of the motion from one frame to the next. What the template no longer resembles misleads above all in depth.
Mat3 TipTracker::step_covariance(const RigidMotion& motion) const {
  const Vec3 ray = filter_.position_mm() / filter_.position_mm().z();
  const double along_mm = kUnfit_px * (1 - motion.agreement) * depth_per_px(rectification_, filter_.position_mm().z());
  return motion.covariance_mm2 + kMotionFloor_mm * kMotionFloor_mm * Mat3::Identity() +
         along_mm * along_mm * ray * ray.transpose();
}

/// False when nothing says where the tip is: it is not where it was going, and no motion confirms that it turned.
bool TipTracker::advance(const std::optional<RigidMotion>& measured, bool followed,
                         const std::optional<Detection>& detection, double seconds) {
  const TipFilter before = filter_;
  std::optional<RigidMotion> taken = measured;
  const auto corrected = [&] { return filter_.correct(detection->tip_mm, detection->covariance_mm2); };
  if (followed) {
    filter_.move(measured->translation_mm - motion_.translation_mm, step_covariance(*measured), seconds);
  } else if (filter_.started()) {
    filter_.predict(seconds);
  }
  // A held tip hides in the tissue, and its mask then ends wherever the tissue begins.
  const bool held = followed && marked_ && measured->agreement > kGoodAgreement;
  if (detection && (!filter_.started() || (rejected_ >= kMaxRejected && !held))) {
    filter_.start(detection->tip_mm, detection->covariance_mm2);
    rejected_ = 0;
  } else if (detection && corrected()) {
    rejected_ = 0;
  } else if (detection) {
    // Motion and detection contradict each other: the one that clearly fits better is right, or that continues the path
    // so far, or comes nearer to it; a marked template, which the contact hangs on, has proved itself.
    const TipFilter as_followed = filter_;
    filter_ = before;
    filter_.predict(seconds);
    const Vec3 predicted_mm = filter_.position_mm();
    const bool is_nearer =
        (detection->tip_mm - predicted_mm).norm() < (as_followed.position_mm() - predicted_mm).norm();
    const bool continues = corrected();
    const bool fits_better = followed && detection->plane.agreement > measured->agreement + kClearlyBetterFit;
    if (followed && !marked_ && (continues || is_nearer || fits_better)) {
      if (!continues) filter_.start(detection->tip_mm, detection->covariance_mm2);
      taken.reset();
      rejected_ = 0;
    } else if (!followed && !marked_) {
      return false;
    } else {
      filter_ = as_followed;
      ++rejected_;
    }
  }
  if (taken)
    motion_ = *taken;
  else
    motion_.agreement = 0;
  return true;
}

void TipTracker::renew_keyframe(std::optional<Detection> detection, const CameraView& right) {
  const double travelled_px = keyframe_
                                  ? cv::norm(left_pixel(rectification_, keyframe_->tip_mm) -
                                             left_pixel(rectification_, keyframe_->tip_mm + motion_.translation_mm))
                                  : 0;
  const bool stale = !keyframe_ || motion_.agreement < kGoodAgreement || travelled_px > kKeyframeReach_px;
  fresh_keyframe_.reset();
  if (!detection || rejected_ > 0) return;
  ImageTip right_tip = *right.tip;
  right_tip.tip_px = detection->plane.origin_px - cv::Point2d(detection->plane.disparity[0], 0);
  InstrumentKeyframe& fresh = fresh_keyframe_.emplace();
  fresh.right = make_template(right.layers, right.mask, right_tip, followed_length_px(right_tip));
  fresh.left = std::move(detection->left_template);
  fresh.plane = detection->plane;
  fresh.tip_mm = detection->tip_mm;
  if (stale && !marked_) use_fresh_keyframe();
}

void TipTracker::use_fresh_keyframe() {
  keyframe_ = std::move(fresh_keyframe_);
  fresh_keyframe_.reset();
  motion_ = RigidMotion();
  motion_.agreement = 1;
}

void TipTracker::lose() {
  visible_ = false;
  filter_.stop();
  last_plane_.reset();
  if (!marked_) keyframe_.reset();
  fresh_keyframe_.reset();
  frames_alone_ = rejected_ = 0;
}

void TipTracker::report_since_mark(TipObservation& observation) const {
  if (!marked_) return;
  const Mat3 left_from_rectified = rectification_.rectified_from_left.transpose();
  Vec3 since = filter_.position_mm() - tip_at_mark_mm_;
  Mat3 covariance = filter_.position_covariance_mm2() + covariance_at_mark_mm2_;
  if (motion_at_mark_ && motion_.agreement > 0) {
    since = motion_.translation_mm - motion_at_mark_->translation_mm;
    const double model = kMotionModelFraction * since.norm();
    covariance = motion_.covariance_mm2 + motion_at_mark_->covariance_mm2 +
                 (kMotionFloor_mm * kMotionFloor_mm + model * model) * Mat3::Identity();
  }
  observation.since_mark_mm = left_from_rectified * since;
  observation.since_mark_covariance_mm2 = left_from_rectified * covariance * left_from_rectified.transpose();
}

cv::Point2d TipTracker::expected_px(size_t camera, double seconds) const {
  const Vec3 tip_mm = filter_.position_mm() + seconds * filter_.velocity_mm_per_s();
  const double disparity = camera == 0 ? 0 : rectification_.disparity_px(tip_mm.z());
  return left_pixel(rectification_, tip_mm) - cv::Point2d(disparity, 0);
}

void TipTracker::mark() {
  marked_ = visible_;
  motion_at_mark_.reset();
  if (!visible_) return;
  tip_at_mark_mm_ = filter_.position_mm();
  covariance_at_mark_mm2_ = filter_.position_covariance_mm2();
  if (last_row_) return;
  if (fresh_keyframe_) use_fresh_keyframe();
  if (keyframe_) motion_at_mark_ = motion_;
}

void TipTracker::unmark() {
  marked_ = false;
  motion_at_mark_.reset();
}

}  // namespace palpate
