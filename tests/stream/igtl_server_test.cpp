#include "palpate/stream/igtl_server.h"

#include <gtest/gtest.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/stream/address.h"
#include "tests/stream/other_program.h"
#include "tests/stream/samples.h"

namespace palpate {
namespace {

using namespace std::chrono_literals;

/// A client built on OpenIGTLink's own library.
class Client {
 public:
  explicit Client(int port) : socket_(igtl::ClientSocket::New()) {
    connected_ = socket_->ConnectToServer("127.0.0.1", port) == 0;
    socket_->SetReceiveTimeout(10000);
  }
  bool connected() const { return connected_; }
  void send(igtl::MessageBase& message) {
    message.Pack();
    socket_->Send(message.GetPackPointer(), message.GetPackSize());
  }
  /// The next message of this type and device, checked by its CRC; null where none comes.
  template <class Message>
  typename Message::Pointer next(const std::string& type, const std::string& device) {
    for (int i = 0; i < 200; ++i) {
      const igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
      header->InitPack();
      if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return nullptr;
      header->Unpack();
      if (type != header->GetDeviceType() || device != header->GetDeviceName()) {
        socket_->Skip(header->GetBodySizeToRead(), 0);
        continue;
      }
      const typename Message::Pointer message = Message::New();
      igtl::MessageHeader::Pointer given = header;
      message->SetMessageHeader(given);
      message->AllocatePack();
      socket_->Receive(message->GetPackBodyPointer(), message->GetPackBodySize());
      if (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) return message;
    }
    return nullptr;
  }

 private:
  igtl::ClientSocket::Pointer socket_;
  bool connected_ = false;
};

/// Publishes at 50 frames per second until it goes.
class Frames {
 public:
  explicit Frames(IgtlServer& server, const ForceEstimate& estimate = test::touching())
      : thread_([&server, estimate, this] {
          ForceEstimate next = estimate;
          while (!stop_) {
            const int64_t before_ns = steady_ns();
            server.publish(test::frame_of(next));
            longest_ns_ = std::max<int64_t>(longest_ns_, steady_ns() - before_ns);
            ++next.frame;
            std::this_thread::sleep_for(20ms);
          }
        }) {}
  ~Frames() {
    stop_ = true;
    thread_.join();
  }
  double longest_ms() const { return 1e-6 * static_cast<double>(longest_ns_); }

 private:
  std::atomic<bool> stop_{false};
  std::atomic<int64_t> longest_ns_{0};
  std::thread thread_;
};

TEST(IgtlServer, SendsEveryMessageInRas) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  Client client(options.port);
  ASSERT_TRUE(client.connected());
  const Frames frames(server);

  const auto tip = client.next<igtl::TransformMessage>("TRANSFORM", "PalpateTip");
  ASSERT_TRUE(tip.IsNotNull());
  igtl::Matrix4x4 matrix;
  tip->GetMatrix(matrix);
  EXPECT_EQ(Vec3(matrix[0][3], matrix[1][3], matrix[2][3]), Vec3(-10, -20, 90));

  const auto state = client.next<igtl::StringMessage>("STRING", "PalpateState");
  ASSERT_TRUE(state.IsNotNull());
  const auto json = nlohmann::json::parse(state->GetString());
  EXPECT_EQ(json["valid"], true);
  EXPECT_EQ(json["status"], "ok");
  EXPECT_EQ(json["force_N"], (std::vector<double>{0.1, -0.2, 0.3}));
  EXPECT_EQ(json["band_N"], (std::vector<double>{0.3, 0.45}));
  EXPECT_EQ(json["law"], "saint-venant-kirchhoff");
  EXPECT_EQ(json["young_modulus_kPa"], 27);

  const auto force = client.next<igtl::SensorMessage>("SENSOR", "PalpateForce");
  ASSERT_TRUE(force.IsNotNull());
  ASSERT_EQ(force->GetLength(), 4U);
  EXPECT_DOUBLE_EQ(force->GetValue(0), -0.1);
  EXPECT_DOUBLE_EQ(force->GetValue(1), 0.2);
  EXPECT_DOUBLE_EQ(force->GetValue(2), 0.3);
  EXPECT_DOUBLE_EQ(force->GetValue(3), 1);
  const igtl::Unit::Pointer newton = igtl::Unit::New();
  newton->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  EXPECT_EQ(force->GetUnit(), newton->Pack());

