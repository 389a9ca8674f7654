#include "bench/accuracy/edge_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "palpate/core/quantile.h"
#include "palpate/core/stopwatch.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/feedback/map_confidence.h"
#include "palpate/feedback/map_preview.h"
#include "palpate/simulate/instrument_look.h"
#include "palpate/simulate/organ_shape.h"
#include "palpate/simulate/render.h"

namespace palpate {

namespace {

/// Depth that jumps by more between two pixels is an edge; a stretch of a face that lies so far from the truth bridges
/// something.
constexpr double kJump_mm = 2;
constexpr double kGap_mm = 3;
/// A rim may lie so far from the true edge.
constexpr double kRim_mm = 1;

Surface ball(const Vec3& center_mm, const Vec3& half_size_mm) {
  Surface surface = make_sphere(5);
  for (Vec3& v : surface.vertices_mm) v = center_mm + v.cwiseProduct(half_size_mm);
  return surface;
}

/// z over a grid of x and y, seen from the front.
template <class Depth>
Surface sheet(double half_x_mm, double half_y_mm, int columns, int rows, Depth depth) {
  Surface surface;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) {
      const double x = half_x_mm * (2.0 * i / columns - 1), y = half_y_mm * (2.0 * j / rows - 1);
      surface.vertices_mm.emplace_back(x, y, depth(x, y));
    }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int corner = j * (columns + 1) + i, below = corner + columns + 1;
      surface.triangles.push_back({corner, below, corner + 1});
      surface.triangles.push_back({corner + 1, below, below + 1});
    }
  return surface;
}

Surface wall_at(double depth_mm) {
  return sheet(110, 80, 60, 40,
               [depth_mm](double x, double y) { return depth_mm + 2 * std::sin(0.06 * x + 0.04 * y); });
}

/// A fold of 5 mm that runs out towards +x.
double folded_mm(double x, double y) {
  const double height_mm = 5 * std::clamp((18 - x) / 30, 0.0, 1.0);
  const double over = std::clamp((y + 2 + 0.1 * x) / 0.4, 0.0, 1.0);
  return 92 + 0.15 * x + (y * y + x * x) / 400 - height_mm * over;
}

struct Parts {
  std::string name;
  std::vector<Surface> organ;  ///< the first is the organ, the others are other tissue
  bool has_instrument = false;
};

std::vector<Parts> all_parts() {
  return {{"loop before a wall", {ball({0, 0, 84}, {38, 11, 11}), wall_at(104)}, false},
          {"two organs, 6 mm apart",
           {ball({-21, 0, 95}, {22, 24, 18}), ball({25, 0, 97}, {18, 20, 16}), wall_at(150)},
           false},
          {"organ behind an instrument", {ball({0, 2, 104}, {40, 28, 22}), wall_at(140)}, true},
          {"fold", {sheet(48, 30, 480, 600, folded_mm)}, false}};
}

StereoRig rig_of(const SimulatedCamera& camera) {
  StereoRig rig;
  rig.image_size = {camera.width, camera.height};
  rig.left.K =
      cv::Matx33d(camera.focal_px, 0, 0.5 * (camera.width - 1), 0, camera.focal_px, 0.5 * (camera.height - 1), 0, 0, 1);
  rig.right = rig.left;
  rig.right_from_left_mm = Vec3(-camera.baseline_mm, 0, 0);
  return rig;
}

EdgeScene scene_of(const Parts& parts, int seed) {
  const SimulatedCamera camera;
  SimulatedLook look;
  look.seed = seed;
  SimulatedInstrument instrument;
  instrument.enters_from = Vec3(120, 50, 20);
  const InstrumentPlace place{{-4, 0, 78}, (Vec3(-4, 0, 78) - instrument.enters_from).normalized(), 0.2};

  EdgeScene scene;
  scene.name = parts.name;
  scene.rig = rig_of(camera);
  Renderer with(camera, look), without(camera, look);
  for (Renderer* renderer : {&with, &without})
    for (size_t i = 0; i < parts.organ.size(); ++i) {
      SimulatedLook own = look;
      own.seed = seed + static_cast<int>(i);
      renderer->add(parts.organ[i], {tissue_texture(own), 8, look.roughness, look.reflectance});
    }
  scene.organ = without.visible_mask(0);
  scene.tissue_depth_mm = without.light(0, 0).left_depth_mm;
  scene.instrument = cv::Mat1b(scene.organ.size(), uchar{0});
  if (parts.has_instrument) {
    const int number = with.add(make_instrument(instrument, place), instrument_look(instrument, place, seed));
    scene.instrument = with.visible_mask(number);
  }
  scene.depth_mm = with.light(0, 0).left_depth_mm;
  scene.frame = with.render(0);
  return scene;
}

