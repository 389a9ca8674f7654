#pragma once

#include <string>
#include <vector>

#include "palpate/stereo/recording.h"

namespace palpate {

/// Decodes every picture of the files of a recording that opens, for `patience_s` at most: sentences on those that are
/// damaged, and on how far it came. Throws Unfinished where a run would end early: a file that is cut, an image that
/// does not open.
std::vector<std::string> read_through(const RecordingOptions& options, double patience_s);

}  // namespace palpate
