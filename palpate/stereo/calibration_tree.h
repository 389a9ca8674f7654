#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// One value of a calibration file, wherever in its tree it stands.
struct CalibrationEntry {
  std::string path;             ///< keys from the root, as the file spells them: "cam0.intrinsics", "cameras[1].K"
  std::string text;             ///< of a value that is no number
  std::vector<double> numbers;  ///< row by row
  int rows = 0;
  int cols = 0;
  bool is_spoiled = false;  ///< a list of numbers but for what `text` says
};

/// Every value of a YAML, XML, JSON, INI or plain text file: OpenCV's FileStorage in its three forms, what yaml and
/// json of Python write (nested lists), `key = value` under [sections], and lines of bare numbers, which are called
/// like the file. Matrices that are written as rows, cols and data become one value. Throws BadInput: the file cannot
/// be read, or is none of these; what MATLAB and NumPy write in binary is named.
std::vector<CalibrationEntry> read_calibration_tree(const std::filesystem::path& file);

/// The file holds bare numbers only, so that its name says what they are.
bool is_bare_numbers(const std::filesystem::path& file);

}  // namespace palpate
