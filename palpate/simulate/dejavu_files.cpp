#include "palpate/simulate/dejavu_files.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/mesh_files.h"

namespace palpate {

void write_truth(const std::filesystem::path& file, const std::vector<TruthRow>& rows) {
  std::ofstream out(file);
  out << "frame,time_s,in_contact,fx_N,fy_N,fz_N,force_N,tip_x_mm,tip_y_mm,tip_z_mm,visible\n";
  for (const TruthRow& row : rows)
    out << fmt::format("{},{:.4f},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},{:.4f},{}\n", row.frame, row.time_s,
                       row.in_contact ? 1 : 0, row.force_N.x(), row.force_N.y(), row.force_N.z(), row.force_N.norm(),
                       row.tip_mm.x(), row.tip_mm.y(), row.tip_mm.z(), row.visible ? 1 : 0);
  out.close();
  if (!out) throw Unfinished(fmt::format("{}: cannot be written", file.string()));
}

void write_calibration(const std::filesystem::path& file, const SimulatedCamera& camera) {
  const cv::Mat K = (cv::Mat_<double>(3, 3) << camera.focal_px, 0, 0.5 * (camera.width - 1), 0, camera.focal_px,
                     0.5 * (camera.height - 1), 0, 0, 1);
  const cv::Mat none = cv::Mat::zeros(1, 5, CV_64F);
  cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
  if (!storage.isOpened()) throw Unfinished(fmt::format("{}: cannot be written", file.string()));
  storage.writeComment("px and mm; x_right = R x_left + T; pixel centres at integer coordinates");
  storage << "image_width" << camera.width << "image_height" << camera.height << "fps" << camera.fps;
  storage << "K1" << K << "D1" << none << "K2" << K << "D2" << none;
  storage << "R" << cv::Mat::eye(3, 3, CV_64F) << "T" << (cv::Mat_<double>(3, 1) << -camera.baseline_mm, 0, 0);
}

struct StereoVideoWriter::Files {
  cv::VideoWriter left, right;
};

StereoVideoWriter::StereoVideoWriter(const std::filesystem::path& folder, const SimulatedCamera& camera)
    : files_(std::make_unique<Files>()) {
  const cv::Size size(camera.width, camera.height);
  const auto open = [&](cv::VideoWriter& writer, const char* name) {
    // H.264 keeps more of the tissue's grain than MPEG-4 part 2; some builds of FFmpeg lack its encoder.
    for (const int codec : {cv::VideoWriter::fourcc('a', 'v', 'c', '1'), cv::VideoWriter::fourcc('m', 'p', '4', 'v')})
      if (writer.open((folder / name).string(), cv::CAP_FFMPEG, codec, camera.fps, size)) return;
    throw Unfinished(fmt::format("{}: the video cannot be written", (folder / name).string()));
  };
  open(files_->left, "left.mp4");
  open(files_->right, "right.mp4");
}

StereoVideoWriter::~StereoVideoWriter() = default;
StereoVideoWriter::StereoVideoWriter(StereoVideoWriter&&) noexcept = default;

void StereoVideoWriter::write(const StereoFrame& frame) {
  files_->left.write(frame.left);
  files_->right.write(frame.right);
}

FrameFiles::FrameFiles(const std::filesystem::path& folder, const SimulatedFiles& wanted)
    : folder_(folder), wanted_(wanted) {
  if (wanted.surface) std::filesystem::create_directories(folder / "surface");
  if (wanted.depth) std::filesystem::create_directories(folder / "depth");
}

void FrameFiles::write_surface(int frame, const Surface& organ) const {
  if (wanted_.surface) write_ply(folder_ / "surface" / fmt::format("frame_{:04d}.ply", frame), organ);
}

void FrameFiles::write_depth(int frame, const cv::Mat& depth_mm) const {
  if (!wanted_.depth) return;
  cv::Mat hundredths(depth_mm.size(), CV_16U);
  for (int y = 0; y < depth_mm.rows; ++y)
    for (int x = 0; x < depth_mm.cols; ++x) {
      const float depth = depth_mm.at<float>(y, x);
      hundredths.at<ushort>(y, x) = std::isfinite(depth) ? cv::saturate_cast<ushort>(100 * depth) : ushort{0};
    }
  const std::filesystem::path file = folder_ / "depth" / fmt::format("left_{:04d}.png", frame);
  if (!cv::imwrite(file.string(), hundredths)) throw Unfinished(fmt::format("{}: cannot be written", file.string()));
}

}  // namespace palpate
