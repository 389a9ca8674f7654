#include "palpate/estimate/tissue_labels.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

void check_label(const TissueLabel& label) {
  if (label.region_px.empty() == label.mask.empty())
    throw BadInput(fmt::format("map.labels: '{}' has {} region_px and mask, expected one of them", label.name,
                               label.mask.empty() ? "neither" : "both"));
}

/// 255 where the label is.
cv::Mat region_of(const TissueLabel& label, cv::Size image_size) {
  if (label.mask.empty()) {
    cv::Mat region(image_size, CV_8U, cv::Scalar(0));
    const std::vector<cv::Point> corners(label.region_px.begin(), label.region_px.end());
    cv::fillPoly(region, std::vector<std::vector<cv::Point>>{corners}, cv::Scalar(255));
    return region;
  }
  if (const std::string obstacle = obstacle_to_reading(label.mask); !obstacle.empty())
    throw BadInput(fmt::format("map.labels: mask {} of '{}' {}", label.mask.string(), label.name, obstacle));
  const cv::Mat mask = cv::imread(label.mask.string(), cv::IMREAD_GRAYSCALE);
  if (mask.empty())
    throw BadInput(fmt::format("map.labels: mask {} of '{}' is no image", label.mask.string(), label.name));
  if (mask.size() != image_size)
    throw BadInput(fmt::format("map.labels: mask {} of '{}' has {}x{} px, expected those of the left image, {}x{}",
                               label.mask.string(), label.name, mask.cols, mask.rows, image_size.width,
                               image_size.height));
  return mask > 0;
}

}  // namespace

void describe(Settings& map, std::vector<TissueLabel>& labels) {
  map.list(
      "labels", "parts of the organ with a stiffness of their own; of several that overlap the last one holds",
      [&labels] { return static_cast<int>(labels.size()); },
      [&labels](int count) { labels.assign(static_cast<size_t>(count), {}); },
      [&labels](Settings& item, int i) {
        TissueLabel& label = labels[static_cast<size_t>(i)];
        item.text("name", label.name, "of the tissue");
        item.polygon("region_px", label.region_px,
                     "its outline in the left image as recorded; holds through the whole depth");
        item.path("mask", label.mask, "instead of the outline: an image of the same size, not black where it is");
        item.group("tissue", "its constants; the law is that of the scene's tissue", [&label](Settings& group) {
          group.number("young_modulus_kPa", label.tissue.young_modulus_kPa, {0, 1e8, true, false}, "Young's modulus E");
          group.number("poisson_ratio", label.tissue.poisson_ratio, {0, 0.5, false, true}, "Poisson's ratio nu");
          group.require("young_modulus_kPa");
        });
        item.require("name");
        item.require("tissue");
        item.after_reading([&label] { check_label(label); });
      });
}

void assign_labels(TetMesh& mesh, const std::vector<TissueLabel>& labels, cv::Size image_size,
                   const std::function<cv::Point2d(const Vec3&)>& project_px) {
  mesh.label.assign(mesh.tetrahedra.size(), 0);
  if (labels.empty()) return;
  std::vector<cv::Point> pixels;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    Vec3 middle = Vec3::Zero();
    for (int node : t) middle += mesh.nodes_mm[static_cast<size_t>(node)] / 4;
    pixels.push_back(middle.z() > 0 ? cv::Point(project_px(middle)) : cv::Point(-1, -1));
  }
  const cv::Rect image({0, 0}, image_size);
  for (size_t k = 0; k < labels.size(); ++k) {
    const cv::Mat region = region_of(labels[k], image_size);
    int elements = 0;
    for (size_t e = 0; e < pixels.size(); ++e) {
      if (!image.contains(pixels[e]) || region.at<uchar>(pixels[e]) == 0) continue;
      mesh.label[e] = static_cast<int>(k) + 1;
      ++elements;
    }
    if (elements == 0)
      throw BadInput(
          fmt::format("map.labels: no tissue lies behind the region of '{}', expected a part of the organ in the left "
                      "image",
                      labels[k].name));
  }
}

}  // namespace palpate
