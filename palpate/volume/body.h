#pragma once

#include <filesystem>

#include "palpate/core/geometry.h"
#include "palpate/core/settings.h"

namespace palpate {

enum class LengthUnit { mm, m };

/// The closed surface between S* and S* pushed back by `thickness_mm` along the optical axis (+z), closed at the rims;
/// oriented outwards, every edge used once in each direction. The body is where its winding number is positive, which
/// is how `tetrahedralize` reads it: where viewing rays diverge so much that S* is no height field over (x, y), the
/// front keeps the shape seen and what would reach out before it counts as outside. Throws BadInput when there is no
/// surface or nothing of it faces the camera.
Surface close_body(const Surface& visible, double thickness_mm);

/// A closed surface or a volume from a scan, in the left camera frame: .msh (Gmsh) .vtk .vtu .vtp .obj .ply .stl as
/// docs/inputs.md says; of a volume its boundary is taken. Corners nearer than three millionths of its extent are
/// one. Oriented outwards (cavities, if the file orients them, stay cavities). Throws BadInput: unreadable, empty, open
/// surface (with the number of its holes).
Surface read_body(const std::filesystem::path& file, LengthUnit unit);

}  // namespace palpate
