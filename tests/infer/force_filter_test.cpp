#include "palpate/infer/force_filter.h"

#include <gtest/gtest.h>

#include <random>

#include "palpate/infer/measurement.h"
#include "palpate/volume/tetrahedralize.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

constexpr double kTrueRadius_mm = 4, kSeconds = 0.04;
const TissueOptions kTissue{Law::saint_venant_kirchhoff, 27, 0.4, ""};
const Vec3 kDepth_mm(-30, -30, 100), kPlace_mm = Vec3(30, 30, 0) + kDepth_mm;

Rectification da_vinci() {
  Rectification r;
  r.size = {960, 540};
  r.focal_px = 700;
  r.principal_x_px = 480;
  r.principal_y_px = 270;
  r.baseline_mm = 5;
  r.identity = true;
  return r;
}

AttachedMesh slab_of(double thickness_mm, const std::vector<Vec3>& places_mm) {
  TetMesh mesh = test::box_mesh({60, 60, thickness_mm}, {10, 10, 4});
  for (Vec3& node : mesh.nodes_mm) node += kDepth_mm;
  for (const Vec3& place_mm : places_mm) mesh = refine_near(mesh, place_mm, 6, 3);
  std::vector<int> fixed;
  for (size_t i = 0; i < mesh.nodes_mm.size(); ++i)
    if (mesh.nodes_mm[i].z() > kDepth_mm.z() + thickness_mm - 0.01) fixed.push_back(static_cast<int>(i));
  return {std::move(mesh), fixed};
}

AttachedMesh slab(const std::vector<Vec3>& places_mm) {
  return slab_of(20, places_mm);
}
AttachedMesh thin_slab(const std::vector<Vec3>& places_mm) {
  return slab_of(16, places_mm);
}

std::vector<TissuePoint> grid_of_points() {
  std::vector<TissuePoint> points;
  for (int i = 2; i < 19; ++i)
    for (int j = 2; j < 19; ++j) {
      TissuePoint point;
      point.number = static_cast<int>(points.size());
      point.rest_mm = Vec3(3.0 * i, 3.0 * j, 0) + kDepth_mm;
      points.push_back(point);
    }
  return points;
}

/// Tissue that is held by a patch of the true radius, in a scene that breathes, seen with noise.
class Made {
 public:
  explicit Made(const TissueOptions& tissue = kTissue, unsigned seed = 7)
      : truth_(slab, tissue, Element::averaged), points_(grid_of_points()), random_(seed) {
    truth_.begin(kPlace_mm, kTrueRadius_mm);
    places_ = places_of(points_, truth_.model().rest_mm(), truth_.boundary());
  }

  const std::vector<TissuePoint>& points() const { return points_; }

  /// q of the true patch; `scene` moves everything.
  FrameEvidence frame(int index, const Vec3& q_mm, const Vec3& scene_mm, bool held, bool tip_seen = true) {
    FrameEvidence frame;
    frame.time_s = kSeconds * index;
    equilibrium_ = truth_.solve({held ? q_mm : Vec3::Zero()});
    std::normal_distribution<double> noise(0, 0.05);
    for (TissuePoint point : points_) {
      const SurfacePlace& place = places_[static_cast<size_t>(point.number)];
      Vec3 u = Vec3::Zero();
      for (size_t c = 0; c < 3; ++c)
        u += place.barycentric[static_cast<int>(c)] * equilibrium_.u.segment<3>(3 * place.nodes[c]);
      point.motion_px = project_stereo(rig_, point.rest_mm + u + scene_mm).px - project_stereo(rig_, point.rest_mm).px +
                        Vec3(noise(random_), noise(random_), noise(random_));
      frame.tissue.push_back(point);
    }
    frame.tips.resize(kMaxInstruments);
    TipObservation& tip = frame.tips[0];
    tip.visible = tip_seen;
    tip.tip_mm = kPlace_mm + q_mm + scene_mm + 0.3 * Vec3(noise(random_), noise(random_), noise(random_));
    tip.covariance_mm2 = 0.04 * Mat3::Identity();
    if (marked_) {
      tip.since_mark_mm = tip.tip_mm - *marked_;
      tip.since_mark_covariance_mm2 = 4e-4 * Mat3::Identity();
    }
    return frame;
  }

  void mark(const FrameEvidence& frame) { marked_ = frame.tips[0].tip_mm; }
  Vec3 force_N() const { return equilibrium_.force_N; }

 private:
  Rectification rig_ = da_vinci();
  ContactModel truth_;
  std::vector<TissuePoint> points_;
  std::vector<SurfacePlace> places_;
  Equilibrium equilibrium_;
  std::mt19937 random_;
  std::optional<Vec3> marked_;
};

struct PullRun {
  double worst_error_N = 0, last_error_N = 0, peak_N = 0;
  FrameAnswer last;
};

