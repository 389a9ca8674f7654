#pragma once

#include <string>

namespace palpate {

/// S* against closed forms: distance, angle of the normals and topology of ours and of CGAL's ways on the same noisy
/// points, as a Markdown table.
std::string surface_accuracy_table();

/// Milliseconds of clean_points and cocone.
std::string surface_time_table();

}  // namespace palpate
