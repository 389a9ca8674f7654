#pragma once

#include <chrono>
#include <string>

namespace palpate::app {

/// A line on a terminal that says how far the work is and how long it will take; silent when stderr is no terminal.
class Progress {
 public:
  Progress(std::string what, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(int done, int total, const std::string& remark = "");

 private:
  std::string what_;
  bool on_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace palpate::app
