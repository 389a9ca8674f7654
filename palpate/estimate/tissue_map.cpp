#include "palpate/estimate/tissue_map.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/core/stopwatch.h"
#include "palpate/estimate/check_map.h"
#include "palpate/instrument/segment.h"
#include "palpate/stereo/quasi_dense.h"
#include "palpate/stereo/triangulate.h"
#include "palpate/surface/cocone.h"

namespace palpate {

namespace {

/// Organ region without instruments, highlights and the border of the scope.
cv::Mat tissue_mask(const RectifiedPair& pair, const Rectification& rectification, const cv::Mat& organ_mask) {
  const cv::Mat instrument = segment_instrument(pair.left, learn_segmentation(pair.left, organ_mask));
  cv::Mat mask = organ_mask & matchable_mask(pair.left) & rectification.valid_left;
  mask.setTo(0, instrument);
  return mask;
}

/// Spacing of S* that lets `elements` tetrahedra follow it: a third of the edge of regular tetrahedra that fill the
/// body.
double spacing_for(const PointCloud& cloud, const Rectification& rectification, const MapOptions& options) {
  if (options.surface.spacing_mm > 0) return options.surface.spacing_mm;
  double area_mm2 = 0;
  for (const Vec3& p : cloud.position_mm) area_mm2 += std::pow(p.z() / rectification.focal_px, 2);
  const double element_mm3 = area_mm2 * options.thickness_mm / options.elements;
  const double edge_mm = std::cbrt(6 * std::sqrt(2.0) * element_mm3);
  return std::clamp(edge_mm / 3, 0.6, 3.0);
}

double median_of(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

TissueMap build_tissue_map(const StereoFrame& frame, const Rectification& rectification, const MapOptions& options,
                           const TissueOptions& tissue, const AttachmentOptions& attachments) {
  TissueMap map;
  map.tissue = tissue;
  map.element = options.element;
  map.frame = frame.index;
  Stopwatch watch;
  const RectifiedPair pair = rectify(rectification, frame);
  map.organ_mask = rectified_polygon_mask(rectification, options.organ_region_px);
  const cv::Mat mask = tissue_mask(pair, rectification, map.organ_mask);
  map.report.rectify_ms = watch.lap_ms();

  map.disparity = match(pair, rectification, mask, options.match);
  map.report.match_ms = watch.lap_ms();

  map.cloud = triangulate(map.disparity, rectification, pair.left);
  map.report.triangulate_ms = watch.lap_ms();

  const double spacing_mm = spacing_for(map.cloud, rectification, options);
  const PointCloud points = clean_points(map.cloud, spacing_mm, options.surface);
  map.report.clean_ms = watch.lap_ms();

  map.surface = cocone(points.position_mm, options.surface);
  map.report.surface_ms = watch.lap_ms();

  const Surface body = options.volume.empty() ? close_body(map.surface, options.thickness_mm)
                                              : read_body(options.volume, options.volume_unit);
  if (!options.volume.empty())
    require_body_where_seen(body, map.disparity, rectification, map.organ_mask, options.volume);
  map.mesh = tetrahedralize(body, options.elements, {}, &map.report.mesh);
  map.report.volume_ms = watch.lap_ms();

  map.fixed_nodes = select_attachments(map.mesh, attachments, [&rectification](const Vec3& point) {
    return project_to_recorded_left(rectification.rig, point);
  });
  require_every_piece_held(map.mesh, map.fixed_nodes);
  map.report.attachments_ms = watch.lap_ms();

  map.report.matched_points = static_cast<int>(map.cloud.size());
  map.report.coverage = static_cast<double>(map.cloud.size()) / std::max(1, cv::countNonZero(map.organ_mask));
  map.report.median_depth_deviation_mm = median_of(map.cloud.depth_deviation_mm);
  return map;
}

}  // namespace palpate
