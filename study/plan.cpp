#include "study/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <set>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/core/yaml_tree.h"

namespace palpate::study {

namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const YAML::Node& at, const std::string& what) {
  throw BadInput(at.IsDefined() && at.Mark().line >= 0
                     ? fmt::format("{}:{}: {}", file.string(), at.Mark().line + 1, what)
                     : fmt::format("{}: {}", file.string(), what));
}

YAML::Node load(const std::filesystem::path& file) {
  try {
    YAML::Node node = YAML::LoadFile(file.string());
    if (!node.IsMap()) throw BadInput(file.string() + ": expected keys and values");
    require_tree(node);
    return node;
  } catch (const YAML::BadFile&) {
    throw BadInput(file.string() + ": cannot be opened");
  } catch (const YAML::ParserException& error) {
    throw BadInput(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
  }
}

template <class T>
T value_of(const std::filesystem::path& file, const YAML::Node& node, const std::string& key, const T& otherwise) {
  if (!node[key]) return otherwise;
  try {
    return node[key].as<T>();
  } catch (const YAML::Exception&) {
    fail(file, node[key], fmt::format("{} cannot be read as what it should be", key));
  }
}

std::string required(const std::filesystem::path& file, const YAML::Node& node, const std::string& key) {
  if (!node[key]) fail(file, node, key + " is missing");
  return value_of<std::string>(file, node, key, "");
}

std::vector<std::string> split(const std::string& dotted) {
  std::vector<std::string> names;
  std::istringstream stream(dotted);
  for (std::string name; std::getline(stream, name, '.');) names.push_back(name);
  return names;
}

YAML::Node with_key(const YAML::Node& node, const std::vector<std::string>& names, size_t depth,
                    const YAML::Node& value) {
  if (depth == names.size()) return YAML::Clone(value);
  YAML::Node changed = node && node.IsMap() ? YAML::Clone(node) : YAML::Node(YAML::NodeType::Map);
  const YAML::Node before = changed[names[depth]] ? YAML::Clone(changed[names[depth]]) : YAML::Node();
  changed[names[depth]] = with_key(before, names, depth + 1, value);
  return changed;
}

YAML::Node with_key(const YAML::Node& scene, const std::string& dotted, const YAML::Node& value) {
  return with_key(scene, split(dotted), 0, value);
}

std::optional<double> number_at(const YAML::Node& scene, const std::string& dotted) {
  YAML::Node node = YAML::Clone(scene);
  for (const std::string& name : split(dotted)) {
    if (!node.IsMap() || !node[name]) return std::nullopt;
    node.reset(node[name]);
  }
  double number = 0;
  return YAML::convert<double>::decode(node, number) ? std::optional(number) : std::nullopt;
}

constexpr int kMaxSteps = 1000;

std::vector<double> range_of(const std::filesystem::path& file, const YAML::Node& range, bool logarithmic) {
  const double from = value_of(file, range, "from", NAN), to = value_of(file, range, "to", NAN);
  const int steps = value_of(file, range, "steps", 0);
  if (!std::isfinite(from) || !std::isfinite(to) || steps < 2 || steps > kMaxSteps ||
      (logarithmic && (from <= 0 || to <= 0)))
    fail(file, range, "a range is {from: , to: , steps: 2 to 1000}, positive on a logarithmic axis");
  std::vector<double> values;
  for (int i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / (steps - 1);
    values.push_back(logarithmic ? from * std::pow(to / from, t) : from + t * (to - from));
  }
  return values;
}

Value number_value(double number) {
  YAML::Node node;
  // A whole number stays one: some keys are integers.
  if (number == std::round(number) && std::abs(number) < 1e9)
    node = static_cast<long>(number);
  else
    node = number;
  return {fmt::format("{:g}", number), node, number};
}

const std::set<std::string> kSweepKeys = {"key", "unit", "logarithmic", "uncertainty", "times", "range", "values"};

void reject_unknown(const std::filesystem::path& file, const YAML::Node& node, const std::set<std::string>& known,
                    const std::string& where) {
  for (const auto& entry : node)
    if (const auto key = entry.first.as<std::string>(); !known.contains(key))
      fail(file, entry.first, fmt::format("unknown key {} in {}", key, where));
}

void read_sweep(const Study& study, const YAML::Node& sweep, const YAML::Node& base, Experiment& experiment) {
  const auto& file = study.file;
  reject_unknown(file, sweep, kSweepKeys, "a sweep");
  experiment.key = required(file, sweep, "key");
  experiment.unit = value_of<std::string>(file, sweep, "unit", "");
  experiment.logarithmic = value_of(file, sweep, "logarithmic", false);
  experiment.known = number_at(base, experiment.key);
  if (sweep["uncertainty"]) {
    experiment.uncertainty = value_of(file, sweep, "uncertainty", 0.0);
    if (*experiment.uncertainty <= (experiment.logarithmic ? 1 : 0))
      fail(file, sweep["uncertainty"], "uncertainty is above 0, on a logarithmic axis a factor above 1");
  }
  if (sweep["times"]) {
    const auto unit = experiment.known;
    if (!unit) fail(file, sweep["times"], fmt::format("the scene gives no number for {}", experiment.key));
    std::vector<double> factors;
    if (sweep["times"].IsMap())
      factors = range_of(file, sweep["times"], experiment.logarithmic);
    else
      for (const YAML::Node& factor : sweep["times"]) factors.push_back(factor.as<double>());
    for (double factor : factors) experiment.values.push_back(number_value(*unit * factor));
  } else if (sweep["range"]) {
    for (double number : range_of(file, sweep["range"], experiment.logarithmic))
      experiment.values.push_back(number_value(number));
  } else if (sweep["values"] && sweep["values"].IsSequence()) {
    for (const YAML::Node& item : sweep["values"]) {
      Value value;
      value.value = item.IsMap() && item["value"] ? item["value"] : item;
      double number = 0;
      if (value.value.IsScalar() && YAML::convert<double>::decode(value.value, number)) value.number = number;
      value.label = item.IsMap() && item["name"] ? item["name"].as<std::string>()
                    : value.value.IsScalar()     ? value.value.as<std::string>()
                                                 : fmt::format("{}", experiment.values.size() + 1);
      experiment.values.push_back(value);
    }
  }
  if (experiment.values.empty()) fail(file, sweep, "a sweep needs values, times or a range");
}

void keep_evenly(std::vector<Value>& values, int count) {
  const auto all = static_cast<int>(values.size());
  if (count >= all) return;
  std::vector<Value> kept;
  for (int i = 0; i < count; ++i)
    kept.push_back(values[static_cast<size_t>(count == 1 ? 0 : i * (all - 1) / (count - 1))]);
  // Not copied: assigning to a YAML::Node changes every other that shares it.
  values = std::move(kept);
}

const std::set<std::string> kExperimentKeys = {"name", "title", "paper",    "says",  "why",   "scene",
                                               "set",  "sweep", "estimate", "goals", "quick", "expects_warning"};
/// Several scenes, one run each.
void read_scenes(const Study& study, const YAML::Node& scenes, Experiment& experiment) {
  experiment.key = "scene";
  for (const YAML::Node& scene : scenes) {
    const std::filesystem::path file = study.file.parent_path() / scene.as<std::string>();
    load(file);
    experiment.values.push_back({file.stem().string(), scene, std::nullopt});
  }
  if (experiment.values.empty()) fail(study.file, scenes, "scene names no file");
}

Experiment read_experiment(const Study& study, const YAML::Node& node) {
  const auto& file = study.file;
  if (!node.IsMap()) fail(file, node, "an experiment has keys: name, title, scene, ...");
  reject_unknown(file, node, kExperimentKeys, "an experiment");
  Experiment experiment;
  experiment.name = required(file, node, "name");
  experiment.title = value_of(file, node, "title", experiment.name);
  experiment.paper = value_of<std::string>(file, node, "paper", "");
  experiment.says = value_of<std::string>(file, node, "says", "");
  experiment.why = value_of<std::string>(file, node, "why", "");
  if (node["scene"] && node["scene"].IsSequence()) {
    if (node["sweep"]) fail(file, node["sweep"], "a sweep needs one scene, not a list");
    read_scenes(study, node["scene"], experiment);
  } else {
    experiment.scene = file.parent_path() / required(file, node, "scene");
  }
  if (node["set"]) experiment.set = node["set"];
  if (node["estimate"]) experiment.estimate = node["estimate"];
  experiment.goals = value_of(file, node, "goals", experiment.goals);
  if (node["expects_warning"]) experiment.expects_warning = required(file, node, "expects_warning");
  if (node["sweep"]) read_sweep(study, node["sweep"], load(experiment.scene), experiment);
  return experiment;
}

/// FNV-1a, so that the name of a sequence says what it was made from.
std::string fingerprint(const std::string& text) {
  uint64_t hash = 14695981039346656037U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return fmt::format("{:08x}", static_cast<uint32_t>(hash ^ (hash >> 32)));
}

/// A label as the name of a folder.
std::string as_folder(std::string label) {
  for (char& c : label)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-' && c != '_') c = '_';
  return label;
}

/// The keys that decide what a sequence shows; the others are the estimate's.
YAML::Node of_sequence(const YAML::Node& scene) {
  YAML::Node kept(YAML::NodeType::Map);
  for (const char* key : {"simulate", "tissue", "attachments", "contact"})
    if (scene[key]) kept[key] = scene[key];
  return kept;
}

void add_run(const Study& study, const Experiment& experiment, const Value* value, Plan& plan) {
  const bool is_scene = experiment.key == "scene";
  const std::filesystem::path file =
      is_scene ? study.file.parent_path() / value->value.as<std::string>() : experiment.scene;
  YAML::Node scene = load(file);
  const bool simulated = static_cast<bool>(scene["simulate"]);
  YAML::Node told(YAML::NodeType::Map);
  const auto tell = [&told](const std::string& key, const YAML::Node& to) {
    if (!key.starts_with("simulate.")) told = with_key(told, key, to);
  };
  if (!simulated) told = scene;
  if (simulated && scene["map"]) told["map"] = scene["map"];
  for (const auto& entry : experiment.set) {
    scene = with_key(scene, entry.first.as<std::string>(), entry.second);
    tell(entry.first.as<std::string>(), entry.second);
  }
  for (const auto& entry : experiment.estimate) tell(entry.first.as<std::string>(), entry.second);
  if (value && !is_scene) {
    if (experiment.key.starts_with("simulate.")) scene = with_key(scene, experiment.key, value->value);
    tell(experiment.key, value->value);
  }
  Run run{experiment.name + "/" + (value ? as_folder(value->label) : "run"), &experiment, value, file, "", told};
  if (simulated) {
    const YAML::Node sequence = of_sequence(scene);
    run.sequence = file.stem().string() + "-" + fingerprint(YAML::Dump(sequence));
    if (std::none_of(plan.sequences.begin(), plan.sequences.end(),
                     [&run](const Sequence& known) { return known.name == run.sequence; }))
      plan.sequences.push_back({run.sequence, sequence});
  }
  plan.runs.push_back(run);
}

}  // namespace

