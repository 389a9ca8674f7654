#pragma once

#include <string>
#include <vector>

#include "palpate/core/errors.h"

namespace palpate {

/// What could not be done, in sentences: work goes on without, and tells of it at its end.
class Losses {
 public:
  /// False where `work` throws Unfinished, whose sentence is kept.
  template <class Work>
  bool attempt(const Work& work) {
    try {
      work();
      return true;
    } catch (const Unfinished& reason) {
      add(reason.what());
      return false;
    }
  }
  void add(const std::string& sentence) { sentences_.push_back(sentence); }
  bool any() const { return !sentences_.empty(); }
  std::string text() const {
    std::string text;
    for (const std::string& sentence : sentences_) text += (text.empty() ? "" : "; ") + sentence;
    return text;
  }

 private:
  std::vector<std::string> sentences_;
};

}  // namespace palpate
