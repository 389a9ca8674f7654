#include <pybind11/stl.h>

#include "palpate/core/errors.h"
#include "palpate/estimate/tissue_map.h"
#include "python/bindings/arrays.h"
#include "python/bindings/parts.h"

namespace palpate::python {

namespace {

Surface make_surface(const py::array& vertices_mm, const py::array& triangles) {
  Surface surface{points_of(vertices_mm, "vertices_mm"), {}};
  for (const auto& row : indices_of(triangles, "triangles", 3, surface.vertices_mm.size()))
    surface.triangles.push_back({row[0], row[1], row[2]});
  return surface;
}

TetMesh make_mesh(const py::array& nodes_mm, const py::array& tetrahedra) {
  TetMesh mesh{points_of(nodes_mm, "nodes_mm"), {}, {}};
  for (const auto& row : indices_of(tetrahedra, "tetrahedra", 4, mesh.nodes_mm.size())) {
    mesh.tetrahedra.push_back({row[0], row[1], row[2], row[3]});
    const auto node = [&](size_t corner) { return mesh.nodes_mm[static_cast<size_t>(row[corner])]; };
    if (signed_volume_mm3(node(0), node(1), node(2), node(3)) <= 0)
      throw BadInput("tetrahedra: row " + std::to_string(mesh.tetrahedra.size() - 1) + " has no positive volume");
  }
  mesh.label.assign(mesh.tetrahedra.size(), 0);
  return mesh;
}

}  // namespace

void add_tissue_map(py::module_& module) {
  py::class_<PointCloud>(module, "PointCloud", "Points of the tissue surface as measured, S of the paper.")
      .def_property_readonly("position_mm", array_of(&PointCloud::position_mm), "(n, 3), mm")
      .def_property_readonly("depth_deviation_mm", array_of(&PointCloud::depth_deviation_mm),
                             "(n,), one standard deviation along the viewing ray, mm")
      .def_property_readonly("correlation", array_of(&PointCloud::correlation), "(n,), -1 to 1")
      .def_property_readonly("colour", array_of(&PointCloud::colour), "(n, 3) uint8, BGR");

  py::class_<Surface>(module, "Surface", "A triangle mesh; seen from outside, triangles run counter-clockwise.")
      .def(py::init(&make_surface), py::arg("vertices_mm"), py::arg("triangles"),
           "From arrays (n, 3) in mm and (m, 3) of vertex numbers; they are copied. Raises BadInput.")
      .def_property_readonly("vertices_mm", array_of(&Surface::vertices_mm), "(n, 3), mm")
      .def_property_readonly("triangles", array_of(&Surface::triangles), "(m, 3), numbers of vertices");

  py::class_<TetMesh>(module, "TetMesh", "Linear tetrahedra with positive volume, V of the paper.")
      .def(py::init(&make_mesh), py::arg("nodes_mm"), py::arg("tetrahedra"),
           "From arrays (n, 3) in mm and (m, 4) of node numbers; they are copied. Raises BadInput.")
      .def_property_readonly("nodes_mm", array_of(&TetMesh::nodes_mm), "(n, 3), mm")
      .def_property_readonly("tetrahedra", array_of(&TetMesh::tetrahedra), "(m, 4), numbers of nodes")
      .def_property_readonly("label", array_of(&TetMesh::label), "(m,), tissue of each; 0 where there is one only");

  py::class_<MapReport>(module, "MapReport", "What the build stage took and left.")
      .def_readonly("matched_points", &MapReport::matched_points, "points found in both images")
      .def_readonly("coverage", &MapReport::coverage, "ratio of the organ region with a measured disparity, 0 to 1")
      .def_readonly("median_depth_deviation_mm", &MapReport::median_depth_deviation_mm, "mm");

  py::class_<TissueMap>(module, "TissueMap", "The biomechanical map, and what was seen on the way to it.")
      .def_readonly("cloud", &TissueMap::cloud, "S")
      .def_readonly("surface", &TissueMap::surface, "S*")
      .def_readonly("mesh", &TissueMap::mesh, "V")
      .def_property_readonly("fixed_nodes", array_of(&TissueMap::fixed_nodes), "(k,), numbers of nodes that are held")
      .def_property_readonly("organ_mask", array_of(&TissueMap::organ_mask),
                             "(height, width) uint8 of the rectified left image, 255 = organ region")
      .def_readonly("tissue", &TissueMap::tissue, "gamma")
      .def_readonly("frame", &TissueMap::frame, "the static frame")
      .def_readonly("report", &TissueMap::report);

  const char* doc =
      "The build stage, Eq. 1 of the paper: from a frame with the tissue at rest, or from a list of such frames. "
      "Raises BadInput where a stage cannot go on.";
  module.def("build_tissue_map",
             py::overload_cast<const StereoFrame&, const Rectification&, const MapOptions&, const TissueOptions&,
                               const AttachmentOptions&>(&build_tissue_map),
             py::arg("frame"), py::arg("rectification"), py::arg("options"), py::arg("tissue"), py::arg("attachments"),
             py::call_guard<py::gil_scoped_release>(), doc);
  module.def("build_tissue_map",
             py::overload_cast<const std::vector<StereoFrame>&, const Rectification&, const MapOptions&,
                               const TissueOptions&, const AttachmentOptions&>(&build_tissue_map),
             py::arg("frame"), py::arg("rectification"), py::arg("options"), py::arg("tissue"), py::arg("attachments"),
             py::call_guard<py::gil_scoped_release>(), doc);
  module.def(
      "tetrahedralize", [](const Surface& closed_body, int elements) { return tetrahedralize(closed_body, elements); },
      py::arg("closed_body"), py::arg("elements"), py::call_guard<py::gil_scoped_release>(),
      "The inside of a closed surface filled with tetrahedra, within 10 % of `elements`. Raises BadInput.");
}

}  // namespace palpate::python
