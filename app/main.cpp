#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <string>

#include "app/answer.h"
#include "app/document_inputs.h"
#include "app/runtime.h"
#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/session/scene_file.h"

namespace {

/// One sentence on standard error; with --json also one object on standard output.
int fail(std::string sentence, int exit_code, bool json) {
  for (char& c : sentence)  // what a file says may stand in it
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  fmt::print(stderr, "palpate: {}\n", sentence);
  if (json) fmt::print("{}", palpate::app::json_failure(sentence, exit_code));
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace palpate;
  const bool json = std::find(argv, argv + argc, std::string("--json")) != argv + argc;
  app::choose_blas_core(argv);
  app::watch_for_interrupt();

  CLI::App program(
      "Palpate: feel what the endoscope sees. Force between instrument and tissue from stereo video.\n"
      "Research software, not a medical device.",
      "palpate");
  program.set_version_flag("--version", PALPATE_VERSION);
  program.set_help_all_flag("--help-all", "every verb in full");
  program.require_subcommand(0, 1);
  program.footer(
      "Exit codes: 0 done, 2 wrong use, 3 bad input, 4 could not finish (what was done is kept), 1 our bug.\n"
      "Example: palpate demo -o demo");
  bool document_scene = false, document_inputs = false;
  program.add_flag("--document-scene", document_scene, "print every key of scene.yaml as a Markdown table");
  program.add_flag("--document-inputs", document_inputs, "print what is read, and from which tool, as docs/inputs.md");
  app::add_demo(program);
  app::add_simulate(program);
  app::add_map(program);
  app::add_estimate(program);
  app::add_compare(program);
  app::add_check(program);
  app::add_modulus(program);
  app::add_study(program);
  app::add_console(program);
  app::add_benchmark(program);

  try {
    program.parse(argc, argv);
    if (document_scene) {
      fmt::print("{}", document_scene_file());
    } else if (document_inputs) {
      fmt::print("{}", app::document_inputs());
    } else if (program.get_subcommands().empty()) {
      fmt::print(stderr, "{}", program.help());
      return app::kWrongUse;
    }
    return app::kDone;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);
    return fail(std::string(error.what()) + " (palpate --help tells more)", app::kWrongUse, json);
  } catch (const app::WrongUse& error) {
    return fail(error.what(), app::kWrongUse, json);
  } catch (const BadInput& error) {
    return fail(error.what(), app::kBadInput, json);
  } catch (const Unfinished& error) {
    return fail(error.what(), app::kNotFinished, json);
  } catch (const std::exception& error) {
    return fail(std::string("internal error, please report it: ") + error.what(), app::kOurBug, json);
  }
}
