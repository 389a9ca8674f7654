#include "app/share_folder.h"

namespace palpate::app {

std::filesystem::path share_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "share/palpate";
}

}  // namespace palpate::app
