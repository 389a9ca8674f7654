#include "app/study_jobs.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <map>
#include <thread>

#include "app/runtime.h"
#include "palpate/core/errors.h"

namespace palpate::app {

namespace {

/// For exec; lives as long as `words`.
std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

pid_t start(const StudyJob& job) {
  std::filesystem::create_directories(job.log.parent_path());
  std::vector<std::string> words = {"palpate"};
  words.insert(words.end(), job.arguments.begin(), job.arguments.end());
  const std::vector<char*> arguments = pointers_to(words);
  const std::string log = job.log.string();
  const pid_t process = fork();
  if (process != 0) return process;
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file >= 0) {
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
  }
  execv("/proc/self/exe", arguments.data());
  _exit(127);
}

}  // namespace

void run_jobs(const std::vector<StudyJob>& jobs, int at_once, const std::function<void(const StudyJob&, int)>& ended) {
  std::map<pid_t, const StudyJob*> running;
  auto next = jobs.begin();
  while (next != jobs.end() || !running.empty()) {
    while (next != jobs.end() && static_cast<int>(running.size()) < at_once) {
      const pid_t process = start(*next);
      if (process < 0) throw Unfinished("no process can be started for " + next->name);
      running[process] = &*next++;
    }
    int status = 0;
    const pid_t process = waitpid(-1, &status, WNOHANG);
    if (process > 0 && running.contains(process)) {
      ended(*running.at(process), WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
      running.erase(process);
    } else if (interrupted()) {
      for (const auto& [child, job] : running) kill(child, SIGINT);
      for (const auto& [child, job] : running) waitpid(child, &status, 0);
      throw Unfinished("interrupted; the same command goes on with what is left");
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
}

bool run_program(const std::vector<std::string>& words, const std::filesystem::path& folder) {
  std::vector<std::string> copies = words;
  const std::vector<char*> arguments = pointers_to(copies);
  const pid_t process = fork();
  if (process == 0) {
    if (chdir(folder.c_str()) == 0) execvp(arguments[0], arguments.data());
    _exit(127);
  }
  int status = 0;
  return process > 0 && waitpid(process, &status, 0) == process && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace palpate::app
