#include "palpate/instrument/onnx_header.h"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>

namespace palpate {
namespace {

/// One field of a protocol buffer message.
struct Field {
  int number = 0;
  uint64_t value = 0;      ///< of a variable-length integer
  std::string_view bytes;  ///< of a text or a message
};

/// The fields of a message, one after the other; stops at what is malformed.
class Message {
 public:
  explicit Message(std::string_view bytes) : rest_(bytes) {}

  std::optional<Field> next() {
    const auto key = varint();
    if (!key) return {};
    Field field;
    field.number = static_cast<int>(*key >> 3);
    switch (*key & 7) {
      case 0:
        if (const auto value = varint()) return field.value = *value, field;
        return {};
      case 1:
        return skipped(8, field);
      case 2:
        if (const auto length = varint()) return skipped(*length, field);
        return {};
      case 5:
        return skipped(4, field);
      default:
        return {};
    }
  }

 private:
  std::optional<uint64_t> varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      value |= static_cast<uint64_t>(byte & 127) << shift;
      if (byte < 128) return value;
    }
    return {};
  }

  std::optional<Field> skipped(uint64_t length, Field field) {
    if (length > rest_.size()) return {};
    field.bytes = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return field;
  }

  std::string_view rest_;
};

/// The fields' names and numbers are those of onnx.proto.
constexpr int kModelGraph = 7, kGraphNode = 1, kGraphInitializer = 5, kGraphInput = 11;
constexpr int kNodeOperation = 4, kTensorName = 8, kValueName = 1, kValueType = 2;
constexpr int kTypeTensor = 1, kTensorShape = 2, kShapeDimension = 1, kDimensionValue = 1;

/// The first field of this number.
std::string_view part(std::string_view message, int number) {
  Message fields(message);
  while (const auto field = fields.next())
    if (field->number == number) return field->bytes;
  return {};
}

std::vector<int> dimensions(std::string_view value_info) {
  const std::string_view shape = part(part(part(value_info, kValueType), kTypeTensor), kTensorShape);
  std::vector<int> result;
  Message fields(shape);
  while (const auto field = fields.next()) {
    if (field->number != kShapeDimension) continue;
    int size = 0;
    Message dimension(field->bytes);
    while (const auto entry = dimension.next())
      if (entry->number == kDimensionValue && entry->value < 100000) size = static_cast<int>(entry->value);
    result.push_back(size);
  }
  return result;
}

}  // namespace

OnnxHeader read_onnx_header(std::string_view bytes) {
  OnnxHeader header;
  std::set<std::string_view> initializers;
  std::vector<std::string_view> inputs;
  Message graph(part(bytes, kModelGraph));
  while (const auto field = graph.next()) {
    if (field->number == kGraphNode) header.last_operation = part(field->bytes, kNodeOperation);
    if (field->number == kGraphInitializer) initializers.insert(part(field->bytes, kTensorName));
    if (field->number == kGraphInput) inputs.push_back(field->bytes);
  }
  for (const std::string_view& input : inputs)
    if (!initializers.count(part(input, kValueName))) {
      header.input = dimensions(input);
      break;
    }
  return header;
}

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace palpate
