#define CGAL_EIGEN3_ENABLED 1
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include "palpate/surface/manifold.h"

namespace palpate {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Halfedge = Mesh::Halfedge_index;

double rim_length(const Mesh& mesh, Halfedge start) {
  double length = 0;
  for (Halfedge h : CGAL::halfedges_around_face(start, mesh))
    length += std::sqrt(CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h))));
  return length;
}

/// Whether something else shows in a hole: on a third of the ways across it.
bool is_window(const Mesh& mesh, Halfedge start, const DepthEdges& edges) {
  std::vector<Vec3> rim;
  for (Halfedge h : CGAL::halfedges_around_face(start, mesh)) {
    const auto& p = mesh.point(mesh.target(h));
    rim.emplace_back(p.x(), p.y(), p.z());
  }
  const size_t half = rim.size() / 2;
  size_t behind = 0;
  for (size_t i = 0; i < half; ++i) behind += shows_another_depth(edges, rim[i], rim[i + half]);
  return 3 * behind > half;
}

}  // namespace

Surface close_holes(const Surface& surface, double longest_rim_mm, const DepthEdges* edges) {
  Mesh mesh;
  for (const Vec3& p : surface.vertices_mm) mesh.add_vertex({p.x(), p.y(), p.z()});
  for (const Triangle& t : surface.triangles)
    mesh.add_face(Mesh::Vertex_index(static_cast<unsigned>(t[0])), Mesh::Vertex_index(static_cast<unsigned>(t[1])),
                  Mesh::Vertex_index(static_cast<unsigned>(t[2])));
  std::vector<Halfedge> rims;
  PMP::extract_boundary_cycles(mesh, std::back_inserter(rims));
  std::vector<double> lengths;
  for (Halfedge rim : rims) lengths.push_back(rim_length(mesh, rim));
  const auto outer = std::max_element(lengths.begin(), lengths.end()) - lengths.begin();
  for (size_t i = 0; i < rims.size(); ++i) {
    if (static_cast<std::ptrdiff_t>(i) == outer || lengths[i] > longest_rim_mm) continue;
    if (edges && is_window(mesh, rims[i], *edges)) continue;
    std::vector<Mesh::Face_index> faces;
    std::vector<Mesh::Vertex_index> inner;
    PMP::triangulate_refine_and_fair_hole(mesh, rims[i], std::back_inserter(faces), std::back_inserter(inner));
  }
  Surface closed;
  for (Mesh::Vertex_index v : mesh.vertices())
    closed.vertices_mm.emplace_back(mesh.point(v).x(), mesh.point(v).y(), mesh.point(v).z());
  for (Mesh::Face_index f : mesh.faces()) {
    Triangle triangle{};
    size_t k = 0;
    for (Mesh::Vertex_index v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) triangle[k++] = static_cast<int>(v);
    closed.triangles.push_back(triangle);
  }
  return without_unused_vertices(closed);
}

}  // namespace palpate
