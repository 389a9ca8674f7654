#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace palpate::test {

/// A program of somebody else's, built beside the tests; it is ended with this value.
class OtherProgram {
 public:
  /// Nothing where it was not built.
  static std::optional<OtherProgram> start(const std::string& name, const std::vector<std::string>& arguments);
  ~OtherProgram();
  OtherProgram(OtherProgram&& other) noexcept;

  /// What it has written so far, on both outputs.
  const std::string& output();
  /// Whether it writes this within ten seconds.
  bool soon_writes(const std::string& text);

 private:
  OtherProgram() = default;
  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
  std::string output_;
};

}  // namespace palpate::test
