#include "palpate/stereo/quiet_opencv.h"

#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>

namespace palpate {

namespace logging = cv::utils::logging;

QuietOpenCv::QuietOpenCv() : before_(logging::setLogLevel(logging::LOG_LEVEL_SILENT)) {
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

QuietOpenCv::~QuietOpenCv() {
  logging::setLogLevel(static_cast<logging::LogLevel>(before_));
}

}  // namespace palpate
