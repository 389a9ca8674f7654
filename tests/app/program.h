#pragma once

#include <string>

#include "tests/support/plane_recording.h"

namespace palpate::test {

struct Outcome {
  int exit_code = -1;
  std::string output;  ///< standard output
  std::string error;   ///< standard error
};

/// Runs a program with these arguments (a shell line).
Outcome run(const std::string& program, const std::string& arguments);
Outcome run_palpate(const std::string& arguments);

}  // namespace palpate::test