/// Comes down in 12 frames, takes hold, pulls by 3 mm in 12 and stays for 6. `way`: -1 presses.
PullRun pull(Made& made, ForceFilter& filter, double breath_mm, int hidden_from = 1000, int hidden_to = 1000,
             double way = 1) {
  PullRun run;
  for (int i = 0; i < 31; ++i) {
    const Vec3 scene_mm = breath_mm * std::sin(0.1 * i) * Vec3(0.3, 0.8, 0.5);
    const double height_mm = i < 12 ? 0.15 * (12 - i) * (12 - i) : 0;
    const double pulled_mm = way * 3 * std::clamp((i - 13) / 12.0, 0.0, 1.0);
    const bool is_held = i >= 12;
    const Vec3 q_mm(0.2 * pulled_mm, 0, -height_mm - pulled_mm);
    const FrameEvidence frame = made.frame(i, q_mm, scene_mm, is_held, i < hidden_from || i >= hidden_to);
    run.last = filter.update(frame);
    if (run.last.instruments[0].begins) made.mark(frame);
    const Vec3 truth_N = is_held ? made.force_N() : Vec3::Zero();
    run.peak_N = std::max(run.peak_N, truth_N.norm());
    run.last_error_N = (run.last.instruments[0].force_N - truth_N).norm();
    if (i >= 17) run.worst_error_N = std::max(run.worst_error_N, (run.last.instruments[0].force_N - truth_N).norm());
  }
  return run;
}

ForceFilter filter_for(const Made& made, double stated_radius_mm, Drive drive = Drive::fused) {
  ContactOptions contact;
  contact.footprint_radius_mm = stated_radius_mm;
  contact.grip = Grip::grasp;
  contact.drive = drive;
  return ForceFilter(ContactModel(slab, kTissue, Element::averaged), slab({}), made.points(), da_vinci(), contact);
}

TEST(ForceFilter, NoContactBeginsWhereNoneMay) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  bool ever_held = false, was_refused = false;
  for (int i = 0; i < 20; ++i) {
    const double height_mm = i < 12 ? 0.15 * (12 - i) * (12 - i) : 0;
    FrameEvidence frame = made.frame(i, Vec3(0, 0, -height_mm), Vec3::Zero(), false);
    frame.may_be_held = [](const Vec3& place_mm) { return place_mm.x() > kPlace_mm.x() + 5; };
    const InstrumentAnswer answer = filter.update(frame).instruments[0];
    ever_held |= answer.hold != Hold::free;
    was_refused |= answer.is_off_limits;
  }
  EXPECT_FALSE(ever_held);
  EXPECT_TRUE(was_refused);
}

TEST(ForceFilter, FindsTheForceOfAPull) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  const PullRun run = pull(made, filter, 0);
  EXPECT_GT(run.peak_N, 0.3);
  EXPECT_LT(run.worst_error_N, 0.08 * run.peak_N);
  EXPECT_EQ(run.last.instruments[0].hold, Hold::grasp);
}

TEST(ForceFilter, ARadiusToldAtHalfOrTwiceHarmsItLessThanHalfAsMuchAsTheTipAlone) {
  for (const double ratio : {0.5, 2.0}) {
    Made made, again;
    ForceFilter fused = filter_for(made, ratio * kTrueRadius_mm),
                by_tip = filter_for(again, ratio * kTrueRadius_mm, Drive::tip);
    const PullRun run = pull(made, fused, 0), tip_run = pull(again, by_tip, 0);
    EXPECT_GT(tip_run.last_error_N, 0.3 * run.peak_N) << ratio;
    EXPECT_LT(run.last_error_N, 0.5 * tip_run.last_error_N) << ratio;
  }
}

/// Pressed, Saint Venant-Kirchhoff takes less force the deeper it is, and none belongs to a depth alone.
const TissueOptions kPressed{Law::neo_hookean, 27, 0.4, ""};

/// Force at the end of a press or a pull through a body closed as `map`, ratio to the truth.
double told_at(double stated_ratio, double way, const ContactModel::MeshAround& map, unsigned seed = 7) {
  Made made(kPressed, seed);
  ContactOptions contact;
  contact.footprint_radius_mm = stated_ratio * kTrueRadius_mm;
  contact.grip = Grip::grasp;
  ForceFilter filter(ContactModel(map, kPressed, Element::averaged), map({}), made.points(), da_vinci(), contact);
  const PullRun run = pull(made, filter, 0, 1000, 1000, way);
  return run.last.instruments[0].force_N.norm() / made.force_N().norm();
}

TEST(ForceFilter, WhereTheTissueTellsTheRadiusTheForceHardlyHangsOnTheOneStated) {
  for (const double way : {1.0, -1.0}) {
    const double half = told_at(0.5, way, thin_slab), twice = told_at(2, way, thin_slab);
    EXPECT_NEAR(half, twice, 0.2) << way;
    EXPECT_NEAR(half, 1, 0.2) << way;
    EXPECT_NEAR(twice, 1, 0.2) << way;
  }
}

TEST(ForceFilter, ARadiusToldAtTwiceIsFoundInAPressAsInAPullWhateverTheNoise) {
  for (const double way : {1.0, -1.0})
    for (const unsigned seed : {1U, 4U, 7U}) EXPECT_NEAR(told_at(2, way, slab, seed), 1, 0.1) << way << " " << seed;
}

