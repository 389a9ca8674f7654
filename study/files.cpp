#include "study/files.h"

#include <fstream>
#include <iterator>

#include "palpate/core/errors.h"

namespace palpate::study {

std::string data_uri(const std::filesystem::path& file, const std::string& type) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return "";
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:" + type + ";base64,";
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&bytes, i](size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i + k])) : 0U;
    };
    const unsigned word = byte(0) << 16 | byte(1) << 8 | byte(2);
    text += kDigits[word >> 18];
    text += kDigits[word >> 12 & 63];
    text += i + 1 < bytes.size() ? kDigits[word >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? kDigits[word & 63] : '=';
  }
  return text;
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw Unfinished(file.string() + ": cannot be written");
}

}  // namespace palpate::study
