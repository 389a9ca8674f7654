#pragma once

#include "palpate/estimate/tissue_map.h"

namespace palpate {

/// What of the map a tip may begin to hold: places of the body that were seen, in the map frame or since an instrument
/// that stood before them has left. Of a body from a scan, every place. Places are those at rest.
class Touchable {
 public:
  Touchable(const TissueMap& map, const Rectification& rectification);

  /// A later frame: what no instrument covers (`left_mask`: 255 = instrument, rectified; empty = none is looked for) is
  /// seen now.
  void look(const cv::Mat& left_mask);

  bool may_be_held(const Vec3& place_mm) const;

  /// Whether a tip that holds nothing stands within `reach_mm` of tissue that is no part of V.
  bool is_on_other_tissue(const Vec3& tip_mm, double reach_mm) const;

  /// Fraction of a patch's radius by which it reaches over the edge of what was seen.
  double beyond_edge(const Vec3& place_mm, double radius_mm) const;

  /// Those triangles of the body that were seen.
  std::vector<Triangle> seen_faces(const std::vector<Vec3>& rest_mm, const std::vector<Triangle>& boundary) const;

 private:
  struct HiddenCell {
    cv::Point cell;
    cv::Point rectified_px;
  };

  bool everything_ = false;
  double reach_mm_ = 0;  ///< how far the body's boundary may lie from S*
  SeenTissue seen_;
  std::vector<HiddenCell> hidden_;
  std::vector<Surface> other_;
};

}  // namespace palpate
