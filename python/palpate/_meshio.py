"""Meshes to and from meshio, which is imported only here."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate._core import BadInput, ForceEstimate, Surface, TetMesh, TissueMap


def to_meshio(mesh: TissueMap | TetMesh | Surface | ForceEstimate) -> Any:
    """A meshio.Mesh in mm: of a map with its tissue labels and fixed nodes, of an estimate the deformed surface with its
    von Mises stress in kPa."""
    import meshio  # type: ignore[import]

    if isinstance(mesh, ForceEstimate):
        cells = [("triangle", mesh.boundary)]
        return meshio.Mesh(mesh.deformed_nodes_mm, cells, point_data={"von_mises_kPa": mesh.node_von_mises_kPa})
    if isinstance(mesh, Surface):
        return meshio.Mesh(mesh.vertices_mm, [("triangle", mesh.triangles)])
    tetrahedra = mesh.mesh if isinstance(mesh, TissueMap) else mesh
    made = meshio.Mesh(tetrahedra.nodes_mm, [("tetra", tetrahedra.tetrahedra)], cell_data={"label": [tetrahedra.label]})
    if isinstance(mesh, TissueMap):
        fixed = np.zeros(len(tetrahedra.nodes_mm), dtype=np.int32)
        fixed[mesh.fixed_nodes] = 1
        made.point_data["fixed"] = fixed
    return made


def from_meshio(mesh: Any) -> TetMesh | Surface:
    """A TetMesh of the tetrahedra of a meshio.Mesh in mm, or, where it has none, a Surface of its triangles. Raises
    BadInput where it has neither."""
    cells = mesh.cells_dict
    if "tetra" in cells:
        return TetMesh(mesh.points, cells["tetra"])
    if "triangle" in cells:
        return Surface(mesh.points, cells["triangle"])
    raise BadInput(f"the mesh has neither tetrahedra nor triangles, but {', '.join(cells) or 'no cells'}")
