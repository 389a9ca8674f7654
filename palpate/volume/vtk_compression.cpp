#include "palpate/volume/vtk_compression.h"

#include <fmt/format.h>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <bit>
#include <cstdint>
#include <vector>

#include "palpate/core/errors.h"
#include "palpate/volume/mesh_bytes.h"

namespace palpate {

namespace {

/// No organ's mesh has an array of more, and a file that says so is broken.
constexpr uint64_t kLargestArray_bytes = uint64_t{1} << 31;

/// No data, not even zeros alone, are packed into less.
constexpr uint64_t kMaxPacking = 10000;

uint64_t header_number(MeshBytes& bytes, size_t header_bytes, bool swapped) {
  return header_bytes == 8 ? bytes.binary<uint64_t>(swapped) : bytes.binary<uint32_t>(swapped);
}

bool inflate_block(std::string_view packed, const std::string& compressor, char* out, size_t size) {
  if (compressor == "vtkZLibDataCompressor") {
    uLongf length = size;
    return uncompress(reinterpret_cast<Bytef*>(out), &length, reinterpret_cast<const Bytef*>(packed.data()),
                      packed.size()) == Z_OK &&
           length == size;
  }
  if (compressor == "vtkLZ4DataCompressor")
    return LZ4_decompress_safe(packed.data(), out, static_cast<int>(packed.size()), static_cast<int>(size)) ==
           static_cast<int>(size);
  if (compressor == "vtkLZMADataCompressor") {
    uint64_t memory = uint64_t{1} << 28;  // four times what its strongest preset asks for
    size_t read = 0, written = 0;
    return lzma_stream_buffer_decode(&memory, 0, nullptr, reinterpret_cast<const uint8_t*>(packed.data()), &read,
                                     packed.size(), reinterpret_cast<uint8_t*>(out), &written, size) == LZMA_OK &&
           written == size;
  }
  throw BadInput(fmt::format("data compressed by {}, expected zlib, lz4 or lzma", compressor));
}

}  // namespace

std::string from_base64(std::string_view text) {
  std::string bytes;
  uint32_t group = 0;
  int digits = 0, padding = 0;
  for (char c : text) {
    if (std::isspace(static_cast<unsigned char>(c))) continue;
    int value = 0;
    if (c >= 'A' && c <= 'Z')
      value = c - 'A';
    else if (c >= 'a' && c <= 'z')
      value = c - 'a' + 26;
    else if (c >= '0' && c <= '9')
      value = c - '0' + 52;
    else if (c == '+' || c == '/')
      value = c == '+' ? 62 : 63;
    else if (c == '=')
      ++padding;
    else
      break;
    group = group << 6 | static_cast<uint32_t>(value);
    if (++digits < 4) continue;
    for (int k = 0; k < 3 - padding; ++k) bytes += static_cast<char>(group >> (16 - 8 * k) & 255);
    group = 0;
    digits = padding = 0;
  }
  return bytes;
}

std::string unpacked(std::string_view bytes, const std::string& compressor, size_t header_bytes, bool big_endian) {
  const bool swapped = big_endian != (std::endian::native == std::endian::big);
  MeshBytes in(bytes);
  const uint64_t first = header_number(in, header_bytes, swapped);
  if (compressor.empty()) return std::string(in.take(first));
  // first is the number of blocks; then come the size of a whole one, of the last one, and of each when packed.
  const uint64_t block = header_number(in, header_bytes, swapped), last = header_number(in, header_bytes, swapped);
  if (first > in.left() || block > kLargestArray_bytes || last > block || first * block > kLargestArray_bytes)
    throw BadInput("the header of an array is broken");
  std::vector<uint64_t> packed_sizes(first);
  for (uint64_t& size : packed_sizes) size = header_number(in, header_bytes, swapped);
  std::string result;
  for (size_t i = 0; i < packed_sizes.size(); ++i) {
    const size_t size = i + 1 == packed_sizes.size() && last > 0 ? last : block;
    const std::string_view packed = in.take(packed_sizes[i]);
    if (size > kMaxPacking * packed.size() + 4096) throw BadInput("the header of an array is broken");
    result.resize(result.size() + size);
    if (!inflate_block(packed, compressor, result.data() + result.size() - size, size))
      throw BadInput("compressed data are broken");
  }
  return result;
}

}  // namespace palpate
