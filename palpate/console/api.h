#pragma once

#include <map>
#include <string>

#include "palpate/session/root_folder.h"
#include "palpate/session/snapshot.h"

namespace palpate {

/// An answer over HTTP.
struct Answer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string bytes;
  bool may_be_kept = false;  ///< the same question has the same answer
};

using Query = std::map<std::string, std::string>;

/// "/api/thumbnail?file=a%20b" -> path and query, percent signs resolved.
struct Target {
  std::string path;
  Query query;
};
Target parse_target(const std::string& target);

/// Answers what stands below /api/: keys, files, pictures, shapes and finished runs. It reads files and may take a
/// while. Never throws: what is wrong is a status with a sentence.
Answer answer_api(const Target& target, const Snapshot& snapshot, const RootFolder& root);

}  // namespace palpate
