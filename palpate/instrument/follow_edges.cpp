#include "palpate/instrument/follow_edges.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace palpate {
namespace {

constexpr int kReduced = 4;              // times smaller is the image on which the colours are learnt
constexpr double kNeighbourhood = 0.02;  // of the image's width, radius
constexpr float kNoise = 0.03F;          // of the square root of a colour from 0 to 1, that makes no edge
constexpr double kNear = 0.012;          // of the image's width, in which the picture decides
constexpr float kMinProbability = 0.1F;

/// Colours whose noise is about the same in the dark and in the light.
cv::Mat guide_of(const cv::Mat& bgr) {
  cv::Mat guide;
  bgr.convertTo(guide, CV_32F, 1.0 / 255);
  cv::sqrt(guide, guide);
  return guide;
}

cv::Mat averaged(const cv::Mat& values, int radius) {
  cv::Mat result;
  cv::blur(values, result, {2 * radius + 1, 2 * radius + 1}, {-1, -1}, cv::BORDER_REPLICATE);
  return result;
}

/// For every pixel blue's, green's and red's factor and the constant of the linear function of colour that comes
/// nearest to `target` around it.
cv::Mat local_functions(const cv::Mat& guide, const cv::Mat& target, int radius) {
  cv::Mat products(guide.size(), CV_32FC(9));  // of colours with colours, and with the target
  for (int y = 0; y < guide.rows; ++y)
    for (int x = 0; x < guide.cols; ++x) {
      const cv::Vec3f& c = guide.at<cv::Vec3f>(y, x);
      const float t = target.at<float>(y, x);
      float* p = products.ptr<float>(y) + 9 * x;
      p[0] = c[0] * c[0], p[1] = c[0] * c[1], p[2] = c[0] * c[2], p[3] = c[1] * c[1], p[4] = c[1] * c[2];
      p[5] = c[2] * c[2], p[6] = c[0] * t, p[7] = c[1] * t, p[8] = c[2] * t;
    }
  std::vector<cv::Mat> planes;
  cv::split(products, planes);
  for (cv::Mat& plane : planes) plane = averaged(plane, radius);
  const cv::Mat mean = averaged(guide, radius), mean_target = averaged(target, radius);
  cv::Mat functions(guide.size(), CV_32FC4);
  for (int y = 0; y < guide.rows; ++y)
    for (int x = 0; x < guide.cols; ++x) {
      const cv::Vec3f& m = mean.at<cv::Vec3f>(y, x);
      const float t = mean_target.at<float>(y, x);
      const auto at = [&](size_t plane) { return planes[plane].at<float>(y, x); };
      Eigen::Matrix3f covariance;
      covariance << at(0) - m[0] * m[0], at(1) - m[0] * m[1], at(2) - m[0] * m[2], 0, at(3) - m[1] * m[1],
          at(4) - m[1] * m[2], 0, 0, at(5) - m[2] * m[2];
      covariance(1, 0) = covariance(0, 1), covariance(2, 0) = covariance(0, 2), covariance(2, 1) = covariance(1, 2);
      covariance.diagonal().array() += kNoise * kNoise;
      const Eigen::Vector3f with_target(at(6) - m[0] * t, at(7) - m[1] * t, at(8) - m[2] * t);
      const Eigen::Vector3f a = covariance.inverse() * with_target;
      functions.at<cv::Vec4f>(y, x) = {a[0], a[1], a[2], t - a[0] * m[0] - a[1] * m[1] - a[2] * m[2]};
    }
  return averaged(functions, radius);
}

/// The part of the image in which anything is likely, with a margin.
cv::Rect likely_part(const cv::Mat& probability, cv::Size image, int margin) {
  const cv::Rect box = cv::boundingRect(cv::Mat(probability > kMinProbability));
  if (box.area() == 0) return {};
  const double x = 1.0 * image.width / probability.cols, y = 1.0 * image.height / probability.rows;
  const cv::Point from(static_cast<int>(box.x * x) - margin, static_cast<int>(box.y * y) - margin);
  const cv::Point to(static_cast<int>(box.br().x * x) + margin + 1, static_cast<int>(box.br().y * y) + margin + 1);
  return cv::Rect(from, to) & cv::Rect({}, image);
}

}  // namespace

cv::Mat follow_edges(const cv::Mat& bgr, const cv::Mat& probability) {
  cv::Mat result = cv::Mat::zeros(bgr.size(), CV_8U);
  const int radius = std::max(2, cvRound(kNeighbourhood * bgr.cols / kReduced));
  const cv::Rect part = likely_part(probability, bgr.size(), 2 * radius * kReduced);
  if (part.area() == 0) return result;
  const cv::Size reduced(std::max(1, part.width / kReduced), std::max(1, part.height / kReduced));

  cv::Mat whole, small, target, functions;
  cv::resize(probability, whole, bgr.size(), 0, 0, cv::INTER_LINEAR);
  const cv::Mat coarse = whole(part);
  cv::resize(bgr(part), small, reduced, 0, 0, cv::INTER_AREA);
  cv::resize(coarse, target, reduced, 0, 0, cv::INTER_AREA);
  cv::resize(local_functions(guide_of(small), target, radius), functions, part.size(), 0, 0, cv::INTER_LINEAR);

  const int near = std::max(1, cvRound(kNear * bgr.cols));
  const cv::Mat kernel = cv::Mat::ones(2 * near + 1, 2 * near + 1, CV_8U);
  cv::Mat inside, outside;
  const cv::Mat sure = coarse > 0.5;
  cv::erode(sure, inside, kernel, {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::dilate(sure, outside, kernel, {-1, -1}, 1, cv::BORDER_REPLICATE);
  std::array<float, 256> root{};
  for (size_t i = 0; i < root.size(); ++i) root[i] = std::sqrt(static_cast<float>(i) / 255);
  for (int y = 0; y < part.height; ++y) {
    const cv::Vec3b* colours = bgr.ptr<cv::Vec3b>(y + part.y) + part.x;
    const cv::Vec4f* function = functions.ptr<cv::Vec4f>(y);
    const uchar *in = inside.ptr<uchar>(y), *out = outside.ptr<uchar>(y);
    uchar* to = result.ptr<uchar>(y + part.y) + part.x;
    for (int x = 0; x < part.width; ++x) {
      if (!out[x]) continue;
      const cv::Vec3b& c = colours[x];
      const cv::Vec4f& f = function[x];
      const float linear = f[0] * root[c[0]] + f[1] * root[c[1]] + f[2] * root[c[2]] + f[3];
      to[x] = in[x] ? 255 : cv::saturate_cast<uchar>(255 * linear);
    }
  }
  return result;
}

}  // namespace palpate
