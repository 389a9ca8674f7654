#include "palpate/console/console_server.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"
#include "tests/console/raw_client.h"
#include "tests/support/plane_recording.h"

namespace palpate::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// A console on a port of its own, with a page of one file and a recording of twelve frames below its root.
class AConsole : public testing::Test {
 protected:
  AConsole() {
    write_plane_recording(workspace_ / "in", 12);
    std::filesystem::create_directories(workspace_ / "page/assets");
    write_file(workspace_ / "page/index.html", "<!doctype html><title>Palpate</title>");
    write_file(workspace_ / "page/assets/a.js", "1;");
    write_file(workspace_ / "secret.yaml", "secret: 1\n");
    start(false);
  }
  void start(bool asks_for_token) {
    server_.reset();
    ConsoleOptions options;
    options.port = 0;
    options.page = workspace_ / "page";
    options.asks_for_token = asks_for_token;
    server_ = std::make_unique<ConsoleServer>(options, RootFolder(workspace_ / "in"));
    port_ = server_->port();
  }

  std::string own_host() const { return fmt::format("Host: 127.0.0.1:{}\r\n", port_); }

  /// What comes to a viewer until `wanted` holds for a message of JSON; empty where the console closes before.
  template <class Wanted>
  static json until(RawViewer& viewer, const Wanted& wanted) {
    while (const auto message = viewer.receive()) {
      if (message->opcode != 1) continue;
      const json parsed = json::parse(message->content);
      if (wanted(parsed)) return parsed;
    }
    return {};
  }
  static json reply_to(RawViewer& viewer, json message) {
    message["id"] = 7;
    viewer.send(message.dump());
    return until(viewer, [](const json& j) { return j.value("reply", 0) == 7; });
  }

  Workspace workspace_;
  std::unique_ptr<ConsoleServer> server_;
  int port_ = 0;
};

TEST_F(AConsole, ServesItsPageWithAStrictPolicy) {
  const std::string answer = get(port_, "/");
  EXPECT_EQ(status_of(answer), 200);
  EXPECT_THAT(answer, HasSubstr("<title>Palpate</title>"));
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self';"));
  EXPECT_THAT(answer, Not(HasSubstr("unsafe")));
  EXPECT_THAT(get(port_, "/assets/a.js"), HasSubstr("text/javascript"));
  EXPECT_EQ(status_of(get(port_, "/nothing")), 404);
}

TEST_F(AConsole, RefusesAForeignOriginAndAWrongName) {
  EXPECT_EQ(status_of(get(port_, "/", own_host())), 200);
  EXPECT_EQ(status_of(get(port_, "/", fmt::format("Host: [::1]:{}\r\n", port_))), 200);
  EXPECT_EQ(status_of(get(port_, "/", own_host() + fmt::format("Origin: http://127.0.0.1:{}\r\n", port_))), 200);
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"})
    EXPECT_EQ(status_of(get(port_, "/", own_host() + "Origin: " + origin + "\r\n")), 403) << origin;
  for (const char* host : {"Host: evil.example\r\n", "Host: 127.0.0.1.evil.example\r\n", ""})
    EXPECT_EQ(status_of(get(port_, "/api/files", host)), 403) << host;
  EXPECT_THAT(RawViewer(port_, "Origin: http://evil.example\r\n").handshake(), HasSubstr("403"));
  EXPECT_THAT(RawViewer(port_, fmt::format("Origin: http://localhost:{}\r\n", port_)).handshake(), HasSubstr("101"));
}