  const auto surface = client.next<igtl::PolyDataMessage>("POLYDATA", "PalpateSurface");
  ASSERT_TRUE(surface.IsNotNull());
  EXPECT_EQ(surface->GetPoints()->GetNumberOfPoints(), 4 + 6);
  EXPECT_EQ(surface->GetPolygons()->GetNumberOfCells(), 4U + 4U);
  EXPECT_EQ(surface->GetLines()->GetNumberOfCells(), 1U);
  ASSERT_EQ(surface->GetNumberOfAttributes(), 1);
  EXPECT_STREQ(surface->GetAttribute(0)->GetName(), "von_mises_kPa");
  EXPECT_EQ(surface->GetAttribute(0)->GetSize(), 10U);

  const auto overlay = client.next<igtl::ImageMessage>("IMAGE", "PalpateOverlay");
  ASSERT_TRUE(overlay.IsNotNull());
  int size[3];
  overlay->GetDimensions(size);
  EXPECT_EQ(size[0], 96);
  EXPECT_EQ(size[1], 54);
  const auto* rgb = static_cast<const uint8_t*>(overlay->GetScalarPointer());
  EXPECT_EQ(rgb[0], 0);
  EXPECT_EQ(rgb[2], 255);
  overlay->GetMatrix(matrix);
  EXPECT_LT(matrix[0][0], 0);  // to the patient's left along the rows, downwards along the columns: upright in Slicer
  EXPECT_LT(matrix[1][1], 0);
  EXPECT_NEAR(matrix[0][3], 0, 1e-4);  // the middle of the image
  EXPECT_NEAR(matrix[2][3], 90, 1e-4);

  const auto status = client.next<igtl::StatusMessage>("STATUS", "PalpateStatus");
  ASSERT_TRUE(status.IsNotNull());
  EXPECT_EQ(status->GetCode(), 1);
}

TEST(IgtlServer, SendsASecondInstrumentUnderNamesOfItsOwn) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  Client client(options.port);
  const Frames frames(server, test::both_touching());
  const auto tip = client.next<igtl::TransformMessage>("TRANSFORM", "PalpateTip2");
  ASSERT_TRUE(tip.IsNotNull());
  igtl::Matrix4x4 matrix;
  tip->GetMatrix(matrix);
  EXPECT_EQ(Vec3(matrix[0][3], matrix[1][3], matrix[2][3]), Vec3(5, 0, 80));
  const auto state = client.next<igtl::StringMessage>("STRING", "PalpateState2");
  ASSERT_TRUE(state.IsNotNull());
  EXPECT_EQ(nlohmann::json::parse(state->GetString())["force_N"], (std::vector<double>{0, 0, -0.5}));
  const auto force = client.next<igtl::SensorMessage>("SENSOR", "PalpateForce2");
  ASSERT_TRUE(force.IsNotNull());
  EXPECT_DOUBLE_EQ(force->GetValue(2), -0.5);
  EXPECT_DOUBLE_EQ(force->GetValue(3), 1);
  const auto surface = client.next<igtl::PolyDataMessage>("POLYDATA", "PalpateSurface");
  ASSERT_TRUE(surface.IsNotNull());
  EXPECT_EQ(surface->GetLines()->GetNumberOfCells(), 2U);
}

TEST(IgtlServer, SaysNotReadyAndSendsNoTipWhereNothingIsSeen) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  Client client(options.port);
  const auto before = client.next<igtl::StatusMessage>("STATUS", "PalpateStatus");
  ASSERT_TRUE(before.IsNotNull());
  EXPECT_EQ(before->GetCode(), 13);
  const Frames frames(server, test::lost());
  const auto state = client.next<igtl::StringMessage>("STRING", "PalpateState");
  ASSERT_TRUE(state.IsNotNull());
  const auto json = nlohmann::json::parse(state->GetString());
  EXPECT_EQ(json["valid"], false);
  EXPECT_FALSE(json.contains("force_N"));
  EXPECT_FALSE(json.contains("tip_mm"));
  const auto force = client.next<igtl::SensorMessage>("SENSOR", "PalpateForce");
  ASSERT_TRUE(force.IsNotNull());
  EXPECT_EQ(force->GetValue(3), 0);
  const auto status = client.next<igtl::StatusMessage>("STATUS", "PalpateStatus");
  ASSERT_TRUE(status.IsNotNull());
  EXPECT_EQ(status->GetCode(), 13);
}

