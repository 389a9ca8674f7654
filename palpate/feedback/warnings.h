#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "palpate/feedback/forces_file.h"

namespace palpate {

/// Every warning that a row of forces.csv can carry: its name there, and what a person reads.
const std::vector<std::pair<std::string, std::string>>& known_warnings();

/// What a person reads; a name that is not known stands for itself.
std::string warning_words(const std::string& name);

/// How many frames carry each warning.
std::map<std::string, int> count_warnings(const std::vector<ForceRow>& rows);

}  // namespace palpate
