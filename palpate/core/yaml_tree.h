#pragma once

namespace YAML {
class Node;
}

namespace palpate {

/// A YAML file may hold an alias within its own anchor, which has no end, or aliases that multiply to more than fits
/// into memory. Throws YAML::ParserException where the document is no tree of credible size.
void require_tree(const YAML::Node& document);

}  // namespace palpate
