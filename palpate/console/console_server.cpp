#include "palpate/console/console_server.h"

#include <utility>  // before Boost.Asio 1.74, which uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstring>
#include <deque>
#include <set>
#include <thread>

#include "palpate/console/access.h"
#include "palpate/console/api.h"
#include "palpate/console/messages.h"
#include "palpate/console/page_files.h"
#include "palpate/console/pictures.h"
#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/session/shape.h"

namespace palpate {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;

constexpr size_t kMaxViewers = 16, kMaxConnections = 64, kMaxWaiting = 32, kMaxReplies = 64;
constexpr size_t kLongestMessage = 256 * 1024;
constexpr uint32_t kLongestHeader = 8 * 1024;
/// What the kernel may keep for a viewer that does not read: else it would be shown pictures of the past.
constexpr int kSendBuffer = 256 * 1024;
constexpr int64_t kBetweenShapes_ns = 100'000'000;
constexpr auto kRequestTime = std::chrono::seconds(20);

constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "font-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
/// The report is a page of its own with styles inside; it may do nothing else.
constexpr const char* kReportPolicy = "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:";

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

std::string text_of(boost::string_view view) {
  return {view.data(), view.size()};
}

Response response_to(const Request& request, Answer answer) {
  Response response{static_cast<http::status>(answer.status), request.version()};
  const bool is_page = answer.type.starts_with("text/html");
  const bool is_report = is_page && request.target().starts_with("/api/");
  response.set(http::field::content_type, answer.type);
  response.set("Content-Security-Policy", is_report ? kReportPolicy : kPolicy);
  response.set(http::field::cache_control, answer.may_be_kept ? "private, max-age=3600" : "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.keep_alive(request.keep_alive());
  response.body() = std::move(answer.bytes);
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

std::string bytes_to_send(uint32_t kind, int frame, double age_ms, const std::string& content) {
  std::string bytes(16, '\0');
  const auto number = static_cast<int32_t>(frame);
  std::memcpy(bytes.data(), &kind, 4);
  std::memcpy(bytes.data() + 4, &number, 4);
  std::memcpy(bytes.data() + 8, &age_ms, 8);
  return bytes + content;
}

class Viewer;

/// What all connections share; used on the server's thread only, but for what is atomic.
struct Hub {
  Hub(const ConsoleOptions& options, RootFolder root)
      : access(access_for(options.address, options.asks_for_token)),
        page(read_page_files(options.page)),
        session(
            std::move(root), [this] { wake(); }, options.may_open_live) {}

  /// From any thread: once for any number of changes.
  void wake() {
    if (!woken.exchange(true))
      asio::post(io, [this] {
        woken = false;
        tell_all();
      });
  }
  void tell_all();

  /// The newest picture as JPEG, made once for all.
  const std::string& jpeg(const std::shared_ptr<const RunFrame>& frame) {
    if (jpeg_of_frame != frame) {
      jpeg_of_frame = frame;
      jpeg_bytes = jpeg_of(frame->overlay);
    }
    return jpeg_bytes;
  }
  const std::string& shape(const std::shared_ptr<const RunFrame>& frame) {
    if (shape_of_frame != frame) {
      shape_of_frame = frame;
      shape_of_frame_bytes = shape_bytes(frame->estimate);
    }
    return shape_of_frame_bytes;
  }

  asio::io_context io{1};
  Access access;
  PageFiles page;
  std::atomic<bool> woken{false};
  std::set<std::shared_ptr<Viewer>> viewers;
  size_t connections = 0;
  std::atomic<int> viewer_count{0};
  std::atomic<uint64_t> pictures_sent{0}, pictures_replaced{0};
  std::shared_ptr<const RunFrame> jpeg_of_frame, shape_of_frame;
  std::string jpeg_bytes, shape_of_frame_bytes;
  asio::thread_pool readers{1};  ///< answers that read files
  Session session;               ///< goes first: it wakes us
};

/// One WebSocket: at most one write is on its way.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(Hub& hub, tcp::socket socket) : hub_(hub), socket_(std::move(socket)) {}

  void start(const Request& request) {
    websocket::stream_base::timeout timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.idle_timeout = kRequestTime;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.read_message_max(kLongestMessage);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->hub_.viewers.insert(self);
      self->hub_.viewer_count = static_cast<int>(self->hub_.viewers.size());
      self->read();
      self->write_next();
    });
  }

