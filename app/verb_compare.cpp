#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "app/answer.h"
#include "app/verbs.h"
#include "palpate/feedback/compare.h"

namespace palpate::app {

void add_compare(CLI::App& app) {
  struct Arguments {
    std::filesystem::path forces, truth;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("compare", "Figures of forces.csv (of any estimator) against truth.csv");
  verb->add_option("forces", arguments->forces, "forces.csv")->required()->type_name("FILE");
  verb->add_option("truth", arguments->truth, "truth.csv")->required()->type_name("FILE");
  verb->add_flag("--json", arguments->json, "figures as JSON");
  verb->footer("Example: palpate compare results/forces.csv truth.csv");
  verb->callback([arguments] {
    const Comparison comparison = compare(read_forces(arguments->forces), read_truth(arguments->truth));
    fmt::print(
        "{}", arguments->json ? json_success(nlohmann::ordered_json::parse(to_json(comparison))) : to_text(comparison));
  });
}

}  // namespace palpate::app
