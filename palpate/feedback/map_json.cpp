#include "palpate/feedback/map_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "palpate/feedback/map_confidence.h"

namespace palpate {

std::string map_json(const TissueMap& map, const Rectification& rectification) {
  const MapReport& r = map.report;
  nlohmann::ordered_json json;
  json["frame"] = map.frame;
  json["counts"] = {{"matched_points", r.matched_points},
                    {"cloud_points", map.cloud.size()},
                    {"surface_vertices", map.surface.vertices_mm.size()},
                    {"surface_triangles", map.surface.triangles.size()},
                    {"nodes", map.mesh.nodes_mm.size()},
                    {"elements", map.mesh.tetrahedra.size()},
                    {"fixed_nodes", map.fixed_nodes.size()}};
  json["times_ms"] = {
      {"rectify", r.rectify_ms}, {"match", r.match_ms},   {"triangulate", r.triangulate_ms}, {"edges", r.edges_ms},
      {"surface", r.surface_ms}, {"volume", r.volume_ms}, {"attachments", r.attachments_ms}};
  if (!map.disparity.warnings.empty()) json["warnings"] = map.disparity.warnings;
  json["coverage"] = r.coverage;
  json["median_depth_deviation_mm"] = r.median_depth_deviation_mm;
  json["smallest_dihedral_deg"] = r.mesh.smallest_dihedral_deg;
  json["cell_size_mm"] = r.mesh.cell_size_mm;
  for (const SurfacePiece& piece : map.pieces) {
    nlohmann::ordered_json outline = nlohmann::ordered_json::array();
    for (const cv::Point2d& corner : outline_px(piece.surface, rectification.rig))
      outline.push_back({std::round(10 * corner.x) / 10, std::round(10 * corner.y) / 10});
    json["pieces"].push_back({{"organ", json["pieces"].empty()},
                              {"area_mm2", piece.area_mm2},
                              {"depth_mm", piece.depth_mm},
                              {"outline_px", outline}});
  }
  if (r.registration) {
    nlohmann::ordered_json rotation;
    for (int i = 0; i < 3; ++i) {
      const auto row = r.registration->left_from_volume.row(i);
      rotation.push_back({row[0], row[1], row[2]});
    }
    const Vec3& t = r.registration->left_from_volume_mm;
    json["registration"] = {{"residual_mm", r.registration->residual_mm},
                            {"matched_share", r.registration->matched_fraction},
                            {"left_from_volume", rotation},
                            {"left_from_volume_mm", {t.x(), t.y(), t.z()}}};
    json["times_ms"]["register"] = r.register_ms;
  }
  for (size_t k = 0; k < map.tissue.of_label.size(); ++k)
    json["labels"].push_back(
        {{"label", k + 1},
         {"elements", std::count(map.mesh.label.begin(), map.mesh.label.end(), static_cast<int>(k) + 1)},
         {"young_modulus_kPa", map.tissue.of_label[k].young_modulus_kPa},
         {"poisson_ratio", map.tissue.of_label[k].poisson_ratio}});
  json["tissue"] = {{"law", law_name(map.tissue.law)},
                    {"young_modulus_kPa", map.tissue.young_modulus_kPa},
                    {"poisson_ratio", map.tissue.poisson_ratio}};
  json["focal_px"] = rectification.focal_px;
  json["baseline_mm"] = rectification.baseline_mm;
  for (int i = 0; i < 3; ++i) {
    const auto row = rectification.rectified_from_left.row(i);
    json["rectified_from_left"].push_back({row[0], row[1], row[2]});
  }
  return json.dump(1) + "\n";
}

}  // namespace palpate
