#pragma once

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <vector>

#include "palpate/feedback/forces_file.h"

namespace palpate {

/// The rows of a run so far, written by one thread and read by others, each from where it is.
class RowLog {
 public:
  void add(ForceRow row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
  }
  std::vector<ForceRow> from(size_t first, size_t max) const {
    const std::lock_guard lock(mutex_);
    first = std::min(first, rows_.size());
    const size_t last = first + std::min(max, rows_.size() - first);
    return {rows_.begin() + static_cast<std::ptrdiff_t>(first), rows_.begin() + static_cast<std::ptrdiff_t>(last)};
  }
  size_t size() const {
    const std::lock_guard lock(mutex_);
    return rows_.size();
  }

 private:
  mutable std::mutex mutex_;
  std::vector<ForceRow> rows_;
};

}  // namespace palpate
