#include "tests/app/program.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdlib>

namespace palpate::test {

Outcome run(const std::string& program, const std::string& arguments) {
  const Workspace workspace;
  const std::string command = fmt::format("{} {} > {} 2> {}", program, arguments, (workspace / "output").string(),
                                          (workspace / "error").string());
  Outcome outcome;
  const int status = std::system(command.c_str());
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  outcome.output = read_file(workspace / "output");
  outcome.error = read_file(workspace / "error");
  return outcome;
}

Outcome run_palpate(const std::string& arguments) {
  return run(PALPATE_PROGRAM, arguments);
}

}  // namespace palpate::test
