#include <fmt/format.h>

#include "app/verbs.h"

namespace palpate::app {

void add_later_verbs(CLI::App& app) {
  for (const char* name : {"study", "console"}) {
    CLI::App* verb = app.add_subcommand(name, "not there yet");
    verb->allow_extras();
    verb->footer(fmt::format("Example: palpate {} is not there yet", name));
    verb->callback([name] {
      fmt::print(stderr, "palpate {}: this verb is not there yet\n", name);
      throw CLI::RuntimeError(kWrongUse);
    });
  }
}

}  // namespace palpate::app
