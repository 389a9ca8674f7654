#include "tests/stream/other_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <utility>

#include "tests/stream/samples.h"

namespace palpate::test {

std::optional<OtherProgram> OtherProgram::start(const std::string& name, const std::vector<std::string>& arguments) {
  const std::filesystem::path file = std::filesystem::path(PALPATE_OTHER_PROGRAMS) / name;
  if (!std::filesystem::exists(file)) return std::nullopt;
  int in[2], out[2];
  if (pipe(in) != 0 || pipe(out) != 0) return std::nullopt;
  OtherProgram program;
  program.process_ = fork();
  if (program.process_ == 0) {
    dup2(in[0], 0);
    dup2(out[1], 1);
    dup2(out[1], 2);
    for (int fd : {in[0], in[1], out[0], out[1]}) close(fd);
    std::vector<char*> words = {const_cast<char*>(file.c_str())};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    execv(file.c_str(), words.data());
    _exit(127);
  }
  close(in[0]);
  close(out[1]);
  program.to_ = in[1];
  program.from_ = out[0];
  fcntl(program.from_, F_SETFL, O_NONBLOCK);
  return program;
}

OtherProgram::OtherProgram(OtherProgram&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      to_(std::exchange(other.to_, -1)),
      from_(std::exchange(other.from_, -1)),
      output_(std::move(other.output_)) {}

OtherProgram::~OtherProgram() {
  if (process_ < 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  close(to_);
  close(from_);
}

const std::string& OtherProgram::output() {
  std::array<char, 4096> buffer;
  for (ssize_t count; (count = read(from_, buffer.data(), buffer.size())) > 0;)
    output_.append(buffer.data(), static_cast<size_t>(count));
  return output_;
}

bool OtherProgram::soon_writes(const std::string& text) {
  return soon([&] { return output().find(text) != std::string::npos; });
}

}  // namespace palpate::test
