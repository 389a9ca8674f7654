#include "palpate/stream/ros2_publisher.h"

#include <dds/dds.h>
#include <fmt/format.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <thread>
#include <utility>

#include "palpate/core/errors.h"
#include "ros2_messages.h"

namespace palpate {

namespace {

constexpr double kMetres = 1e-3;
constexpr int kHistory = 10;
constexpr int kJpegQuality = 85;

/// On loopback not every node hears multicast: those of this machine are also asked one by one.
std::string domain_settings(const std::string& interface) {
  const bool is_loopback = interface == "127.0.0.1" || interface == "lo";
  const bool is_name = interface.find_first_not_of("0123456789.") != std::string::npos;
  const std::string peers = is_loopback
                                ? "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30"
                                  "</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>"
                                : "";
  return fmt::format(
      "<CycloneDDS><Domain><General><Interfaces><NetworkInterface {}=\"{}\"{}/></Interfaces><AllowMulticast>{}"
      "</AllowMulticast></General>{}</Domain></CycloneDDS>",
      is_name ? "name" : "address", interface, is_loopback ? " multicast=\"true\"" : "", is_loopback ? "spdp" : "true",
      peers);
}

/// A topic and its one writer.
dds_entity_t writer_of(dds_entity_t participant, const dds_topic_descriptor_t& type, const std::string& topic) {
  dds_qos_t* qos = dds_create_qos();
  // A writer that waits for nobody, whose data outlive no writer.
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kHistory);
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_writer_data_lifecycle(qos, false);
  const dds_entity_t of = dds_create_topic(participant, &type, ("rt/" + topic).c_str(), qos, nullptr);
  const dds_entity_t writer = of < 0 ? of : dds_create_writer(participant, of, qos, nullptr);
  dds_delete_qos(qos);
  if (writer < 0)
    throw BadInput(fmt::format("streams.ros2: topic '{}' cannot be made ({}), expected a name as palpate/PSM1", topic,
                               dds_strretcode(writer)));
  return writer;
}

geometry_msgs_msg_dds__Vector3_ to_vector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

namespace {

/// What one instrument feels and where it is, and whether the last message of each was one to be used.
struct Writers {
  dds_entity_t force = 0, tip = 0;
  bool force_sent = false, tip_sent = false;
};

}  // namespace

struct Ros2Publisher::State {
  Ros2Options options;
  dds_entity_t domain = 0, participant = 0, overlay = 0;
  std::array<Writers, 2> instruments;
  int64_t next_overlay_ns = 0;

  std::mutex newest_mutex;  // held only to swap a pointer
  std::condition_variable newest_came;
  SharedFrame newest;
  bool stop = false;
  std::atomic<uint64_t> messages{0};
  std::thread thread;

  explicit State(const Ros2Options& o) : options(o) {
    const auto number = static_cast<dds_domainid_t>(options.domain);
    domain = dds_create_domain(number, domain_settings(options.interface).c_str());
    participant = domain < 0 ? domain : dds_create_participant(number, nullptr, nullptr);
    if (participant < 0) {
      const std::string reason = dds_strretcode(participant);
      close();
      throw BadInput(
          fmt::format("streams.ros2: no ROS 2 on interface '{}', domain {} ({}), expected an interface of "
                      "this machine, as 127.0.0.1 or eth0",
                      options.interface, options.domain, reason));
    }
    try {
      for (size_t i = 0; i < instruments.size(); ++i) {
        const std::string& prefix = i == 0 ? options.prefix : options.prefix_2;
        instruments[i].force =
            writer_of(participant, geometry_msgs_msg_dds__WrenchStamped__desc, prefix + "/measured_cf");
        instruments[i].tip = writer_of(participant, geometry_msgs_msg_dds__PoseStamped__desc, prefix + "/measured_cp");
      }
      overlay = writer_of(participant, sensor_msgs_msg_dds__CompressedImage__desc, "palpate/overlay/compressed");
    } catch (const BadInput&) {
      close();
      throw;
    }
  }
  ~State() { close(); }

  void close() {
    if (participant > 0) dds_delete(participant);
    if (domain > 0) dds_delete(domain);
    participant = domain = 0;
  }

  /// `wall_ns` 0: not to be used.
  std_msgs_msg_dds__Header_ header(int64_t wall_ns) {
    return {{static_cast<int32_t>(wall_ns / 1'000'000'000), static_cast<uint32_t>(wall_ns % 1'000'000'000)},
            options.camera_frame.data()};
  }

  void write(dds_entity_t writer, const void* message) {
    if (dds_write(writer, message) == DDS_RETCODE_OK) messages.fetch_add(1, std::memory_order_relaxed);
  }

  void send(const StreamFrame& frame) {
    for (int i = 0; i < frame.instruments; ++i) send(frame, estimate_of(frame, i), instruments[static_cast<size_t>(i)]);
    if (!frame.overlay.empty() && options.overlay_hz > 0 && frame.decoded_ns >= next_overlay_ns) send_overlay(frame);
  }

  void send(const StreamFrame& frame, const ForceEstimate& e, Writers& writers) {
    const bool force_known = has_force(e), tip_known = has_tip(e);
    if (const bool was_sent = std::exchange(writers.force_sent, force_known); force_known || was_sent) {
      geometry_msgs_msg_dds__WrenchStamped_ message{};
      message.header = header(force_known ? frame.wall_ns : 0);
      if (force_known) message.wrench.force = to_vector(e.force_N);
      write(writers.force, &message);
    }
    if (const bool was_sent = std::exchange(writers.tip_sent, tip_known); tip_known || was_sent) {
      geometry_msgs_msg_dds__PoseStamped_ message{};
      message.header = header(tip_known ? frame.wall_ns : 0);
      message.pose.orientation.w = 1;
      if (tip_known) message.pose.position = {kMetres * e.tip_mm.x(), kMetres * e.tip_mm.y(), kMetres * e.tip_mm.z()};
      write(writers.tip, &message);
    }
  }

  void send_overlay(const StreamFrame& frame) {
    next_overlay_ns = frame.decoded_ns + static_cast<int64_t>(0.9e9 / options.overlay_hz);
    std::vector<unsigned char> jpeg;
    cv::imencode(".jpg", frame.overlay, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
    sensor_msgs_msg_dds__CompressedImage_ message{};
    message.header = header(frame.wall_ns);
    std::string format = "jpeg";
    message.format = format.data();
    message.data._buffer = jpeg.data();
    message.data._length = message.data._maximum = static_cast<uint32_t>(jpeg.size());
    write(overlay, &message);
  }

  void run() {
    pthread_setname_np(pthread_self(), "palpate-ros2");
    while (true) {
      SharedFrame frame;
      {
        std::unique_lock lock(newest_mutex);
        newest_came.wait(lock, [this] { return stop || newest; });
        if (stop) return;
        frame = std::exchange(newest, nullptr);
      }
      send(*frame);
    }
  }
};

Ros2Publisher::Ros2Publisher(const Ros2Options& options) : state_(std::make_unique<State>(options)) {
  state_->thread = std::thread([this] { state_->run(); });
}

Ros2Publisher::~Ros2Publisher() {
  {
    const std::lock_guard lock(state_->newest_mutex);
    state_->stop = true;
  }
  state_->newest_came.notify_one();
  state_->thread.join();
}

void Ros2Publisher::publish(SharedFrame frame) {
  {
    const std::lock_guard lock(state_->newest_mutex);
    state_->newest = std::move(frame);
  }
  state_->newest_came.notify_one();
}

uint64_t Ros2Publisher::messages() const {
  return state_->messages.load();
}

}  // namespace palpate
