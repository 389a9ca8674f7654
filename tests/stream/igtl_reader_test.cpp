#include "palpate/stream/igtl_reader.h"

#include <gtest/gtest.h>
#include <igtlStatusMessage.h>
#include <igtlTransformMessage.h>
#include <igtl_util.h>

#include "palpate/stream/igtl_messages.h"
#include "tests/stream/samples.h"

namespace palpate {
namespace {

std::vector<uint8_t> bytes_of(igtl::MessageBase& message) {
  message.Pack();
  const auto* bytes = static_cast<const uint8_t*>(message.GetPackPointer());
  return {bytes, bytes + message.GetPackSize()};
}

std::vector<uint8_t> transform(float x) {
  const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  message->SetDeviceName("Tracker");
  igtl::Matrix4x4 matrix = {{0, -1, 0, x}, {1, 0, 0, 2}, {0, 0, 1, 3}, {0, 0, 0, 1}};
  message->SetMatrix(matrix);
  return bytes_of(*message);
}

/// The same as a program of protocol version 2 or 3 sends it: an extended header before the matrix, metadata after it.
std::vector<uint8_t> as_version_2(std::vector<uint8_t> message) {
  const std::vector<uint8_t> extended = {0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, metadata = {0, 1, 2, 3, 4};
  message.insert(message.begin() + 58, extended.begin(), extended.end());
  message.insert(message.end(), metadata.begin(), metadata.end());
  message[1] = 2;
  const uint64_t size = message.size() - 58, crc = crc64(message.data() + 58, size, 0);
  for (size_t i = 0; i < 8; ++i) {
    message[42 + i] = static_cast<uint8_t>(size >> (56 - 8 * i));
    message[50 + i] = static_cast<uint8_t>(crc >> (56 - 8 * i));
  }
  return message;
}

void append(std::vector<uint8_t>& to, const std::vector<uint8_t>& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

std::vector<IgtlReceived> read_in_pieces(const std::vector<uint8_t>& bytes, size_t piece, bool& good) {
  IgtlReader reader;
  std::vector<IgtlReceived> all;
  good = true;
  for (size_t at = 0; at < bytes.size() && good; at += piece)
    good = reader.read({bytes.data() + at, std::min(piece, bytes.size() - at)},
                       [&all](const IgtlReceived& message) { all.push_back(message); });
  return all;
}

TEST(IgtlReader, UnderstandsMessagesInWhateverPiecesTheyCome) {
  std::vector<uint8_t> bytes = transform(1);
  append(bytes, *igtl_status(true, "a status of another program"));
  append(bytes, *igtl_overlay(*test::frame_of(test::touching()), test::small_scene()));
  append(bytes, as_version_2(transform(5)));
  append(bytes, transform(9));
  for (size_t piece : {1UL, 7UL, 58UL, 59UL, 4096UL, bytes.size()}) {
    bool good = false;
    const auto all = read_in_pieces(bytes, piece, good);
    ASSERT_TRUE(good);
    ASSERT_EQ(all.size(), 5U) << piece;
    EXPECT_EQ(all[0].type, "TRANSFORM");
    EXPECT_EQ(all[0].device, "Tracker");
    EXPECT_EQ(all[0].translation_mm, Vec3(1, 2, 3));
    EXPECT_EQ(all[0].rotation.row(0), Eigen::RowVector3d(0, -1, 0));
    EXPECT_EQ(all[1].type, "STATUS");
    EXPECT_EQ(all[2].type, "IMAGE");
    EXPECT_EQ(all[3].translation_mm, Vec3(5, 2, 3));
    EXPECT_EQ(all[4].translation_mm, Vec3(9, 2, 3));
  }
}

TEST(IgtlReader, LeavesOutATransformWhoseChecksumIsWrong) {
  std::vector<uint8_t> bytes = transform(1);
  bytes[80] ^= 1;
  append(bytes, transform(2));
  bool good = false;
  const auto all = read_in_pieces(bytes, 64, good);
  EXPECT_TRUE(good);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].translation_mm.x(), 2);
}

TEST(IgtlReader, SkipsABodyOfAnySizeWithoutKeepingIt) {
  std::vector<uint8_t> bytes = *igtl_status(true, "");
  bytes.resize(58);
  bytes[42] = 0x7f;  // nine million terabytes
  IgtlReader reader;
  const std::vector<uint8_t> body(1 << 16, 0);
  const auto nothing = [](const IgtlReceived&) { FAIL(); };
  ASSERT_TRUE(reader.read(bytes, nothing));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(reader.read(body, nothing));
}

TEST(IgtlReader, GivesUpOnWhatIsNoOpenIgtLink) {
  const std::string http = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUser-Agent: something long enough\r\n\r\n";
  bool good = true;
  read_in_pieces({http.begin(), http.end()}, 10, good);
  EXPECT_FALSE(good);
}

}  // namespace
}  // namespace palpate