TEST(IgtlServer, APortThatIsTakenIsOneSentence) {
  const OpenIgtLinkOptions options = test::on_free_port();
  const IgtlServer first(options, test::small_scene(), {}, {});
  try {
    const IgtlServer second(options, test::small_scene(), {}, {});
    FAIL();
  } catch (const BadInput& error) {
    EXPECT_NE(std::string(error.what()).find("127.0.0.1:" + std::to_string(options.port)), std::string::npos);
  }
}

/// A socket of ours, to misbehave with.
Descriptor raw_client(int port) {
  Descriptor socket(::socket(AF_INET, SOCK_STREAM, 0));
  const SocketAddress to = resolve({"127.0.0.1", port}, SOCK_STREAM, "");
  connect(socket.get(), reinterpret_cast<const sockaddr*>(&to.storage), to.size);
  return socket;
}

TEST(IgtlServer, StuckClientsAreDroppedAndKeepNobodyWaiting) {
  OpenIgtLinkOptions options = test::on_free_port();
  options.drop_after_s = 1;
  options.overlay_hz = 50;
  IgtlServer server(options, test::small_scene(), {}, {});
  std::vector<Descriptor> stuck;
  for (int i = 0; i < 3; ++i) {
    stuck.push_back(raw_client(options.port));
    const int small = 1024;
    setsockopt(stuck.back().get(), SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
  }
  std::list<Client> reading;
  for (int i = 0; i < 7; ++i) reading.emplace_back(options.port);
  ASSERT_TRUE(test::soon([&] { return server.counts().clients == 10; }));
  std::vector<std::thread> readers;
  std::atomic<int> reached{0};
  {
    const Frames frames(server);
    for (Client& client : reading)
      readers.emplace_back([&] {
        int frame = 0;
        while (frame < 120) {
          const auto state = client.next<igtl::StringMessage>("STRING", "PalpateState");
          if (state.IsNull()) return;
          frame = nlohmann::json::parse(state->GetString())["frame"];
        }
        ++reached;
      });
    EXPECT_TRUE(test::soon([&] { return server.counts().dropped == 3; }));
    for (std::thread& reader : readers) reader.join();
  }
  EXPECT_EQ(reached, 7);
  EXPECT_EQ(server.counts().clients, 7);
}

TEST(IgtlServer, ASlowClientSeesFewerFramesNotOlderOnes) {
  OpenIgtLinkOptions options = test::on_free_port();
  options.overlay_hz = 0;
  StreamScene scene = test::small_scene();
  IgtlServer server(options, scene, {}, {});
  Client client(options.port);
  ASSERT_TRUE(test::soon([&] { return server.counts().clients == 1; }));
  std::this_thread::sleep_for(300ms);
  // Far more than the buffers of the system hold, while nobody reads.
  ForceEstimate estimate = test::touching(0);
  estimate.warnings.assign(50, std::string(1000, 'x'));
  while (server.counts().replaced < 60 && estimate.frame < 100000) {
    ++estimate.frame;
    server.publish(test::frame_of(estimate));
    std::this_thread::sleep_for(2ms);
  }
  int last = 0, seen = 0;
  while (last < estimate.frame) {
    const auto state = client.next<igtl::StringMessage>("STRING", "PalpateState");
    ASSERT_TRUE(state.IsNotNull());
    const int frame = nlohmann::json::parse(state->GetString())["frame"];
    EXPECT_GT(frame, last);
    last = frame;
    ++seen;
  }
  EXPECT_LT(seen, estimate.frame);
}

TEST(IgtlServer, OutlivesClientsThatGoInTheMiddleOfAMessageOrSpeakSomethingElse) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  const Frames frames(server);
  for (int i = 0; i < 20; ++i) {
    const Descriptor half = raw_client(options.port);
    const auto bytes = std::vector<uint8_t>(30, 1);
    send(half.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (i % 2 == 0) {  // reset instead of an orderly end
      const linger now{1, 0};
      setsockopt(half.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    }
  }
  const Descriptor http = raw_client(options.port);
  const std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\nAccept: text/html, application/xhtml\r\n\r\n";
  send(http.get(), request.data(), request.size(), MSG_NOSIGNAL);
  Client good(options.port);
  EXPECT_TRUE(good.next<igtl::TransformMessage>("TRANSFORM", "PalpateTip").IsNotNull());
  EXPECT_TRUE(test::soon([&] { return server.counts().clients == 1; }));
}

TEST(IgtlServer, ServesTwentyClientsAndRefusesTheThirtyThird) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  const Frames frames(server);
  std::list<Client> clients;
  for (int i = 0; i < 20; ++i) clients.emplace_back(options.port);
  for (Client& client : clients)
    EXPECT_TRUE(client.next<igtl::TransformMessage>("TRANSFORM", "PalpateTip").IsNotNull());
  std::vector<Descriptor> more;
  for (int i = 0; i < 20; ++i) more.push_back(raw_client(options.port));
  EXPECT_TRUE(test::soon([&] { return server.counts().dropped >= 8; }));
  EXPECT_LE(server.counts().clients, 32);
}

TEST(IgtlServer, AcceptsAStatusOfVersion2AndAnswersQuestionsOnly) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  Client client(options.port);
  const igtl::StatusMessage::Pointer status = igtl::StatusMessage::New();
  status->SetCode(1);
  status->SetDeviceName("");
  client.send(*status);
  const igtl::GetPolyDataMessage::Pointer question = igtl::GetPolyDataMessage::New();
  client.send(*question);
  const Frames frames(server);
  EXPECT_TRUE(client.next<igtl::PolyDataMessage>("POLYDATA", "PalpateSurface").IsNotNull());
  client.send(*question);
  EXPECT_TRUE(client.next<igtl::PolyDataMessage>("POLYDATA", "PalpateSurface").IsNotNull());
  EXPECT_TRUE(test::soon([&] { return server.counts().messages >= 2; }));
  EXPECT_EQ(server.counts().messages, 2U);
}

