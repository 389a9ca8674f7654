#include "palpate/estimate/map_model.h"

#include <utility>

namespace palpate {

namespace {

AttachedMesh attached(const AttachmentOptions& attachments, const Rectification& rectification, TetMesh mesh) {
  std::vector<int> fixed = select_attachments(mesh, attachments, [&rectification](const Vec3& point) {
    return project_to_recorded_left(rectification.rig, point);
  });
  return {std::move(mesh), std::move(fixed)};
}

}  // namespace

ContactModel contact_model(const TissueMap& map, const Rectification& rectification, double radius_mm) {
  const auto mesh_around = [rest = map.mesh, attachments = map.attachments, rectification,
                            radius_mm](const std::vector<Vec3>& places_mm) {
    TetMesh mesh = rest;
    for (const Vec3& place_mm : places_mm) {
      mesh = refine_near(mesh, place_mm, 4 * radius_mm, 1.5 * radius_mm);
      mesh = refine_near(mesh, place_mm, 1.5 * radius_mm, 1.0 * radius_mm);
      mesh = refine_near(mesh, place_mm, 0.7 * radius_mm, 0.6 * radius_mm);
    }
    return attached(attachments, rectification, std::move(mesh));
  };
  return {mesh_around, map.tissue, map.element};
}

}  // namespace palpate
