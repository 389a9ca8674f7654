// Listens to our topics as a node of ROS 2 does, with Fast DDS and no code of ours: prints a line for each message and
// ends with the first line of standard input.
#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;

namespace {

/// Every message that is listened to: stamp, frame, then numbers, or a format and bytes.
struct Message {
  int32_t sec = 0;
  uint32_t nanosec = 0;
  std::string frame_id, format;
  std::vector<double> numbers;
  std::vector<uint8_t> bytes;
};

class Type : public fast::TopicDataType {
 public:
  Type(const std::string& name, size_t numbers) : numbers_(numbers) {
    setName(name.c_str());
    m_typeSize = 1 << 20;
    m_isGetKeyDefined = false;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    auto& message = *static_cast<Message*>(data);
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
    Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    cdr >> message.sec >> message.nanosec >> message.frame_id;
    message.numbers.assign(numbers_, 0);
    for (double& number : message.numbers) cdr >> number;
    if (numbers_ == 0) cdr >> message.format >> message.bytes;
    return true;
  }
  bool serialize(void*, rtps::SerializedPayload_t*) override { return false; }
  std::function<uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return uint32_t{0}; };
  }
  void* createData() override { return new Message; }
  void deleteData(void* data) override { delete static_cast<Message*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }

 private:
  size_t numbers_;
};

std::mutex printing;

class Printer : public fast::DataReaderListener {
 public:
  explicit Printer(std::string name) : name_(std::move(name)) {}
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
    const std::lock_guard lock(printing);
    std::printf("%s %s\n", name_.c_str(), status.current_count_change > 0 ? "matched" : "gone");
    std::fflush(stdout);
  }
  void on_data_available(fast::DataReader* reader) override {
    Message message;
    fast::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(printing);
      std::printf("%s %d.%09u %s", name_.c_str(), message.sec, message.nanosec, message.frame_id.c_str());
      for (const double number : message.numbers) std::printf(" %.6g", number);
      if (!message.bytes.empty())
        std::printf(" %s %02x%02x %d", message.format.c_str(), message.bytes[0], message.bytes[1],
                    message.bytes.size() > 4);
      std::printf("\n");
      std::fflush(stdout);
    }
  }

 private:
  std::string name_;
};

}  // namespace

int main(int argc, char** argv) {
  const auto domain = static_cast<uint32_t>(argc > 1 ? std::stoul(argv[1]) : 0);
  auto* factory = fast::DomainParticipantFactory::get_instance();
  // As ROS_LOCALHOST_ONLY=1 has it.
  const auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  loopback->interfaceWhiteList = {"127.0.0.1"};
  fast::DomainParticipantQos participant_qos = fast::PARTICIPANT_QOS_DEFAULT;
  participant_qos.transport().use_builtin_transports = false;
  participant_qos.transport().user_transports = {loopback};
  auto* participant = factory->create_participant(domain, participant_qos);
  if (participant == nullptr) return 1;
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  struct Wanted {
    const char *topic, *type;
    size_t numbers;
    Printer printer;
  };
  std::vector<Wanted> all;
  all.push_back({"rt/palpate/PSM1/measured_cf", "geometry_msgs::msg::dds_::WrenchStamped_", 6, Printer("wrench")});
  all.push_back({"rt/palpate/PSM1/measured_cp", "geometry_msgs::msg::dds_::PoseStamped_", 7, Printer("pose")});
  all.push_back({"rt/palpate/PSM2/measured_cf", "geometry_msgs::msg::dds_::WrenchStamped_", 6, Printer("wrench_2")});
  all.push_back({"rt/palpate/overlay/compressed", "sensor_msgs::msg::dds_::CompressedImage_", 0, Printer("image")});
  for (Wanted& wanted : all) {
    fast::TypeSupport type(new Type(wanted.type, wanted.numbers));
    type.register_type(participant);
    auto* topic = participant->create_topic(wanted.topic, wanted.type, fast::TOPIC_QOS_DEFAULT);
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    if (topic == nullptr || subscriber->create_datareader(topic, qos, &wanted.printer) == nullptr) return 1;
  }
  std::string line;
  std::getline(std::cin, line);
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}