TEST_F(AConsole, NothingOutsideOfItsRootIsServed) {
  for (const char* target : {"/../secret.yaml", "/%2e%2e/secret.yaml", "/assets/../../secret.yaml",
                             "/assets/..%2f..%2fsecret.yaml", "//etc/passwd", "/etc/passwd"}) {
    const std::string answer = get(port_, target);
    EXPECT_EQ(status_of(answer), 404) << target;
    EXPECT_THAT(answer, Not(HasSubstr("secret: 1"))) << target;
  }
  std::filesystem::create_directory_symlink("/etc", workspace_ / "in/out");
  for (const char* file :
       {"..", "../secret.yaml", "%2e%2e%2fsecret.yaml", "/etc", "/etc/passwd", "x/../../page", "out"}) {
    EXPECT_EQ(status_of(get(port_, std::string("/api/files?folder=") + file)), 400) << file;
    EXPECT_EQ(status_of(get(port_, std::string("/api/thumbnail?file=") + file)), 400) << file;
    EXPECT_EQ(status_of(get(port_, std::string("/api/replay/rows?folder=") + file)), 400) << file;
  }
  EXPECT_THAT(get(port_, "/api/files"), testing::AllOf(HasSubstr("scene.yaml"), Not(HasSubstr("\"out\""))));
}

TEST_F(AConsole, AskedForATokenItServesNobodyWithout) {
  start(true);
  const std::string token = server_->token();
  ASSERT_EQ(token.size(), 32u);
  EXPECT_EQ(status_of(get(port_, "/")), 403);
  EXPECT_EQ(status_of(get(port_, "/?token=" + std::string(32, '0'))), 403);
  const std::string answer = get(port_, "/?token=" + token);
  EXPECT_EQ(status_of(answer), 303);
  EXPECT_THAT(answer, HasSubstr("HttpOnly; SameSite=Strict"));
  EXPECT_EQ(status_of(get(port_, "/", own_host() + "Cookie: a=b; palpate=" + token + "\r\n")), 200);
  EXPECT_THAT(RawViewer(port_).handshake(), HasSubstr("403"));
  EXPECT_THAT(RawViewer(port_, "Cookie: palpate=" + token + "\r\n").handshake(), HasSubstr("101"));
}

