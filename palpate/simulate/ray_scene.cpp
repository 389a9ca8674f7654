#include "palpate/simulate/ray_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <limits>
#include <stdexcept>

namespace palpate {
namespace {

RTCRay make_ray(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float end) {
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = end;
  ray.mask = ~0u;
  return ray;
}

}  // namespace

struct RayScene::Tree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<RTCGeometry> geometries;

  Tree() {
    // The tree is built by one thread: it must not depend on how many there are.
    device = rtcNewDevice("threads=1");
    if (device == nullptr) throw std::runtime_error("ray tracing: Embree cannot start");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_DYNAMIC | RTC_SCENE_FLAG_ROBUST));
  }
  ~Tree() {
    for (RTCGeometry geometry : geometries) rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;
};

RayScene::RayScene() : tree_(std::make_unique<Tree>()) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;

int RayScene::add(const std::vector<Triangle>& triangles, size_t vertex_count) {
  RTCGeometry geometry = rtcNewGeometry(tree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), triangles.size()));
  for (const Triangle& triangle : triangles)
    for (int corner : triangle) *corners++ = static_cast<unsigned>(corner);
  rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertex_count);
  rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
  tree_->geometries.push_back(geometry);
  const auto number = static_cast<unsigned>(tree_->geometries.size() - 1);
  rtcAttachGeometryByID(tree_->scene, geometry, number);
  return static_cast<int>(number);
}

void RayScene::place(int surface, const std::vector<Vec3>& vertices_mm) {
  RTCGeometry geometry = tree_->geometries.at(static_cast<size_t>(surface));
  auto* place = static_cast<float*>(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0));
  for (const Vec3& vertex : vertices_mm)
    for (int k = 0; k < 3; ++k) *place++ = static_cast<float>(vertex[k]);
  rtcUpdateGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(geometry);
}

void RayScene::commit() {
  rtcCommitScene(tree_->scene);
}

RayHit RayScene::first_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const {
  RTCRayHit query{};
  query.ray = make_ray(origin, direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(tree_->scene, &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(tree_->scene, &context, &query);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.geomID), static_cast<int>(query.hit.primID), query.hit.u, query.hit.v,
          query.ray.tfar};
}

bool RayScene::blocked(const Eigen::Vector3f& from, const Eigen::Vector3f& to) const {
  RTCRay ray = make_ray(from, to - from, 1);
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(tree_->scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(tree_->scene, &context, &ray);
#endif
  return ray.tfar < 0;
}

}  // namespace palpate
