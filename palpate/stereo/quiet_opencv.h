#pragma once

namespace palpate {

/// While one of these lives, OpenCV and FFmpeg do not tell on stderr of every attempt to open a file; the sentences of
/// our own exceptions say what matters.
class QuietOpenCv {
 public:
  QuietOpenCv();
  ~QuietOpenCv();
  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;

 private:
  int before_;
};

}  // namespace palpate