TEST_F(AConsole, HugeAndMalformedRequestsEndAndOthersAreServedOn) {
  EXPECT_EQ(status_of(answer_to(port_, "GET / HTTP/1.1\r\nX: " + std::string(100'000, 'x'))), 413);
  EXPECT_EQ(status_of(answer_to(port_, "POST / HTTP/1.1\r\n" + own_host() + "Content-Length: 999999999\r\n\r\n")), 413);
  EXPECT_EQ(status_of(answer_to(port_, "PUT / HTTP/1.1\r\n" + own_host() + "Connection: close\r\n\r\n")), 405);
  answer_to(port_, "\x16\x03\x01 nonsense\r\n\r\n");
  EXPECT_EQ(status_of(get(port_, "/")), 200);
}

TEST_F(AConsole, MalformedMessagesAreAnsweredWithASentenceAndHugeOnesEndTheViewer) {
  RawViewer viewer(port_);
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string("null"), std::string("{\"ask\": 3}"),
        std::string("{\"ask\": \"format_disk\"}"), std::string("{\"ask\": \"edit\"}"),
        std::string("{\"ask\": \"edit\", \"changes\": [1]}"), std::string("\xff\xfe"), std::string(60'000, '[')}) {
    viewer.send(text, text.front() == '\xff' ? 2 : 1);
    EXPECT_FALSE(until(viewer, [](const json& j) { return j.contains("error"); }).is_null()) << text.substr(0, 40);
  }
  RawViewer huge(port_);
  huge.send(std::string(2'000'000, ' '));
  EXPECT_TRUE(until(huge, [](const json& j) { return j.contains("error"); }).is_null());
  RawViewer broken(port_);
  broken.send_raw(std::string(32, static_cast<char>(0xff)));
  EXPECT_TRUE(until(broken, [](const json& j) { return j.contains("error"); }).is_null());
  EXPECT_TRUE(reply_to(viewer, {{"ask", "open_scene"}, {"file", "scene.yaml"}}).contains("reply"));
}

TEST_F(AConsole, ALateViewerGetsTheWholeStateAndEveryRow) {
  RawViewer first(port_);
  EXPECT_FALSE(reply_to(first, {{"ask", "open_scene"}, {"file", "scene.yaml"}}).contains("error"));
  EXPECT_FALSE(reply_to(first, {{"ask", "build"}}).contains("error"));
  EXPECT_FALSE(reply_to(first, {{"ask", "start"}, {"realtime", false}}).contains("error"));
  until(first, [](const json& j) { return j.contains("run") && j["run"].is_object() && j["run"]["over"] == true; });
  RawViewer late(port_);
  const json state = until(late, [](const json& j) { return j.contains("phase"); });
  EXPECT_EQ(state["phase"], "ready");
  EXPECT_EQ(state["scene"]["file"], "scene.yaml");
  EXPECT_EQ(state["source"]["frames"], 12);
  EXPECT_GT(state["map"]["counts"]["elements"], 100);
  EXPECT_EQ(state["rows"].size(), 12u);
  late.send(json{{"view", {{"picture", true}, {"shape", false}}}}.dump());
  auto message = late.receive();
  while (message && message->opcode != 2) message = late.receive();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->content.substr(16, 2), "\xff\xd8");  // a JPEG
  EXPECT_EQ(static_cast<int>(message->content[4]), 11);
}

TEST_F(AConsole, AViewerThatStallsHoldsNobodyUp) {
  RawViewer stalled(port_), lively(port_);
  for (RawViewer* viewer : {&stalled, &lively})
    viewer->send(json{{"view", {{"picture", true}, {"shape", true}}}}.dump());
  EXPECT_FALSE(reply_to(lively, {{"ask", "open_scene"}, {"file", "scene.yaml"}}).contains("error"));
  EXPECT_FALSE(reply_to(lively, {{"ask", "build"}}).contains("error"));
  for (int run = 0; run < 3; ++run) {
    EXPECT_FALSE(reply_to(lively, {{"ask", "start"}, {"realtime", false}}).contains("error"));
    const json end = until(
        lively, [](const json& j) { return j.contains("run") && j["run"].is_object() && j["run"]["over"] == true; });
    EXPECT_EQ(end["run"]["frame"], 11);
  }
}

TEST_F(AConsole, FinishedRunsCanBeReplayed) {
  RawViewer viewer(port_);
  reply_to(viewer, {{"ask", "open_scene"}, {"file", "scene.yaml"}});
  reply_to(viewer, {{"ask", "build"}});
  reply_to(viewer, {{"ask", "start"}, {"realtime", false}});
  until(viewer, [](const json& j) { return j.contains("run") && j["run"].is_object() && j["run"]["over"] == true; });
  EXPECT_THAT(get(port_, "/api/runs"), HasSubstr("runs/scene"));
  const std::string rows = get(port_, "/api/replay/rows?folder=runs%2Fscene");
  EXPECT_EQ(json::parse(rows.substr(rows.find("\r\n\r\n") + 4))["rows"].size(), 12u);
  for (int frame : {0, 11, 3})
    EXPECT_THAT(get(port_, fmt::format("/api/replay/picture?folder=runs/scene&frame={}", frame)), HasSubstr("\xff\xd8"))
        << frame;
  EXPECT_EQ(status_of(get(port_, "/api/replay/picture?folder=runs/scene&frame=12")), 404);
  EXPECT_EQ(status_of(get(port_, "/api/replay/picture?folder=runs/scene&frame=x")), 400);
  EXPECT_THAT(get(port_, "/api/replay/shape?folder=runs/scene&frame=5"), HasSubstr("PSH1"));
  EXPECT_THAT(get(port_, "/api/replay/report?folder=runs/scene"), HasSubstr("Content-Security-Policy: sandbox"));
}

TEST_F(AConsole, APortThatIsTakenIsRefusedWithASentence) {
  ConsoleOptions options;
  options.port = port_;
  try {
    ConsoleServer(options, RootFolder(workspace_ / "in"));
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_THAT(error.what(), HasSubstr("expected one that is free: --port NUMBER"));
  }
}

}  // namespace
}  // namespace palpate::test
