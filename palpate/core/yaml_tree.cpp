#include "palpate/core/yaml_tree.h"

#include <yaml-cpp/yaml.h>

namespace palpate {

namespace {

constexpr int kDeepest = 100;
constexpr int kMaxNodes = 1000000;

void count(const YAML::Node& node, int depth, int& nodes) {
  if (depth > kDeepest || ++nodes > kMaxNodes)
    throw YAML::ParserException(node.Mark(), "it is nested too deeply, or its aliases multiply");
  if (node.IsSequence())
    for (const YAML::Node& item : node) count(item, depth + 1, nodes);
  if (node.IsMap())
    for (const auto& entry : node) {
      count(entry.first, depth + 1, nodes);
      count(entry.second, depth + 1, nodes);
    }
}

}  // namespace

void require_tree(const YAML::Node& document) {
  int nodes = 0;
  count(document, 0, nodes);
}

}  // namespace palpate
