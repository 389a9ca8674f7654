#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace palpate::test {

/// A folder of its own for one test, removed at the end.
class Workspace {
 public:
  Workspace();
  ~Workspace();
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  std::filesystem::path folder_;
};

/// A textured plane that leans away from a rectified pair of cameras: 320 x 240, focal 300 px, baseline 5 mm.
struct PlanePair {
  cv::Mat left, right;
};
PlanePair plane_pair(int frame);

/// left.avi, right.avi (`frames` each), calibration.yaml and scene.yaml in `folder`.
void write_plane_recording(const std::filesystem::path& folder, int frames);

void write_avi(const std::filesystem::path& file, const std::vector<cv::Mat>& frames);
void write_file(const std::filesystem::path& file, const std::string& text);
std::string read_file(const std::filesystem::path& file);
/// The file with one text replaced by another (which must stand in it).
void replace_in_file(const std::filesystem::path& file, const std::string& from, const std::string& to);

}  // namespace palpate::test
