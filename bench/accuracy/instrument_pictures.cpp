#include "bench/accuracy/instrument_pictures.h"

#include <fmt/format.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace palpate::bench {
namespace {

const std::map<std::string, std::string> kFolders = {
    {"davinci", "davinci"}, {"endonerf", "endogaussian"}, {"super", "endogaussian"}, {"laparoscopic", "laparoscopic"}};
const cv::Rect kEndoNerf(0, 20, 640, 480), kSuper(0, 40, 640, 438);  // of the left half, without its title
constexpr int kRepeated = 5;  // a video of 63 frames shows each of them five times

cv::Mat frame_of(const std::filesystem::path& video, int index) {
  cv::VideoCapture capture(video.string());
  cv::Mat frame, read;
  for (int i = 0; i <= index && capture.read(read); ++i) frame = read.clone();
  return frame;
}

cv::Mat filled(const nlohmann::json& polygons, double scale, cv::Size size) {
  cv::Mat mask = cv::Mat::zeros(size, CV_8U);
  for (const auto& polygon : polygons) {
    std::vector<std::vector<cv::Point>> corners(1);
    for (const auto& p : polygon)
      corners[0].emplace_back(cvRound(scale * p[0].get<double>()), cvRound(scale * p[1].get<double>()));
    cv::fillPoly(mask, corners, 255);
  }
  return mask;
}

}  // namespace

std::vector<OutlinedPicture> read_outlined_pictures(const std::filesystem::path& folder) {
  std::ifstream stream(std::filesystem::path(PALPATE_SOURCE_DIR) / "bench/accuracy/instrument_outlines.json");
  const auto json = nlohmann::json::parse(stream);
  std::vector<OutlinedPicture> pictures;
  for (const auto& entry : json["pictures"]) {
    const std::string set = entry["set"];
    const std::filesystem::path file = folder / kFolders.at(set) / entry["picture"].get<std::string>();
    if (!std::filesystem::exists(file)) continue;
    OutlinedPicture picture;
    picture.set = set;
    picture.bgr = entry.contains("frame") ? frame_of(file, entry["frame"]) : cv::imread(file.string());
    if (picture.bgr.empty()) continue;
    cv::Rect crop({}, picture.bgr.size());
    if (entry.contains("crop")) crop = {entry["crop"][0], entry["crop"][1], entry["crop"][2], entry["crop"][3]};
    const double scale = crop.width / entry["width"].get<double>();
    const auto part = [&](const char* key) {
      return filled(entry.value(key, nlohmann::json::array()), scale, picture.bgr.size())(crop);
    };
    picture.truth = part("polygons") & ~part("holes");
    picture.judged = ~part("ignore");
    for (const auto& tip : entry["tips"])
      picture.tips.push_back(scale * cv::Point2d(tip[0], tip[1]) - cv::Point2d(crop.tl()));
    picture.bgr = picture.bgr(crop).clone();
    pictures.push_back(picture);
  }
  return pictures;
}

std::vector<RealVideo> read_real_videos(const std::filesystem::path& folder) {
  std::vector<RealVideo> videos;
  for (const char* name : {"pulling", "super_trial3", "super_trial4", "super_trial8", "super_trial9"}) {
    const auto file = folder / "endogaussian/docs/figures" / fmt::format("recon_{}_gt_vs_ours.mp4", name);
    if (!std::filesystem::exists(file)) continue;
    RealVideo video{name, {}};
    cv::VideoCapture capture(file.string());
    const bool pulling = video.name == "pulling";
    cv::Mat frame;
    for (int i = 0; capture.read(frame); ++i)
      if (i % (pulling ? kRepeated : 2) == 0) video.frames.push_back(frame(pulling ? kEndoNerf : kSuper).clone());
    videos.push_back(std::move(video));
  }
  return videos;
}

std::vector<ClickedPair> read_clicked_pairs(const std::filesystem::path& folder) {
  std::vector<ClickedPair> pairs;
  std::ifstream stream(folder / "thrust/clicks.json");
  if (!stream) return pairs;
  int number = 0;
  for (const auto& click : nlohmann::json::parse(stream)) {
    ++number;
    const auto picture = [&](const char* side) {
      return cv::imread(
          (folder / "thrust/50_images_15-Nov-17-59-04" / fmt::format("{}_{}.jpg", number, side)).string());
    };
    const cv::Point2d one(1, 1);
    pairs.push_back(
        {picture("L"), picture("R"), cv::Point2d(click[0], click[1]) - one, cv::Point2d(click[2], click[3]) - one});
    if (pairs.back().left.empty() || pairs.back().right.empty()) pairs.pop_back();
  }
  return pairs;
}

}  // namespace palpate::bench