TEST(IgtlServer, IsUnderstoodByReceiveClient) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  const Frames frames(server);
  auto program = test::OtherProgram::start("igtl_ReceiveClient", {"127.0.0.1", std::to_string(options.port)});
  if (!program) GTEST_SKIP() << "the examples of OpenIGTLink are not installed (openigtlink-examples)";
  EXPECT_TRUE(program->soon_writes("Receiving TRANSFORM data type."));
  EXPECT_TRUE(program->soon_writes("-10"));
  EXPECT_TRUE(program->soon_writes("Receiving STRING data type."));
  EXPECT_TRUE(program->soon_writes("\"status\":\"ok\""));
  EXPECT_TRUE(program->soon_writes("Receiving IMAGE data type."));
  EXPECT_TRUE(program->soon_writes("Receiving STATUS data type."));
}

TEST(IgtlServer, IsUnderstoodByPolyDataClient) {
  const OpenIgtLinkOptions options = test::on_free_port();
  IgtlServer server(options, test::small_scene(), {}, {});
  auto program = test::OtherProgram::start("igtl_PolyDataClient", {"127.0.0.1", std::to_string(options.port)});
  if (!program) GTEST_SKIP() << "the examples of OpenIGTLink are not installed (openigtlink-examples)";
  EXPECT_TRUE(program->soon_writes("Name = von_mises_kPa"));
  EXPECT_TRUE(program->soon_writes("point[3] = (-0, -0, 100)"));
  const Frames frames(server);  // not spoken to between its questions
  EXPECT_TRUE(program->soon_writes("point[5] = (-10, -20, 90)"));
  EXPECT_EQ(program->output().find("Invalid response"), std::string::npos);
}

TEST(IgtlServer, TakesTransformsFromTrackerClient) {
  const OpenIgtLinkOptions options = test::on_free_port();
  std::mutex mutex;
  std::vector<Vec3> tips_mm;
  IgtlServer server(options, test::small_scene(), {}, [&](const IgtlReceived& message) {
    const std::lock_guard lock(mutex);
    if (message.device == "Tracker") tips_mm.push_back(message.translation_mm);
  });
  auto program = test::OtherProgram::start("igtl_TrackerClient", {"127.0.0.1", std::to_string(options.port), "100"});
  if (!program) GTEST_SKIP() << "the examples of OpenIGTLink are not installed (openigtlink-examples)";
  ASSERT_TRUE(test::soon([&] {
    const std::lock_guard lock(mutex);
    return tips_mm.size() >= 20;
  }));
  for (size_t i = 0; i < 20; ++i) {
    const double phi = 0.2 * static_cast<double>(i);
    EXPECT_LT((tips_mm[i] - 50 * Vec3(std::cos(phi), std::sin(phi), std::cos(phi))).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace palpate
