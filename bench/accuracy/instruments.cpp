#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "bench/accuracy/instrument_pictures.h"
#include "palpate/core/quantile.h"
#include "palpate/instrument/instrument_finder.h"
#include "palpate/instrument/way_choice.h"
#include "palpate/stereo/recording.h"

// How well instruments are found, goal beside measured: `bench_instruments [WAY ...] [--view FOLDER]` with the ways
// learned and colour, or a network's file. Real pictures are read from the folder that PALPATE_INSTRUMENT_PICTURES
// names, recordings with truth from PALPATE_REFERENCE_DATA; what is missing is skipped with a sentence.
namespace {

using namespace palpate;
using namespace palpate::bench;
namespace fs = std::filesystem;

constexpr double kTipWidth_px = 675;  // width of the pictures in which tip errors are given
const char* const kWithoutTool[] = {"scared_keyframe/left.png", "hamlyn_heart/f7_dynamic_deint_L_0100.png"};

struct Bench {
  std::string way;
  fs::path pictures, reference, view;

  InstrumentOptions options() const {
    InstrumentOptions result;
    result.segmentation = way;
    return result;
  }
};

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

void row(const Bench& bench, const std::string& what, const std::string& goal, const std::string& measured) {
  fmt::print("| {} | {} | {} | {} |\n", bench.way, what, goal, measured);
  std::fflush(stdout);
}

/// A single picture has no static frame before it: what the colours find in such a frame itself.
cv::Mat mask_of_one(const Bench& bench, const cv::Mat& bgr) {
  if (bench.way == "colour") return learn_segmentation(bgr, {}).reference_mask;
  return InstrumentFinder(bench.options(), bgr, {}).find(bgr).mask;
}

void save_view(const Bench& bench, const std::string& name, const cv::Mat& bgr, const cv::Mat& mask,
               const std::vector<ImageInstrument>& found) {
  if (bench.view.empty()) return;
  cv::Mat picture = bgr.clone();
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(mask, outlines, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  cv::drawContours(picture, outlines, -1, {60, 220, 60}, 2);
  for (const ImageInstrument& i : found) {
    cv::line(picture, i.tip.tip_px, i.tip.tip_px - 3 * i.tip.width_px * i.tip.axis, {0, 220, 255}, 2);
    cv::circle(picture, i.tip.tip_px, 8, {0, 220, 255}, 2);
  }
  fs::create_directories(bench.view);
  cv::imwrite((bench.view / (name + ".jpg")).string(), picture);
}

/// The distance of a tip from the nearest that was found, px at kTipWidth_px, unless it is far from all.
void add_nearest(const std::vector<ImageInstrument>& found, const cv::Point2d& tip_px, int width_px,
                 std::vector<double>& distances_px) {
  double nearest = 1e9;
  for (const ImageInstrument& i : found) nearest = std::min(nearest, cv::norm(i.tip.tip_px - tip_px));
  nearest *= kTipWidth_px / width_px;
  if (nearest < 0.15 * kTipWidth_px) distances_px.push_back(nearest);
}

void outlined(const Bench& bench) {
  struct Figures {
    std::vector<double> overlap, precision, recall, tip_px;
    std::vector<double> tip_of_outline_px;  // where the mask is as drawn by eye
    int tips = 0;
  };
  std::map<std::string, Figures> sets;
  int number = 0;
  for (const OutlinedPicture& picture : read_outlined_pictures(bench.pictures)) {
    const cv::Mat mask = mask_of_one(bench, picture.bgr);
    const auto found = find_instruments(mask, find_picture_area(picture.bgr));
    const auto count = [&](const cv::Mat& m) { return 1.0 * cv::countNonZero(m & picture.judged); };
    Figures& figures = sets[picture.set];
    figures.overlap.push_back(count(mask & picture.truth) / std::max(1.0, count(mask | picture.truth)));
    figures.precision.push_back(count(mask & picture.truth) / std::max(1.0, count(mask)));
    figures.recall.push_back(count(mask & picture.truth) / std::max(1.0, count(picture.truth)));
    const auto of_outline = find_instruments(picture.truth, find_picture_area(picture.bgr));
    figures.tips += static_cast<int>(picture.tips.size());
    for (const cv::Point2d& tip : picture.tips) {
      add_nearest(found, tip, picture.bgr.cols, figures.tip_px);
      add_nearest(of_outline, tip, picture.bgr.cols, figures.tip_of_outline_px);
    }
    save_view(bench, fmt::format("outline_{}_{:02d}", picture.set, number), picture.bgr, picture.truth, of_outline);
    save_view(bench, fmt::format("{}_{:02d}", picture.set, number++), picture.bgr, mask, found);
  }
  if (sets.empty()) fmt::print("No outlined pictures: PALPATE_INSTRUMENT_PICTURES names no folder that holds them.\n");
  std::vector<double> overlaps;
  for (const auto& [name, f] : sets) {
    overlaps.push_back(mean(f.overlap));
    row(bench, name + ": IoU, precision, recall", ">= .65, .9, .85",
        fmt::format("{:.2f}, {:.2f}, {:.2f}", mean(f.overlap), mean(f.precision), mean(f.recall)));
    row(bench, name + ": tips found; px median, 90 %", "90 %; 3, 8",
        fmt::format("{} of {}; {:.1f}, {:.1f}", f.tip_px.size(), f.tips, quantile_of(f.tip_px, 0.5),
                    quantile_of(f.tip_px, 0.9)));
    row(bench, name + ": the same, of the outlines drawn by eye", "90 %; 3, 8",
        fmt::format("{} of {}; {:.1f}, {:.1f}", f.tip_of_outline_px.size(), f.tips,
                    quantile_of(f.tip_of_outline_px, 0.5), quantile_of(f.tip_of_outline_px, 0.9)));
  }
  if (!sets.empty()) row(bench, "all sets: IoU", ">= .80", fmt::format("{:.2f}", mean(overlaps)));
}

void without_tool(const Bench& bench) {
  for (const char* name : kWithoutTool) {
    const cv::Mat bgr = cv::imread((bench.reference / name).string());
    if (bgr.empty()) {
      fmt::print("No {}: PALPATE_REFERENCE_DATA names no folder that holds it.\n", name);
      continue;
    }
    const cv::Mat mask = mask_of_one(bench, bgr);
    const auto found = find_instruments(mask, find_picture_area(bgr));
    save_view(bench, fs::path(name).parent_path().string(), bgr, mask, found);
    row(bench, fmt::format("{}: marked; instruments", name), "<= 0.5 %; 0",
        fmt::format("{:.2f} %; {}", 100.0 * cv::countNonZero(mask) / static_cast<double>(mask.total()), found.size()));
  }
}

/// The instrument of one camera's consecutive frames: the largest of the first, then the nearest.
void consecutive(const Bench& bench) {
  const auto videos = read_real_videos(bench.pictures);
  if (videos.empty()) fmt::print("No consecutive real frames in PALPATE_INSTRUMENT_PICTURES.\n");
  for (const RealVideo& video : videos) {
    InstrumentFinder finder(bench.options(), video.frames.front(), {});
    WayChoice way;
    std::optional<cv::Point2d> last;
    int lost = 0, jumps = 0;
    std::vector<double> milliseconds;
    for (const cv::Mat& frame : video.frames) {
      const auto begin = std::chrono::steady_clock::now();
      const auto found = find_instruments(find_instruments_in({frame}, {&finder}, way)[0].mask, finder.picture_area());
      milliseconds.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
      std::optional<cv::Point2d> nearest;
      for (const ImageInstrument& i : found)
        if (!nearest || (last && cv::norm(i.tip.tip_px - *last) < cv::norm(*nearest - *last))) nearest = i.tip.tip_px;
      if (!nearest) {
        ++lost;
        continue;
      }
      if (last && cv::norm(*nearest - *last) > 0.05 * frame.cols) ++jumps;
      last = nearest;
    }
    row(bench, fmt::format("{}, {} frames: lost, jumps, ms of one camera", video.name, video.frames.size()),
        "<= 5 %, 0",
        fmt::format("{:.0f} %, {}, {:.0f}", 100.0 * lost / static_cast<double>(video.frames.size()), jumps,
                    quantile_of(milliseconds, 0.5)));
  }
}

void clicked(const Bench& bench) {
  const auto pairs = read_clicked_pairs(bench.pictures);
  if (pairs.empty()) fmt::print("No clicked pairs (thrust) in PALPATE_INSTRUMENT_PICTURES.\n");
  std::vector<double> tip_px, disparity_px;
  for (const ClickedPair& pair : pairs) {
    const auto nearest = [&](const cv::Mat& bgr, const cv::Point2d& click) {
      std::optional<cv::Point2d> tip;
      for (const ImageInstrument& i : find_instruments(mask_of_one(bench, bgr), find_picture_area(bgr)))
        if (!tip || cv::norm(i.tip.tip_px - click) < cv::norm(*tip - click)) tip = i.tip.tip_px;
      return tip;
    };
    const auto left = nearest(pair.left, pair.left_px), right = nearest(pair.right, pair.right_px);
    if (!left || !right) continue;
    tip_px.push_back(cv::norm(*left - pair.left_px) * kTipWidth_px / pair.left.cols);
    disparity_px.push_back(std::abs((left->x - right->x) - (pair.left_px.x - pair.right_px.x)));
  }
  if (pairs.empty()) return;
  row(bench, "thrust: found in both; tip px median; disparity px median", ">= 90 %; 3; 1.5",
      fmt::format("{} of {}; {:.1f}; {:.1f}", tip_px.size(), pairs.size(), quantile_of(tip_px, 0.5),
                  quantile_of(disparity_px, 0.5)));
}

/// Tip by frame out of truth.csv.
std::vector<Vec3> read_true_tips(const fs::path& file) {
  std::ifstream stream(file);
  std::string line, cell;
  std::getline(stream, line);
  std::array<int, 3> columns{};
  std::istringstream header(line);
  for (int i = 0; std::getline(header, cell, ','); ++i)
    for (size_t k = 0; k < 3; ++k)
      if (cell == std::array{"tip_x_mm", "tip_y_mm", "tip_z_mm"}[k]) columns[k] = i;
  std::vector<Vec3> tips;
  while (std::getline(stream, line)) {
    std::istringstream row(line);
    Vec3 tip = Vec3::Zero();
    for (int i = 0; std::getline(row, cell, ','); ++i)
      for (size_t k = 0; k < 3; ++k)
        if (columns[k] == i) tip[static_cast<Eigen::Index>(k)] = std::stod(cell);
    tips.push_back(tip);
  }
  return tips;
}

void with_truth(const Bench& bench) {
  for (const char* name : {"rendered_uterus", "rendered_liver"}) {
    const fs::path folder = bench.reference / name;
    if (!fs::exists(folder)) {
      fmt::print("No {}: PALPATE_REFERENCE_DATA names no folder that holds it.\n", name);
      continue;
    }
    RecordingOptions files;
    files.left = folder / "left.mp4";
    files.right = folder / "right.mp4";
    files.calibration = folder / "calibration.yaml";
    Recording recording(files);
    const Rectification rectification = make_rectification(read_rig(files.calibration), recording.size());
    const std::vector<Vec3> truth = read_true_tips(folder / "truth.csv");
    std::optional<InstrumentTracker> tracker;
    std::vector<double> errors_mm, milliseconds;
    int lost = 0;
    while (auto frame = recording.next()) {
      const RectifiedPair pair = rectify(rectification, *frame);
      if (!tracker) tracker.emplace(bench.options(), rectification, pair, cv::Mat());
      const auto begin = std::chrono::steady_clock::now();
      const InstrumentObservations seen = tracker->update(pair);
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
      milliseconds.push_back(took.count());
      const size_t index = static_cast<size_t>(pair.index);
      if (index >= truth.size()) continue;
      if (seen.tips[0].visible)
        errors_mm.push_back((seen.tips[0].tip_mm - truth[index]).norm());
      else
        ++lost;
    }
    row(bench, fmt::format("{}: tip mm median, 95 %; lost; ms mean, p99", name), "-; 25, 40",
        fmt::format("{:.2f}, {:.2f}; {}; {:.0f}, {:.0f}", quantile_of(errors_mm, 0.5), quantile_of(errors_mm, 0.95),
                    lost, mean(milliseconds), quantile_of(milliseconds, 0.99)));
  }
}

fs::path folder_of(const char* variable) {
  const char* value = std::getenv(variable);
  return value ? value : "";
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> ways;
  fs::path view;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--view" && i + 1 < argc)
      view = argv[++i];
    else
      ways.push_back(argv[i]);
  }
  if (ways.empty()) ways = {"learned", "colour"};
  fmt::print("| segmentation | what | goal | measured |\n|---|---|---|---|\n");
  for (const std::string& way : ways) {
    const Bench bench{way, folder_of("PALPATE_INSTRUMENT_PICTURES"), folder_of("PALPATE_REFERENCE_DATA"),
                      view.empty() ? view : view / fs::path(way).stem()};
    outlined(bench);
    without_tool(bench);
    consecutive(bench);
    clicked(bench);
    with_truth(bench);
  }
}