  void write_next() {
    if (is_writing_ || is_closed_) return;
    const SharedSnapshot now = hub_.session.newest();
    if (!replies_.empty()) {
      out_ = std::move(replies_.front());
      replies_.pop_front();
      return write(true);
    }
    if (now->version != told_version_ || has_more_ || is_new_) {
      is_new_ = false;
      told_version_ = now->version;
      out_ = state_json(*now, hub_.session.root(), told_, has_more_);
      return write(true);
    }
    const std::shared_ptr<const RunFrame> frame = now->run ? now->run->shown : nullptr;
    if (!frame) return;
    const double age_ms = now->run->over ? 1e9 : static_cast<double>(steady_ns() - frame->taken_ns) * 1e-6;
    if (wants_picture_ && frame != picture_) {
      if (picture_ && frame->estimate.frame > picture_->estimate.frame + 1)
        hub_.pictures_replaced += static_cast<uint64_t>(frame->estimate.frame - picture_->estimate.frame - 1);
      ++hub_.pictures_sent;
      picture_ = frame;
      out_ = bytes_to_send(1, frame->estimate.frame, age_ms, hub_.jpeg(frame));
      return write(false);
    }
    if (wants_shape_ && frame != shape_ && steady_ns() - shape_ns_ > kBetweenShapes_ns) {
      shape_ = frame;
      shape_ns_ = steady_ns();
      const std::string& bytes = hub_.shape(frame);
      if (bytes.empty()) return;
      out_ = bytes_to_send(2, frame->estimate.frame, age_ms, bytes);
      return write(false);
    }
  }

  void close() {
    is_closed_ = true;
    beast::error_code ignored;
    beast::get_lowest_layer(socket_).socket().shutdown(tcp::socket::shutdown_both, ignored);
    beast::get_lowest_layer(socket_).close();
  }

 private:
  void write(bool is_text) {
    is_writing_ = true;
    socket_.text(is_text);
    socket_.async_write(asio::buffer(out_), [self = shared_from_this()](beast::error_code error, size_t) {
      self->is_writing_ = false;
      if (error) return self->leave();
      self->write_next();
    });
  }

  void read() {
    socket_.async_read(in_, [self = shared_from_this()](beast::error_code error, size_t) {
      if (error) return self->leave();
      self->take(beast::buffers_to_string(self->in_.data()));
      self->in_.consume(self->in_.size());
      self->read();
    });
  }

  void reply(std::string text) {
    if (replies_.size() < kMaxReplies) replies_.push_back(std::move(text));
    write_next();
  }

  void take(const std::string& text) {
    ViewerMessage message;
    try {
      message = parse_viewer_message(text);
    } catch (const BadInput& error) {
      return reply(reply_json(0, error.what()));
    }
    if (message.wants_picture) wants_picture_ = *message.wants_picture;
    if (message.wants_shape) wants_shape_ = *message.wants_shape;
    if (message.wants_picture || message.wants_shape) {
      picture_.reset();
      shape_.reset();
      write_next();
    }
    if (message.ping) reply(pong_json(*message.ping));
    if (!message.command) return;
    if (waiting_ >= kMaxWaiting) return reply(reply_json(message.id, "too many commands wait already"));
    ++waiting_;
    hub_.session.ask(std::move(*message.command), [self = shared_from_this(), id = message.id](const std::string& why) {
      asio::post(self->hub_.io, [self, id, why] {
        --self->waiting_;
        self->reply(reply_json(id, why));
      });
    });
  }

  void leave() {
    is_closed_ = true;
    hub_.viewers.erase(shared_from_this());
    hub_.viewer_count = static_cast<int>(hub_.viewers.size());
  }

  Hub& hub_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer in_;
  std::string out_;
  std::deque<std::string> replies_;
  ToldSoFar told_;
  uint64_t told_version_ = 0;
  bool has_more_ = false, is_new_ = true, is_writing_ = false, is_closed_ = false;
  bool wants_picture_ = false, wants_shape_ = false;
  size_t waiting_ = 0;
  std::shared_ptr<const RunFrame> picture_, shape_;
  int64_t shape_ns_ = 0;
};

void Hub::tell_all() {
  for (const std::shared_ptr<Viewer>& viewer : std::set(viewers)) viewer->write_next();
}

