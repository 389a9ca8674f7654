#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/session/scene_file.h"

namespace palpate {

/// The folder that a session may read and write below.
class RootFolder {
 public:
  /// Throws BadInput where it is no folder.
  explicit RootFolder(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return folder_; }
  /// Links are followed.
  bool holds(const std::filesystem::path& file) const;
  /// The file that a path relative to the root means. Throws BadInput where that is outside.
  std::filesystem::path inside(const std::string& relative) const;
  /// Relative to the root, for people.
  std::string name_of(const std::filesystem::path& file) const;

  /// Throws BadInput where the scene reads a file that is neither below the root nor among `trusted`, or, unless
  /// `may_open_live`, a device, a pipeline or an address that is not among `trusted`.
  void require_holds_all(const SceneFile& scene, const std::vector<std::string>& trusted, bool may_open_live) const;

 private:
  std::filesystem::path folder_;
};

/// Every file, device, pipeline and address that a scene reads.
std::vector<std::string> sources_of(const SceneFile& scene);

}  // namespace palpate