namespace {

Study study_of(const std::filesystem::path& file, const YAML::Node& node, bool quick) {
  Study study;
  study.file = file;
  study.title = value_of(file, node, "title", file.stem().string());
  study.about = value_of<std::string>(file, node, "about", "");
  for (const auto& entry : node)
    if (const auto key = entry.first.as<std::string>(); key != "title" && key != "about" && key != "experiments")
      fail(file, entry.first, fmt::format("unknown key {}, expected title, about or experiments", key));
  if (!node["experiments"] || !node["experiments"].IsSequence() || node["experiments"].size() == 0)
    fail(file, node, "experiments is missing (a list)");
  std::set<std::string> names;
  for (const YAML::Node& item : node["experiments"]) {
    Experiment experiment = read_experiment(study, item);
    if (!names.insert(experiment.name).second)
      fail(file, item, fmt::format("two experiments have the name {}", experiment.name));
    if (quick && item["quick"]) {
      const int count = value_of(file, item, "quick", 1);
      if (count <= 0) continue;
      keep_evenly(experiment.values, count);
    }
    study.experiments.push_back(experiment);
  }
  return study;
}

}  // namespace

Study read_study(const std::filesystem::path& file, bool quick) {
  const YAML::Node node = load(file);
  try {
    return study_of(file, node, quick);
  } catch (const YAML::Exception& error) {  // a list where a word is expected, and the like
    throw BadInput(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
  }
}

Plan plan_of(const Study& study) {
  Plan plan;
  for (const Experiment& experiment : study.experiments) {
    if (experiment.values.empty()) add_run(study, experiment, nullptr, plan);
    for (const Value& value : experiment.values) add_run(study, experiment, &value, plan);
  }
  return plan;
}

}  // namespace palpate::study
