#include "palpate/simulate/ray_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <tbb/task_arena.h>

#include <limits>
#include <stdexcept>

namespace palpate {
namespace {

template <class Rays>
void set_ray(Rays& rays, size_t i, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float end) {
  rays.org_x[i] = origin.x();
  rays.org_y[i] = origin.y();
  rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x();
  rays.dir_y[i] = direction.y();
  rays.dir_z[i] = direction.z();
  rays.tfar[i] = end;
  rays.mask[i] = ~0u;
}

}  // namespace

struct RayScene::Tree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<RTCGeometry> geometries;

  Tree() {
    // Not "threads=1": with it Embree would hold every other parallel loop of the process to one thread, too.
    device = rtcNewDevice(nullptr);
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
  // Built by one thread: the tree must not depend on how many there are.
  tbb::task_arena(1).execute([this] { rtcJoinCommitScene(tree_->scene); });
}

RayHit RayScene::first_hit(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const {
  Bundle<Eigen::Vector3f> directions;
  directions.fill(direction);
  Bundle<RayHit> hits;
  first_hits(origin, directions, hits);
  return hits[0];
}

void RayScene::first_hits(const Eigen::Vector3f& origin, const Bundle<Eigen::Vector3f>& directions,
                          Bundle<RayHit>& hits) const {
  alignas(64) int all[kBundle];
  alignas(64) RTCRayHit16 query{};
  for (size_t i = 0; i < kBundle; ++i) {
    all[i] = -1;
    set_ray(query.ray, i, origin, directions[i], std::numeric_limits<float>::infinity());
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(all, tree_->scene, &query, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(all, tree_->scene, &context, &query);
#endif
  for (size_t i = 0; i < kBundle; ++i) {
    if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID)
      hits[i] = {};
    else
      hits[i] = {static_cast<int>(query.hit.geomID[i]), static_cast<int>(query.hit.primID[i]), query.hit.u[i],
                 query.hit.v[i], query.ray.tfar[i]};
  }
}

Bundle<bool> RayScene::blocked(const Bundle<bool>& wanted, const Bundle<Eigen::Vector3f>& from,
                               const Bundle<Eigen::Vector3f>& to) const {
  alignas(64) int valid[kBundle];
  alignas(64) RTCRay16 rays{};
  for (size_t i = 0; i < kBundle; ++i) {
    valid[i] = wanted[i] ? -1 : 0;
    set_ray(rays, i, from[i], to[i] - from[i], 1);
  }
#if RTC_VERSION_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid, tree_->scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, tree_->scene, &context, &rays);
#endif
  Bundle<bool> answer;
  for (size_t i = 0; i < kBundle; ++i) answer[i] = wanted[i] && rays.tfar[i] < 0;
  return answer;
}

}  // namespace palpate
