#include "palpate/stereo/interlacing.h"

namespace palpate {

cv::Mat deinterlaced(const cv::Mat& image) {
  cv::Mat result = image.clone();
  for (int y = 1; y < image.rows; y += 2) {
    cv::Mat row = result.row(y);
    if (y + 1 < image.rows)
      cv::addWeighted(image.row(y - 1), 0.5, image.row(y + 1), 0.5, 0, row);
    else
      image.row(y - 1).copyTo(row);
  }
  return result;
}

}  // namespace palpate
