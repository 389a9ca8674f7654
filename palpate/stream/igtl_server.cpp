#include "palpate/stream/igtl_server.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <list>
#include <mutex>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/stream/igtl_client.h"

namespace palpate {

namespace {

constexpr size_t kMaxClients = 32;
/// A new client may ask before it is spoken to.
constexpr int64_t kListensFirst_ns = 200'000'000;
constexpr int64_t kStatusEvery_ns = 1'000'000'000;
constexpr size_t kLatenciesKept = 4096;

Descriptor listening_socket(const OpenIgtLinkOptions& options) {
  const Address address{options.host, options.port};
  const SocketAddress at = resolve(address, SOCK_STREAM, "streams.openigtlink.host");
  Descriptor socket(::socket(at.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (!socket || bind(socket.get(), reinterpret_cast<const sockaddr*>(&at.storage), at.size) != 0 ||
      listen(socket.get(), static_cast<int>(kMaxClients)) != 0)
    throw BadInput(fmt::format("streams.openigtlink cannot listen on {} ({}), expected a free port of this machine",
                               address.text(), std::strerror(errno)));
  return socket;
}

/// At most so often per second.
class Rate {
 public:
  explicit Rate(double hz) : period_ns_(hz > 0 ? static_cast<int64_t>(1e9 / hz) : INT64_MAX) {}
  bool due(int64_t now_ns) {
    if (period_ns_ == INT64_MAX || now_ns < next_ns_) return false;
    next_ns_ = std::max(next_ns_ + period_ns_, now_ns + period_ns_ / 2);
    return true;
  }
  int64_t next_ns() const { return next_ns_; }

 private:
  int64_t period_ns_, next_ns_ = 0;
};

}  // namespace

struct IgtlServer::State {
  OpenIgtLinkOptions options;
  StreamScene scene;
  std::function<ForceSample()> force;
  std::function<void(const IgtlReceived&)> on_transform;
  Descriptor listener;
  Descriptor wake{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
  std::atomic<bool> stop{false};

  std::mutex newest_mutex;  // held only to swap a pointer
  SharedFrame newest;

  std::list<IgtlClient> clients;
  SharedFrame shown;
  bool ready = false;
  Rate overlay, surface, force_rate, status{1};

  mutable std::mutex counts_mutex;
  IgtlServerCounts counts;
  std::vector<double> latencies_ms;
  size_t next_latency = 0;
  std::thread thread;

  State(const OpenIgtLinkOptions& o, StreamScene s, std::function<ForceSample()> f,
        std::function<void(const IgtlReceived&)> t)
      : options(o),
        scene(std::move(s)),
        force(std::move(f)),
        on_transform(std::move(t)),
        listener(listening_socket(o)),
        overlay(o.overlay_hz),
        surface(o.surface_hz),
        force_rate(o.force_hz) {}

  IgtlBytes status_bytes() const {
    if (!shown) return igtl_status(false, "no frame yet");
    if (!ready) return igtl_status(false, "no force: " + status_name(shown->estimate.status));
    return igtl_status(true, status_name(shown->estimate.status));
  }

  IgtlBytes force_bytes() const {
    if (!force) {
      if (!shown) return igtl_force(Vec3::Zero(), false, wall_ns());
      return igtl_force(shown->estimate.force_N, ready, shown->wall_ns);
    }
    const ForceSample sample = force();
    return igtl_force({sample.force_N[0], sample.force_N[1], sample.force_N[2]}, sample.valid, sample.wall_ns);
  }

  void offer_to_all(IgtlKind kind, const IgtlBytes& bytes, int64_t now_ns) {
    uint64_t replaced = 0;
    for (IgtlClient& client : clients)
      if (!client.asks && now_ns - client.connected_ns() > kListensFirst_ns)
        replaced += client.offer(kind, bytes, shown ? shown->decoded_ns : 0);
    const std::lock_guard lock(counts_mutex);
    counts.replaced += replaced;
  }

  bool anybody_listens(int64_t now_ns) const {
    return std::any_of(clients.begin(), clients.end(), [now_ns](const IgtlClient& client) {
      return !client.asks && now_ns - client.connected_ns() > kListensFirst_ns;
    });
  }

  /// One message of each kind that is due.
  void offer_frame(int64_t now_ns) {
    const bool was_ready = std::exchange(ready, has_force(shown->estimate));
    if (!anybody_listens(now_ns)) return;
    if (has_tip(shown->estimate)) offer_to_all(IgtlKind::tip, igtl_tip(*shown), now_ns);
    offer_to_all(IgtlKind::state, igtl_state(*shown, scene), now_ns);
    if (!force) offer_to_all(IgtlKind::force, force_bytes(), now_ns);
    if (shown->instruments > 1) offer_second(now_ns);
    if (was_ready != ready) offer_to_all(IgtlKind::status, status_bytes(), now_ns);
    if (surface.due(now_ns)) offer_to_all(IgtlKind::surface, igtl_surface(shown.get(), scene), now_ns);
    if (!shown->overlay.empty() && overlay.due(now_ns))
      offer_to_all(IgtlKind::overlay, igtl_overlay(*shown, scene), now_ns);
  }

  void offer_second(int64_t now_ns) {
    const ForceEstimate& second = estimate_of(*shown, 1);
    if (has_tip(second)) offer_to_all(IgtlKind::tip_2, igtl_tip(*shown, 1), now_ns);
    offer_to_all(IgtlKind::state_2, igtl_state(*shown, scene, 1), now_ns);
    offer_to_all(IgtlKind::force_2, igtl_force(second.force_N, has_force(second), shown->wall_ns, 1), now_ns);
  }

  void answer(IgtlClient& client, const IgtlReceived& message) {
    if (message.type == "TRANSFORM") {
      if (on_transform) on_transform(message);
      return;
    }
    if (!message.type.starts_with("GET_")) return;
    const std::string what = message.type.substr(4);
    if (what == "CAPABIL") return;
    if (!std::exchange(client.asks, true)) client.forget_waiting();
    const int64_t decoded_ns = shown ? shown->decoded_ns : 0;
    if (what == "POLYDATA")
      client.offer(IgtlKind::surface, igtl_surface(shown.get(), scene), decoded_ns);
    else if (what == "IMAGE" && shown && !shown->overlay.empty())
      client.offer(IgtlKind::overlay, igtl_overlay(*shown, scene), decoded_ns);
    else if (what == "TRANSFORM" && shown && has_tip(shown->estimate))
      client.offer(IgtlKind::tip, igtl_tip(*shown), decoded_ns);
    else if (what == "STRING" && shown)
      client.offer(IgtlKind::state, igtl_state(*shown, scene), decoded_ns);
    else if (what == "SENSOR")
      client.offer(IgtlKind::force, force_bytes(), decoded_ns);
    else
      client.offer(IgtlKind::status, status_bytes(), decoded_ns);
  }

  void accept_clients(int64_t now_ns) {
    while (true) {
      Descriptor socket(accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (!socket) return;
      if (clients.size() < kMaxClients) {
        clients.emplace_back(std::move(socket), now_ns);
        clients.back().offer(IgtlKind::status, status_bytes(), 0);
        continue;
      }
      const std::lock_guard lock(counts_mutex);
      ++counts.dropped;
    }
  }

  void note_written(const IgtlClient::Written& written, int64_t now_ns) {
    const std::lock_guard lock(counts_mutex);
    counts.messages += written.messages;
    counts.bytes += written.bytes;
    for (const int64_t decoded_ns : written.tips_decoded_ns) {
      if (latencies_ms.size() < kLatenciesKept) latencies_ms.push_back(0);
      latencies_ms[next_latency] = static_cast<double>(now_ns - decoded_ns) * 1e-6;
      next_latency = (next_latency + 1) % kLatenciesKept;
    }
  }

  /// Whether the client stays.
  bool serve(IgtlClient& client, bool may_read, int64_t now_ns, bool& failed) {
    const bool stays = !may_read || client.read([&](const IgtlReceived& message) { answer(client, message); });
    if (!stays) return false;
    const bool may_write = now_ns - client.connected_ns() > kListensFirst_ns || client.asks;
    IgtlClient::Written written;
    if (may_write && !client.write(now_ns, written)) return false;
    if (written.bytes > 0) note_written(written, steady_ns());
    const int64_t stuck_ns = client.stuck_since_ns() == 0 ? 0 : now_ns - client.stuck_since_ns();
    failed = static_cast<double>(stuck_ns) > 1e9 * options.drop_after_s;
    return !failed;
  }

  void run() {
    pthread_setname_np(pthread_self(), "palpate-igtl");
    std::vector<pollfd> polled;
    while (!stop) {
      const int64_t before_ns = steady_ns();
      int64_t until_ns = before_ns + 100'000'000;
      if (force && !clients.empty()) until_ns = std::clamp(force_rate.next_ns(), before_ns, until_ns);
      polled = {{wake.get(), POLLIN, 0}, {listener.get(), POLLIN, 0}};
      for (const IgtlClient& client : clients) {
        const bool may_write = client.asks || before_ns - client.connected_ns() > kListensFirst_ns;
        const auto events = static_cast<short>(POLLIN | (may_write && client.wants_to_write() ? POLLOUT : 0));
        polled.push_back({client.fd(), events, 0});
      }
      const timespec timeout{0, std::min<int64_t>(until_ns - before_ns, 999'999'999)};
      ppoll(polled.data(), polled.size(), &timeout, nullptr);
      const int64_t now_ns = steady_ns();

      uint64_t woken;
      if (polled[0].revents && ::read(wake.get(), &woken, sizeof woken) < 0) polled[0].revents = 0;
      SharedFrame frame;
      {
        const std::lock_guard lock(newest_mutex);
        frame = std::move(newest);
        newest.reset();
      }
      if (frame) {
        shown = std::move(frame);
        offer_frame(now_ns);
      }
      if (force && force_rate.due(now_ns)) offer_to_all(IgtlKind::force, force_bytes(), now_ns);
      if (status.due(now_ns)) offer_to_all(IgtlKind::status, status_bytes(), now_ns);

      size_t number = 2;
      int dropped = 0;
      for (auto client = clients.begin(); client != clients.end(); ++number) {
        bool failed = false;
        if (serve(*client, polled[number].revents & (POLLIN | POLLHUP | POLLERR), now_ns, failed)) {
          ++client;
        } else {
          client = clients.erase(client);
          dropped += failed;
        }
      }
      if (polled[1].revents) accept_clients(now_ns);
      rusage usage{};
      getrusage(RUSAGE_THREAD, &usage);
      const std::lock_guard lock(counts_mutex);
      counts.dropped += dropped;
      counts.clients = static_cast<int>(clients.size());
      counts.cpu_s = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                     1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    }
  }
};

IgtlServer::IgtlServer(const OpenIgtLinkOptions& options, StreamScene scene, std::function<ForceSample()> force,
                       std::function<void(const IgtlReceived&)> on_transform)
    : state_(std::make_unique<State>(options, std::move(scene), std::move(force), std::move(on_transform))) {
  state_->thread = std::thread([this] { state_->run(); });
}

IgtlServer::~IgtlServer() {
  state_->stop = true;
  const uint64_t one = 1;
  if (write(state_->wake.get(), &one, sizeof one) < 0) state_->stop = true;  // it looks by itself in 0.1 s
  state_->thread.join();
}

void IgtlServer::publish(SharedFrame frame) {
  {
    const std::lock_guard lock(state_->newest_mutex);
    state_->newest = std::move(frame);
  }
  const uint64_t one = 1;
  if (write(state_->wake.get(), &one, sizeof one) < 0) return;  // it looks by itself in 0.1 s
}

IgtlServerCounts IgtlServer::counts() const {
  const std::lock_guard lock(state_->counts_mutex);
  IgtlServerCounts counts = state_->counts;
  std::vector<double> sorted = state_->latencies_ms;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&sorted](double fraction) {
    return sorted.empty() ? 0 : sorted[static_cast<size_t>(fraction * static_cast<double>(sorted.size() - 1))];
  };
  counts.latency_p50_ms = at(0.5);
  counts.latency_p99_ms = at(0.99);
  return counts;
}

}  // namespace palpate
