#include <fmt/format.h>
#include <poll.h>

#include <memory>

#include "app/runtime.h"
#include "app/share_folder.h"
#include "app/verbs.h"
#include "palpate/console/console_server.h"

namespace palpate::app {

void add_console(CLI::App& app) {
  struct Arguments {
    std::filesystem::path scene, root;
    std::string bind;
    int port = 8090;
    bool live = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("console", "The operator's page in the browser: from a recording to a force");
  verb->add_option("scene", arguments->scene, "scene.yaml to open at the start")->type_name("SCENE");
  verb->add_option("--port", arguments->port, "port to listen on; 0 = any that is free")
      ->check(CLI::Range(0, 65535))
      ->type_name("NUMBER")
      ->capture_default_str();
  verb->add_option("--bind", arguments->bind,
                   "address to listen on instead of 127.0.0.1; viewers have to know the token that is printed then")
      ->type_name("ADDRESS");
  verb->add_option("--root", arguments->root,
                   "the only folder that the page may open and write below; as a rule that of the scene")
      ->type_name("FOLDER");
  verb->add_flag("--live", arguments->live,
                 "let the page open cameras, addresses and GStreamer pipelines, which can read and write anything");
  verb->footer("Example: palpate console demo/recording/scene.yaml");
  verb->callback([arguments] {
    std::filesystem::path root = arguments->root;
    if (root.empty() && !arguments->scene.empty()) root = std::filesystem::absolute(arguments->scene).parent_path();
    ConsoleOptions options;
    options.port = arguments->port;
    options.page = share_folder() / "console";
    options.may_open_live = arguments->live;
    options.asks_for_token = !arguments->bind.empty();
    if (options.asks_for_token) options.address = arguments->bind;
    ConsoleServer server(options, RootFolder(root));
    if (!arguments->scene.empty()) server.session().open_trusted(arguments->scene);
    const std::string host =
        options.address.find(':') == std::string::npos ? options.address : "[" + options.address + "]";
    fmt::print("console     http://{}:{}/{}\nfolder      {}\n", host, server.port(),
               server.token().empty() ? "" : "?token=" + server.token(), server.session().root().path().string());
    if (!server.has_page()) fmt::print(stderr, "note        the page is not built: ./dev console builds it\n");
    fmt::print("Ctrl-C ends it. Research software, not a medical device.\n");
    std::fflush(stdout);
    while (!interrupted()) poll(nullptr, 0, 200);
  });
}

}  // namespace palpate::app
