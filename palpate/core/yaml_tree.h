#pragma once

#include <string>
#include <vector>

namespace YAML {
class Node;
}

namespace palpate {

/// A YAML file may hold an alias within its own anchor, which has no end, or aliases that multiply to more than fits
/// into memory. Throws YAML::ParserException where the document is no tree of credible size.
void require_tree(const YAML::Node& document);

/// Every document of a stream, each a tree. Throws YAML::ParserException, also where a bracket is closed that was not
/// opened: yaml-cpp begins a new document there without end.
std::vector<YAML::Node> load_documents(const std::string& text);

/// Throws YAML::ParserException at a value in quotes that does not end in its line: yaml-cpp takes the lines after it
/// for part of the value, and where they are indented less, ends it without its quote. For files whose values are
/// words, numbers and paths.
void require_closed_quotes(const std::string& text, const YAML::Node& document);

}  // namespace palpate