/// One HTTP connection, request after request; becomes a Viewer where it is asked to.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Hub& hub, tcp::socket socket) : hub_(hub), stream_(std::move(socket)) { ++hub_.connections; }
  ~Connection() { --hub_.connections; }

  void read() {
    parser_.emplace();
    parser_->header_limit(kLongestHeader);
    parser_->body_limit(0);
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, in_, *parser_, [self = shared_from_this()](beast::error_code error, size_t) {
      if (error == http::error::header_limit || error == http::error::body_limit) return self->refuse_size();
      if (error) return self->end();
      self->serve(self->parser_->release());
    });
  }

 private:
  void serve(Request request) {
    const Target target = parse_target(text_of(request.target()));
    const auto token = target.query.find("token");
    const Caller caller{text_of(request[http::field::host]), text_of(request[http::field::origin]),
                        text_of(request[http::field::cookie]), token == target.query.end() ? "" : token->second};
    if (const std::string why = refusal(hub_.access, caller); !why.empty())
      return write(response_to(request, {403, "text/plain; charset=utf-8", why + "\n"}));
    if (websocket::is_upgrade(request)) {
      if (target.path != "/live" || hub_.viewers.size() >= kMaxViewers)
        return write(response_to(request, {503, "text/plain; charset=utf-8", "no viewer more\n"}));
      stream_.expires_never();
      return std::make_shared<Viewer>(hub_, stream_.release_socket())->start(request);
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return write(response_to(request, {405, "text/plain; charset=utf-8", "only GET\n"}));
    if (target.path == "/" && !caller.token.empty()) return write(with_cookie(request, caller.token));
    if (!target.path.starts_with("/api/")) return write(response_to(request, page_file(target.path)));
    // Files are read beside the server's thread; the snapshot is that of this moment.
    asio::post(hub_.readers, [self = shared_from_this(), request, target, now = hub_.session.newest()] {
      Answer answer = answer_api(target, *now, self->hub_.session.root());
      asio::post(self->hub_.io, [self, request, answer = std::move(answer)]() mutable {
        self->write(response_to(request, std::move(answer)));
      });
    });
  }

  Answer page_file(const std::string& path) const {
    const auto found = hub_.page.find(path);
    if (found != hub_.page.end()) return {200, found->second.type, found->second.bytes, path.starts_with("/assets/")};
    if (path == "/" && hub_.page.empty())
      return {404, "text/plain; charset=utf-8", "The page is not built: ./dev console builds it.\n"};
    return {404, "text/plain; charset=utf-8", "there is nothing of that name\n"};
  }

  static Response with_cookie(const Request& request, const std::string& token) {
    Response response = response_to(request, {303, "text/plain; charset=utf-8", "\n"});
    response.set(http::field::location, "/");
    response.set(http::field::set_cookie, "palpate=" + token + "; HttpOnly; SameSite=Strict; Path=/");
    return response;
  }

  void refuse_size() {
    Request nothing;
    nothing.version(11);
    nothing.keep_alive(false);
    write(response_to(nothing, {413, "text/plain; charset=utf-8", "the request is too long\n"}));
  }

  void write(Response response) {
    auto kept = std::make_shared<Response>(std::move(response));
    stream_.expires_after(kRequestTime);
    http::async_write(stream_, *kept, [self = shared_from_this(), kept](beast::error_code error, size_t) {
      if (error || kept->need_eof()) return self->end();
      self->read();
    });
  }

  void end() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Hub& hub_;
  beast::tcp_stream stream_;
  beast::flat_buffer in_{kLongestHeader * 2};
  std::optional<http::request_parser<http::string_body>> parser_;
};

tcp::acceptor listening(asio::io_context& io, const ConsoleOptions& options) {
  beast::error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error) throw BadInput(fmt::format("--bind is '{}', expected an address as 192.168.1.5", options.address));
  tcp::acceptor acceptor(io);
  const tcp::endpoint endpoint(address, static_cast<uint16_t>(options.port));
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    throw BadInput(fmt::format("{} port {} cannot be listened on ({}), expected one that is free: --port NUMBER",
                               options.address, options.port, error.message()));
  return acceptor;
}

}  // namespace

struct ConsoleServer::State {
  State(const ConsoleOptions& options, RootFolder root)
      : hub(options, std::move(root)), acceptor(listening(hub.io, options)) {
    accept();
    thread = std::thread([this] {
      pthread_setname_np(pthread_self(), "palpate-console");
      hub.io.run();
    });
  }

  ~State() {
    asio::post(hub.io, [this] {
      beast::error_code ignored;
      acceptor.close(ignored);
      for (const auto& viewer : std::set(hub.viewers)) viewer->close();
      hub.io.stop();
    });
    thread.join();
    hub.readers.join();
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && hub.connections < kMaxConnections) {
        beast::error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        socket.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
        std::make_shared<Connection>(hub, std::move(socket))->read();
      }
      accept();
    });
  }

  Hub hub;
  tcp::acceptor acceptor;
  std::thread thread;
};

ConsoleServer::ConsoleServer(const ConsoleOptions& options, RootFolder root)
    : state_(std::make_unique<State>(options, std::move(root))) {}

ConsoleServer::~ConsoleServer() = default;

Session& ConsoleServer::session() {
  return state_->hub.session;
}

int ConsoleServer::port() const {
  return state_->acceptor.local_endpoint().port();
}

const std::string& ConsoleServer::token() const {
  return state_->hub.access.token;
}

bool ConsoleServer::has_page() const {
  return !state_->hub.page.empty();
}

ConsoleCounts ConsoleServer::counts() const {
  const Hub& hub = state_->hub;
  return {hub.viewer_count, hub.pictures_sent, hub.pictures_replaced};
}

}  // namespace palpate