/// By how much the radius changes, as a ratio, while a thin body's patch is held still for 1.6 s after a pull.
double drift_in_a_hold(const InferenceParameters& parameters) {
  Made made;
  ContactOptions contact;
  contact.footprint_radius_mm = kTrueRadius_mm;
  contact.grip = Grip::grasp;
  ForceFilter filter(ContactModel(thin_slab, kTissue, Element::averaged), thin_slab({}), made.points(), da_vinci(),
                     contact, parameters);
  pull(made, filter, 0);
  std::vector<double> radii_mm;
  for (int i = 31; i < 71; ++i)
    radii_mm.push_back(filter.update(made.frame(i, Vec3(0.6, 0, -3), Vec3::Zero(), true)).instruments[0].footprint_mm);
  return std::abs(radii_mm.back() / radii_mm.front() - 1);
}

TEST(ForceFilter, AHandThatHoldsStillTeachesTheRadiusLittleMore) {
  InferenceParameters every_frame;
  every_frame.new_pose = 0;
  const double drift = drift_in_a_hold({}), drift_if_learned = drift_in_a_hold(every_frame);
  EXPECT_LT(drift, 0.6 * drift_if_learned) << drift << " " << drift_if_learned;
  EXPECT_LT(drift, 0.06);
}

TEST(ForceFilter, ATouchThatWentByUnnoticedIsFoundByTheTissueThatItMoves) {
  Made made;
  InferenceParameters blind;
  blind.touch_per_s = blind.unnoticed = 1e-9;
  ContactOptions contact;
  contact.footprint_radius_mm = kTrueRadius_mm;
  contact.grip = Grip::grasp;
  ForceFilter filter(ContactModel(slab, kTissue, Element::averaged), slab({}), made.points(), da_vinci(), contact,
                     blind);
  const PullRun run = pull(made, filter, 0);
  EXPECT_EQ(run.last.instruments[0].hold, Hold::grasp);
  EXPECT_LT(run.last_error_N, 0.1 * run.peak_N);
}

TEST(ForceFilter, AfterATipThatOvershotNothingIsReleasedAndTheTouchIsSeen) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  const auto show = [&](int i, double aside_mm, double height_mm) {
    return filter.update(made.frame(i, Vec3(aside_mm, 0, -height_mm), Vec3::Zero(), false)).instruments[0];
  };
  bool begins = false;
  for (int i = 0; i < 6; ++i) begins |= show(i, 2.3, 3.0 * (5 - i) - 2).begins;
  EXPECT_TRUE(begins);
  show(6, 1.2, -1);
  show(7, 0.4, 0.3);
  show(8, 0, 0.3);
  PullRun run;
  for (int i = 9; i < 26; ++i) {
    const double pulled_mm = 3 * std::clamp((i - 12) / 12.0, 0.0, 1.0);
    const FrameEvidence frame = made.frame(i, Vec3(0, 0, -pulled_mm), Vec3::Zero(), true);
    run.last = filter.update(frame);
    if (run.last.instruments[0].begins) made.mark(frame);
  }
  EXPECT_EQ(run.last.instruments[0].hold, Hold::grasp);
  EXPECT_LT((run.last.instruments[0].force_N - made.force_N()).norm(), 0.1 * made.force_N().norm());
}

TEST(ForceFilter, AScenesMotionIsNoForce) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  const PullRun run = pull(made, filter, 4);
  EXPECT_LT(run.worst_error_N, 0.08 * run.peak_N);
  EXPECT_GT(run.last.scene.translation_mm.norm(), 0.4);
}

TEST(ForceFilter, TheTissueTellsTheForceWhileTheTipIsHidden) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  const PullRun run = pull(made, filter, 0, 22, 31);
  EXPECT_LT(run.worst_error_N, 0.15 * run.peak_N);
  EXPECT_TRUE(run.last.instruments[0].tip_inferred);
}

TEST(ForceFilter, ReleasedTissueIsSeenAtOnce) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  pull(made, filter, 0);
  const Vec3 q_mm(0.6, 0, -3);
  for (int i = 31; i < 34; ++i) {
    const FrameAnswer answer = filter.update(made.frame(i, q_mm, Vec3::Zero(), false));
    EXPECT_EQ(answer.instruments[0].hold, Hold::free) << i;
    EXPECT_EQ(answer.instruments[0].force_N.norm(), 0) << i;
  }
}

TEST(ForceFilter, AHoveringTipTouchesNothing) {
  Made made;
  ForceFilter filter = filter_for(made, kTrueRadius_mm);
  for (int i = 0; i < 30; ++i) {
    const Vec3 q_mm(0.2 * i, 0, -3 - std::cos(0.3 * i));
    EXPECT_EQ(filter.update(made.frame(i, q_mm, Vec3::Zero(), false)).instruments[0].hold, Hold::free) << i;
  }
}

}  // namespace
}  // namespace palpate
