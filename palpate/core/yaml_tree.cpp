#include "palpate/core/yaml_tree.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

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

/// Where the documents of a stream begin.
class DocumentStarts : public YAML::EventHandler {
 public:
  YAML::Mark last = YAML::Mark::null_mark();

  void OnDocumentStart(const YAML::Mark& mark) override { last = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

void require_end(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts starts;
  for (int previous = -1; parser.HandleNextDocument(starts); previous = starts.last.pos)
    if (starts.last.pos <= previous)
      throw YAML::ParserException(starts.last,
                                  "the document ends here; what follows begins none (a bracket too many?)");
}

/// Where a value in quotes begins, its line after the first quote holds the second; '' and \" are none.
bool closes(const std::string& line, size_t at) {
  const char quote = line[at];
  for (size_t i = at + 1; i < line.size(); ++i) {
    if (line[i] == quote && quote == '\'' && i + 1 < line.size() && line[i + 1] == quote)
      ++i;
    else if (line[i] == quote)
      return true;
    else if (line[i] == '\\' && quote == '"')
      ++i;
  }
  return false;
}

void require_closed_quotes(const std::vector<std::string>& lines, const YAML::Node& node) {
  if (node.IsSequence())
    for (const YAML::Node& item : node) require_closed_quotes(lines, item);
  if (node.IsMap())
    for (const auto& entry : node) {
      require_closed_quotes(lines, entry.first);
      require_closed_quotes(lines, entry.second);
    }
  const YAML::Mark mark = node.Mark();
  const auto row = static_cast<size_t>(mark.line), column = static_cast<size_t>(mark.column);
  if (!node.IsScalar() || mark.is_null() || row >= lines.size() || column >= lines[row].size()) return;
  const char first = lines[row][column];
  if ((first == '\'' || first == '"') && !closes(lines[row], column))
    throw YAML::ParserException(mark, "a quote is opened and not closed in this line");
}

}  // namespace

void require_closed_quotes(const std::string& text, const YAML::Node& document) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  require_closed_quotes(lines, document);
}

void require_tree(const YAML::Node& document) {
  int nodes = 0;
  count(document, 0, nodes);
}

std::vector<YAML::Node> load_documents(const std::string& text) {
  require_end(text);
  std::vector<YAML::Node> documents = YAML::LoadAll(text);
  for (const YAML::Node& document : documents) require_tree(document);
  return documents;
}

}  // namespace palpate
