#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Bytes of one number of a VTK type, by its names in both of VTK's formats ("float", "Float32", "vtktypeint64"); 0
/// where there is none.
size_t size_of_vtk_type(const std::string& type);

/// An array in binary, in either byte order; throws BadInput where the type is not known.
std::vector<double> vtk_numbers(std::string_view bytes, const std::string& type, bool big_endian);

}  // namespace palpate
