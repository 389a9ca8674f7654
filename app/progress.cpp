#include "app/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace palpate::app {

namespace {
constexpr int kBarWidth = 30;
constexpr auto kBetweenDrawings = std::chrono::milliseconds(100);
}  // namespace

Progress::Progress(std::string what, bool quiet)
    : what_(std::move(what)), on_(!quiet && isatty(STDERR_FILENO)), start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\n", stderr);
}

void Progress::show(int done, int total, const std::string& remark) {
  const auto now = std::chrono::steady_clock::now();
  const bool last = done >= total && total > 0;
  if (!on_ || (drawn_ && !last && now - last_ < kBetweenDrawings)) return;
  last_ = now;
  drawn_ = true;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  std::string line;
  if (total > 0) {
    const int full = std::clamp(kBarWidth * done / total, 0, kBarWidth);
    const double left_s = done > 0 ? elapsed_s / done * (total - done) : 0;
    line = fmt::format("{:<10} [{:#<{}}{:.<{}}] {:>4}/{} {:>5.1f} s{} {}", what_, "", full, "", kBarWidth - full, done,
                       total, elapsed_s, last ? "" : fmt::format(", {:.0f} s left", left_s), remark);
  } else {
    line = fmt::format("{:<10} {:>5} {:>5.1f} s {}", what_, done, elapsed_s, remark);
  }
  fmt::print(stderr, "\r{}\033[K", line);
  std::fflush(stderr);
}

}  // namespace palpate::app
