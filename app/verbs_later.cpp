#include <fmt/format.h>

#include "app/verbs.h"

namespace palpate::app {

void add_later_verbs(CLI::App& app) {
  for (const char* name : {"console"}) {
    CLI::App* verb = app.add_subcommand(name, "not there yet");
    verb->allow_extras();
    verb->footer(fmt::format("Example: palpate {} is not there yet", name));
    verb->callback([name] { throw WrongUse(fmt::format("the verb {} is not there yet", name)); });
  }
}

}  // namespace palpate::app
