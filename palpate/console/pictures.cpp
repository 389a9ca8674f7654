#include "palpate/console/pictures.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"
#include "palpate/stereo/frame_source.h"

namespace palpate {

std::string jpeg_of(const cv::Mat& bgr, int width_px, int quality) {
  cv::Mat shown = bgr;
  if (width_px > 0 && width_px < bgr.cols)
    cv::resize(bgr, shown, {width_px, std::max(1, bgr.rows * width_px / bgr.cols)}, 0, 0, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", shown, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return {bytes.begin(), bytes.end()};
}

std::string png_of(const cv::Mat& bgr) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", bgr, bytes);
  return {bytes.begin(), bytes.end()};
}

cv::Mat first_picture(const std::filesystem::path& file) {
  cv::Mat picture = cv::haveImageReader(file.string()) ? cv::imread(file.string()) : cv::Mat();
  if (picture.empty())
    if (std::optional<FrameSource::Frame> frame = open_frame_source(file, file.filename().string(), 0)->next())
      picture = frame->image;
  if (picture.empty()) throw BadInput(fmt::format("{} shows no picture", file.filename().string()));
  return picture;
}

}  // namespace palpate
