#pragma once

#include <filesystem>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

enum class LengthUnit { mm, m };

/// The closed surface between S* and S* pushed back by `thickness_mm` along the optical axis (+z), closed at the rim;
/// oriented outwards, edge-manifold, free of self-intersections. Throws BadInput when the surface cannot be closed.
Surface close_body(const Surface& visible, double thickness_mm);

/// A closed surface or a volume from a scan, in the left camera frame: .msh (Gmsh 2.2 / 4.1 ASCII) .vtk .vtu .obj .ply
/// .stl; of a volume its boundary is taken. Oriented outwards. Throws BadInput: unreadable, empty, open surface.
Surface read_body(const std::filesystem::path& file, LengthUnit unit);

}  // namespace palpate
