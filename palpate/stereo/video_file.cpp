#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <set>

#include "palpate/core/errors.h"
#include "palpate/stereo/frame_source.h"
#include "palpate/stereo/packet_stamps.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/log.h>
#include <libswscale/swscale.h>
}

namespace palpate {
namespace {

struct CloseInput {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
};
struct FreeCodec {
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
};
struct FreePacket {
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
};
struct FreeFrame {
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
};
using Input = std::unique_ptr<AVFormatContext, CloseInput>;
using Codec = std::unique_ptr<AVCodecContext, FreeCodec>;
using Packet = std::unique_ptr<AVPacket, FreePacket>;
using Picture = std::unique_ptr<AVFrame, FreeFrame>;

/// FFmpeg talks on stderr; the sentences of our own exceptions say what matters.
Input open_input(const std::filesystem::path& file, const std::string& key) {
  av_log_set_level(AV_LOG_QUIET);
  AVFormatContext* context = nullptr;
  // Without its protocol a name with a colon would be taken for an address.
  const bool opened = avformat_open_input(&context, ("file:" + file.string()).c_str(), nullptr, nullptr) >= 0;
  Input input(context);
  if (!opened || avformat_find_stream_info(context, nullptr) < 0)
    throw BadInput(fmt::format("{}: {} cannot be opened as a video", key, file.string()));
  return input;
}

int video_stream_of(AVFormatContext& input) {
  const int stream = av_find_best_stream(&input, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  for (unsigned i = 0; i < input.nb_streams; ++i)
    input.streams[i]->discard = static_cast<int>(i) == stream ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
  return stream;
}

/// Bytes that RIFF or the last box of MP4 states beyond the end of the file: it was cut.
bool ends_early(const std::filesystem::path& file, const std::string& format) {
  std::error_code error;
  const auto size = static_cast<uint64_t>(std::filesystem::file_size(file, error));
  if (error) return false;
  std::ifstream stream(file, std::ios::binary);
  unsigned char head[16];
  const auto number = [&head](size_t at, size_t bytes, bool big_endian) {
    uint64_t value = 0;
    for (size_t i = 0; i < bytes; ++i)
      value |= static_cast<uint64_t>(head[at + (big_endian ? bytes - 1 - i : i)]) << (8 * i);
    return value;
  };
  if (format == "avi") {
    stream.read(reinterpret_cast<char*>(head), 8);
    return stream && number(4, 4, false) + 8 > size;
  }
  if (format.find("mp4") == std::string::npos) return false;
  for (uint64_t at = 0; at + 8 <= size;) {
    stream.seekg(static_cast<std::streamoff>(at));
    stream.read(reinterpret_cast<char*>(head), 16);
    if (stream.gcount() < 8) return false;
    stream.clear();
    uint64_t box = number(0, 4, true);
    if (box == 0) return false;  // up to the end
    if (box == 1) box = number(8, 8, true);
    if (box < 8 || box > size - at) return true;
    at += box;
  }
  return false;
}

class VideoFile : public FrameSource {
 public:
  VideoFile(const std::filesystem::path& file, const std::string& key, bool strict)
      : file_(file), key_(key), strict_(strict), packet_(av_packet_alloc()), picture_(av_frame_alloc()) {
    scan();
    input_ = open_input(file, key);
    stream_ = video_stream_of(*input_);
    parts_.emplace(frame_ticks(*input_->streams[stream_]));
    open_decoder();
    first_ = decode();
    if (!first_) throw BadInput(fmt::format("{}: {} holds no frame that can be decoded", key, file.string()));
    size_ = first_->image.size();
  }
  ~VideoFile() override { sws_freeContext(scaler_); }
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  std::optional<Frame> next() override {
    std::optional<Frame> frame = first_ ? std::move(first_) : decode();
    first_.reset();
    if (frame) last_stamp_s_ = frame->time_s;
    if (frame && frame->image.size() != size_)
      throw BadInput(fmt::format("{}: {} changes from {}x{} to {}x{} px on the way, expected one size", key_,
                                 file_.string(), size_.width, size_.height, frame->image.cols, frame->image.rows));
    return frame;
  }
  cv::Size size() const override { return size_; }
  /// Streams that can be cut anywhere begin at any time, all others at 0.
  std::string clock() const override {
    return (input_->iformat->flags & AVFMT_TS_DISCONT) != 0 ? input_->iformat->name : "file";
  }
  const std::vector<double>& stamps_s() const override { return stamps_s_; }
  double stated_fps() const override {
    const double rate = av_q2d(input_->streams[stream_]->r_frame_rate);
    return std::isfinite(rate) && rate > 0 && rate < 1000 ? rate : 0;
  }
  /// Also where the pictures end before the packets do.
  int frames_if_whole() const override {
    if (frames_if_whole_ > 0) return frames_if_whole_;
    if (is_broken_off_) return static_cast<int>(stamps_s_.size());
    const bool stopped = !strict_ && stamps_s_.size() > 2 && last_stamp_s_ < *(stamps_s_.end() - 3);
    return stopped ? static_cast<int>(stamps_s_.size()) : 0;
  }
  bool is_interlaced() const override { return is_interlaced_; }
  std::string note() const override { return note_; }
  std::string damage() const override {
    if (damaged_.empty()) return {};
    return fmt::format("{}: {}{} of the frames read from it {} damaged, the first is frame {}", file_.string(),
                       strict_ ? "" : "at least ", damaged_.size(), damaged_.size() == 1 ? "is" : "are",
                       *damaged_.begin());
  }

 private:
  /// The stamps of all packets that are shown: nothing is decoded. Packets before the first key frame cannot be.
  void scan() {
    Input input = open_input(file_, key_);
    const int index = video_stream_of(*input);
    if (index < 0) throw BadInput(fmt::format("{}: {} holds no video", key_, file_.string()));
    AVStream& stream = *input->streams[index];
    const double seconds = av_q2d(stream.time_base);
    const int64_t frame = frame_ticks(stream);
    JoinedParts parts(frame);
    std::vector<PacketStamp> packets;
    size_t read = 0, first_joint = 0;
    bool after_key = false;
    for (; av_read_frame(input.get(), packet_.get()) >= 0; av_packet_unref(packet_.get())) {
      const AVPacket& packet = *packet_;
      if (packet.stream_index != index) continue;
      PacketStamp stamp{packet.pts, packet.dts};
      if (parts.join(stamp)) {
        if (joints_.empty()) first_joint = packets.size();
        joints_.push_back(read);
      }
      ++read;
      after_key = after_key || (packet.flags & AV_PKT_FLAG_KEY) != 0;
      if (packet.size > 0 && after_key && (packet.flags & AV_PKT_FLAG_DISCARD) == 0) packets.push_back(stamp);
    }
    for (const int64_t ticks : shown_stamps(packets, frame)) stamps_s_.push_back(static_cast<double>(ticks) * seconds);
    if (!joints_.empty())
      note_ = fmt::format(
          "{}: its times jump back {} times, first at frame {}: what follows is counted on from there, one frame later",
          file_.string(), joints_.size(), first_joint);
    const auto held = static_cast<int64_t>(stamps_s_.size());
    const std::string format = input->iformat->name;
    if (ends_early(file_, format))
      frames_if_whole_ = static_cast<int>(std::max(held + 1, stream.nb_frames));
    else if (format.find("matroska") != std::string::npos && input->duration > 0 && input->nb_streams == 1 &&
             held > 0) {
      const double stated_s = static_cast<double>(input->duration) / AV_TIME_BASE, frame_s = 1 / rate_of(stream);
      constexpr double kSlack = 3;  // frames that a duration may be off
      if (stated_s - (stamps_s_.back() - stamps_s_.front() + frame_s) > kSlack * frame_s + 0.05)
        frames_if_whole_ = static_cast<int>(stated_s / frame_s);
    }
  }

  static double rate_of(const AVStream& stream) {
    const double rate = av_q2d(stream.r_frame_rate);
    return std::isfinite(rate) && rate > 0 ? rate : 25;
  }

  static int64_t frame_ticks(const AVStream& stream) {
    return std::max<int64_t>(1, std::llround(1 / (rate_of(stream) * av_q2d(stream.time_base))));
  }

  void open_decoder() {
    const AVStream& stream = *input_->streams[stream_];
    const AVCodec* codec = avcodec_find_decoder(stream.codecpar->codec_id);
    codec_.reset(avcodec_alloc_context3(codec));
    if (!codec || !codec_ || avcodec_parameters_to_context(codec_.get(), stream.codecpar) < 0)
      throw BadInput(fmt::format("{}: {} is coded in a way that cannot be decoded here ({})", key_, file_.string(),
                                 avcodec_get_name(stream.codecpar->codec_id)));
    codec_->thread_count = strict_ ? 1 : 0;  // an error is that of the packet before it
    if (strict_) codec_->err_recognition |= AV_EF_EXPLODE;
    codec_->pkt_timebase = stream.time_base;
    if (avcodec_open2(codec_.get(), codec, nullptr) < 0)
      throw BadInput(fmt::format("{}: {} cannot be decoded ({})", key_, file_.string(), codec->name));
    if (const auto* matrix =
            reinterpret_cast<const int32_t*>(av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr)))
      quarter_turns_ = static_cast<int>(std::lround(-av_display_rotation_get(matrix) / 90)) & 3;
  }

  std::optional<Frame> decode() {
    while (true) {
      const int received = avcodec_receive_frame(codec_.get(), picture_.get());
      if (received == 0) {
        Frame frame = shown();
        av_frame_unref(picture_.get());
        return frame;
      }
      if (received == AVERROR_INVALIDDATA) {
        damaged_at(sent_s_);
        continue;
      }
      if (received != AVERROR(EAGAIN)) return std::nullopt;
      if (const int read = av_read_frame(input_.get(), packet_.get()); read < 0) {
        is_broken_off_ = read != AVERROR_EOF;
        avcodec_send_packet(codec_.get(), nullptr);
        continue;
      }
      if (packet_->stream_index == stream_) decode_packet();
      av_packet_unref(packet_.get());
    }
  }

  /// What cannot be decoded is left out: the stamps of the others stand.
  void decode_packet() {
    PacketStamp stamp{packet_->pts, packet_->dts};
    parts_->join(stamp);
    ++read_;
    packet_->pts = stamp.shown;
    packet_->dts = stamp.decoded;
    if (packet_->size == 0) return;
    // Packets of a stream are numbered anew where parts join: nothing of the last frames is missing for that.
    constexpr size_t kHeldBack = 2;
    const auto joint = std::lower_bound(joints_.begin(), joints_.end(), read_);
    const bool before_joint = joint != joints_.end() && *joint <= read_ + kHeldBack;
    const bool is_whole = (packet_->flags & AV_PKT_FLAG_CORRUPT) == 0 || before_joint;
    after_key_ = after_key_ || (packet_->flags & AV_PKT_FLAG_KEY) != 0;
    sent_s_ = stamp.shown != kNoStamp ? seconds_of(stamp.shown) : stamp_after(shown_s_);
    if ((is_whole && avcodec_send_packet(codec_.get(), packet_.get()) >= 0) || !after_key_) return;
    damaged_at(sent_s_);
    if (stamp.shown == kNoStamp) shown_s_ = sent_s_;
  }

  double seconds_of(int64_t ticks) const {
    return static_cast<double>(ticks) * av_q2d(input_->streams[stream_]->time_base);
  }

  double stamp_after(double stamp_s) const {
    const auto after = std::upper_bound(stamps_s_.begin(), stamps_s_.end(), stamp_s);
    return after != stamps_s_.end() ? *after : stamp_s + 1 / rate_of(*input_->streams[stream_]);
  }

  void damaged_at(double stamp_s) {
    damaged_.insert(std::lower_bound(stamps_s_.begin(), stamps_s_.end(), stamp_s) - stamps_s_.begin());
  }

  Frame shown() {
    const AVFrame& picture = *picture_;
    is_interlaced_ = is_interlaced_ || picture.interlaced_frame != 0;
    Frame frame;
    // Time never runs backwards.
    const bool has_stamp = picture.pts != AV_NOPTS_VALUE && seconds_of(picture.pts) >= shown_s_;
    shown_s_ = frame.time_s = has_stamp ? seconds_of(picture.pts) : stamp_after(shown_s_);
    if ((picture.flags & AV_FRAME_FLAG_CORRUPT) != 0 || picture.decode_error_flags != 0) damaged_at(frame.time_s);
    frame.image.create(picture.height, picture.width, CV_8UC3);
    const auto format = static_cast<AVPixelFormat>(picture.format);
    scaler_ = sws_getCachedContext(scaler_, picture.width, picture.height, format, picture.width, picture.height,
                                   AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr);
    if (!scaler_) throw BadInput(fmt::format("{}: {} has pixels of an unknown format", key_, file_.string()));
    set_colours(picture);
    uint8_t* rows[] = {frame.image.data, nullptr, nullptr, nullptr};
    const int strides[] = {static_cast<int>(frame.image.step), 0, 0, 0};
    sws_scale(scaler_, picture.data, picture.linesize, 0, picture.height, rows, strides);
    if (quarter_turns_ == 1) cv::rotate(frame.image, frame.image, cv::ROTATE_90_CLOCKWISE);
    if (quarter_turns_ == 2) cv::rotate(frame.image, frame.image, cv::ROTATE_180);
    if (quarter_turns_ == 3) cv::rotate(frame.image, frame.image, cv::ROTATE_90_COUNTERCLOCKWISE);
    return frame;
  }

  /// Matrix and range that the stream states; without, swscale's own (BT.601, limited).
  void set_colours(const AVFrame& picture) {
    int *inverse = nullptr, *table = nullptr, from_full = 0, to_full = 0, brightness = 0, contrast = 0, saturation = 0;
    if (sws_getColorspaceDetails(scaler_, &inverse, &from_full, &table, &to_full, &brightness, &contrast, &saturation) <
        0)
      return;
    if (picture.color_range == AVCOL_RANGE_JPEG) from_full = 1;
    const int* matrix = picture.colorspace != AVCOL_SPC_UNSPECIFIED && picture.colorspace != AVCOL_SPC_RGB
                            ? sws_getCoefficients(picture.colorspace)
                            : inverse;
    sws_setColorspaceDetails(scaler_, matrix, from_full, table, to_full, brightness, contrast, saturation);
  }

  std::filesystem::path file_;
  std::string key_;
  bool strict_;
  std::vector<double> stamps_s_;
  int frames_if_whole_ = 0;
  bool is_broken_off_ = false;  ///< the medium failed while it was read
  Packet packet_;
  Picture picture_;
  Input input_;
  Codec codec_;
  int stream_ = -1;
  int quarter_turns_ = 0;
  SwsContext* scaler_ = nullptr;
  cv::Size size_;
  std::optional<Frame> first_;
  std::optional<JoinedParts> parts_;
  double shown_s_ = -HUGE_VAL;      ///< stamp of the frame decoded last
  double last_stamp_s_ = HUGE_VAL;  ///< of the frame handed on last
  std::vector<size_t> joints_;      ///< packets that begin a part
  size_t read_ = 0;                 ///< packets so far
  double sent_s_ = 0;               ///< stamp of the packet decoded last
  bool after_key_ = false;
  std::set<long> damaged_;  ///< numbers of frames
  std::string note_;
  bool is_interlaced_ = false;
};

}  // namespace

std::unique_ptr<FrameSource> open_video_file(const std::filesystem::path& file, const std::string& key, bool strict) {
  return std::make_unique<VideoFile>(file, key, strict);
}

}  // namespace palpate