/// Pixels of the organ beside tissue that lies farther by a jump, and is not hidden by the instrument.
std::vector<cv::Point> true_edge(const EdgeScene& scene) {
  std::vector<cv::Point> edge;
  const cv::Rect inside(20, 20, scene.organ.cols - 40, scene.organ.rows - 40);
  cv::Mat1b near_instrument;
  cv::dilate(scene.instrument, near_instrument, cv::Mat1b::ones(15, 15));
  for (int y = inside.y; y < inside.br().y; ++y)
    for (int x = inside.x; x < inside.br().x; ++x) {
      if (!scene.organ(y, x) || near_instrument(y, x)) continue;
      const float z = scene.tissue_depth_mm(y, x);
      for (const cv::Point& beside : {cv::Point(-1, 0), cv::Point(1, 0), cv::Point(0, -1), cv::Point(0, 1)})
        if (scene.tissue_depth_mm(cv::Point(x, y) + beside) > z + static_cast<float>(kJump_mm)) {
          edge.emplace_back(x, y);
          break;
        }
    }
  return edge;
}

/// Directed edges of all pieces that no other triangle shares, as drawn lines; 0 there, 255 elsewhere.
cv::Mat1b drawn_rims(const TissueMap& map, const EdgeScene& scene) {
  cv::Mat1b picture(scene.organ.size(), uchar{255});
  for (const SurfacePiece& piece : map.pieces) {
    std::set<std::pair<int, int>> edges;
    for (const Triangle& t : piece.surface.triangles)
      for (size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
    const auto pixel = [&](int i) {
      return cv::Point(project_to_recorded_left(scene.rig, piece.surface.vertices_mm[static_cast<size_t>(i)]));
    };
    for (const auto& [a, b] : edges)
      if (!edges.count({b, a})) cv::line(picture, pixel(a), pixel(b), 0);
  }
  return picture;
}

/// Whether no tissue lies at the point's depth, nor beside it within what a rim may be off.
bool is_in_gap(const Vec3& p, const EdgeScene& scene) {
  const int reach_px = static_cast<int>(kRim_mm * scene.rig.left.K(0, 0) / p.z());
  const cv::Point px = project_to_recorded_left(scene.rig, p);
  for (const cv::Point& by : {cv::Point(0, 0), cv::Point(1, 0), cv::Point(-1, 0), cv::Point(0, 1), cv::Point(0, -1)}) {
    const cv::Point at = px + reach_px * by;
    if (!cv::Rect({0, 0}, scene.organ.size()).contains(at)) return false;
    if (std::abs(p.z() - static_cast<double>(scene.tissue_depth_mm(at))) < kJump_mm) return false;
  }
  return true;
}

/// Whether a side of the triangle crosses a gap.
bool bridges(const Surface& surface, const Triangle& t, const EdgeScene& scene) {
  for (size_t k = 0; k < 3; ++k) {
    const Vec3 &a = surface.vertices_mm[static_cast<size_t>(t[k])],
               &b = surface.vertices_mm[static_cast<size_t>(t[(k + 1) % 3])];
    constexpr int kSamples = 24;
    double off_mm = 0;
    bool begins_on_tissue = false;
    for (int i = 0; i <= kSamples; ++i) {
      if (is_in_gap(a + (b - a) * i / kSamples, scene)) {
        off_mm += (b - a).norm() / kSamples;
        continue;
      }
      if (begins_on_tissue && off_mm > kGap_mm - 2 * kRim_mm) return true;
      begins_on_tissue = true;
      off_mm = 0;
    }
  }
  return false;
}

/// Name of the scene as a file: "loop_before_a_wall.jpg".
std::string picture_name(const std::string& name) {
  std::string file;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      file += c;
    else if (c == ' ')
      file += '_';
  return file + ".jpg";
}

void write_picture(const std::filesystem::path& folder, const EdgeScene& scene, const Rectification& rectification,
                   const TissueMap& map) {
  const cv::Mat preview = draw_map_preview(scene.frame.left, rectification, map);
  // The first of four panels; beside those to the right stands a colour bar.
  const int height = preview.rows / 2, width = height * scene.frame.left.cols / scene.frame.left.rows;
  const cv::Mat mesh = preview({0, 0, width, height}),
                confidence = draw_map_confidence(scene.frame.left, rectification, map);
  cv::Mat left, right, both;
  constexpr int kHeight_px = 360;
  const auto at_height = [](const cv::Mat& picture) {
    return cv::Size(picture.cols * kHeight_px / picture.rows, kHeight_px);
  };
  cv::resize(mesh, left, at_height(mesh), 0, 0, cv::INTER_AREA);
  cv::resize(confidence, right, at_height(confidence), 0, 0, cv::INTER_AREA);
  cv::hconcat(left, right, both);
  std::filesystem::create_directories(folder);
  cv::imwrite((folder / picture_name(scene.name)).string(), both, {cv::IMWRITE_JPEG_QUALITY, 85});
}

std::string edge_row(const EdgeScene& scene, const std::filesystem::path& pictures) {
  const Rectification rectification = make_rectification(scene.rig, scene.organ.size());
  TissueOptions tissue;
  tissue.young_modulus_kPa = 20;
  MapOptions options;
  AttachmentOptions attachments;
  attachments.regions.resize(1);
  Stopwatch watch;
  const TissueMap map = build_tissue_map(scene.frame, rectification, options, tissue, attachments);
  const double time_ms = watch.lap_ms();
  if (!pictures.empty()) write_picture(pictures, scene, rectification, map);

  cv::Mat1f away_px;
  cv::distanceTransform(drawn_rims(map, scene), away_px, cv::DIST_L2, cv::DIST_MASK_5);
  std::vector<double> cut_mm;
  for (const cv::Point& px : true_edge(scene))
    cut_mm.push_back(static_cast<double>(away_px(px) * scene.tissue_depth_mm(px)) / rectification.focal_px);
  size_t across = 0, faces = 0;
  for (const SurfacePiece& piece : map.pieces)
    for (const Triangle& t : piece.surface.triangles) ++faces, across += bridges(piece.surface, t, scene);

  // The surface of the organ over the picture, cell by cell.
  std::vector<double> organ_depths_mm;
  for (int y = 0; y < scene.organ.rows; ++y)
    for (int x = 0; x < scene.organ.cols; ++x)
      if (scene.organ(y, x)) organ_depths_mm.push_back(static_cast<double>(scene.tissue_depth_mm(y, x)));
  const double organ_depth_mm = quantile_of(organ_depths_mm, 0.5);
  const SurfacePiece& organ =
      *std::min_element(map.pieces.begin(), map.pieces.end(), [&](const SurfacePiece& a, const SurfacePiece& b) {
        return std::abs(a.depth_mm - organ_depth_mm) < std::abs(b.depth_mm - organ_depth_mm);
      });
  const DepthCells cells = seen_tissue(organ.surface, map.seen.cells).cells;
  double squares = 0, hidden_squares = 0;
  int on = 0, off = 0, hidden = 0;
  for (int y = 0; y < cells.w.rows; ++y)
    for (int x = 0; x < cells.w.cols; ++x) {
      if (!cells.is_known({x, y})) continue;
      const Vec3 p = cells.point_mm({x, y});
      const cv::Point px = project_to_recorded_left(scene.rig, p);
      if (!cv::Rect({0, 0}, scene.organ.size()).contains(px)) continue;
      const double error = p.z() - static_cast<double>(scene.tissue_depth_mm(px));
      if (scene.instrument(px) || cells.closed(y, x)) {
        ++hidden;
        hidden_squares += error * error;
      } else if (std::abs(error) > kJump_mm) {
        ++off;
      } else {
        ++on;
        squares += error * error;
      }
    }
  return fmt::format(
      "| {} | {} | {:.2f} / {:.2f} | {:.0f} % | {} of {} | {:.2f} | {:.1f} % | {} | {:.0f} |\n", scene.name,
      map.pieces.size(), quantile_of(cut_mm, 0.5), quantile_of(cut_mm, 0.95),
      100.0 * static_cast<double>(std::count_if(cut_mm.begin(), cut_mm.end(), [](double mm) { return mm <= 1; })) /
          static_cast<double>(std::max<size_t>(1, cut_mm.size())),
      across, faces, std::sqrt(squares / std::max(1, on)), 100.0 * off / std::max(1, on + off),
      hidden > 0 ? fmt::format("{:.2f}", std::sqrt(hidden_squares / hidden)) : "", time_ms);
}

}  // namespace

std::vector<EdgeScene> edge_scenes() {
  std::vector<EdgeScene> scenes;
  int seed = 3;
  for (const Parts& parts : all_parts()) scenes.push_back(scene_of(parts, seed += 10));
  return scenes;
}

std::string edge_table(const std::filesystem::path& pictures) {
  std::string table =
      "| scene | pieces | rim to true edge, median / 95 % mm | edge found within 1 mm | faces across a gap of 3 mm | "
      "S* "
      "to truth, RMS mm | S* more than 2 mm off | behind the instrument, RMS mm | Phi ms |\n"
      "|---|---|---|---|---|---|---|---|---|\n| goal | | <= 1 | | 0 | | | | <= 500 |\n";
  for (const EdgeScene& scene : edge_scenes()) table += edge_row(scene, pictures);
  return table;
}

}  // namespace palpate
