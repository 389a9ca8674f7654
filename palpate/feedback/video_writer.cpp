#include "palpate/feedback/video_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <system_error>

#include "palpate/core/errors.h"
#include "palpate/core/whole_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

namespace palpate {
namespace {

constexpr int kTicksPerSecond = 60000;  // MPEG-4 allows up to 65535

struct CloseOutput {
  void operator()(AVFormatContext* context) const {
    avio_closep(&context->pb);
    avformat_free_context(context);
  }
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
struct FreeScaler {
  void operator()(SwsContext* scaler) const { sws_freeContext(scaler); }
};

std::string reason_of(int error) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(error, text, sizeof text);
  return text;
}

}  // namespace

struct VideoWriter::State {
  std::filesystem::path file;
  double fps = 0;
  cv::Size size;
  std::unique_ptr<AVFormatContext, CloseOutput> output;
  std::unique_ptr<AVCodecContext, FreeCodec> codec;
  std::unique_ptr<SwsContext, FreeScaler> scaler;
  std::unique_ptr<AVFrame, FreeFrame> picture{av_frame_alloc()};
  std::unique_ptr<AVPacket, FreePacket> packet{av_packet_alloc()};
  int frames = 0, quality_crf = 23;
  int64_t next_tick = 0;  ///< the earliest for the next frame
  bool has_header = false;

  int64_t ticks(double time_s) const { return std::llround(time_s * kTicksPerSecond); }

  void check(int result) const {
    if (result < 0)
      throw Unfinished(
          fmt::format("cannot go on writing {} after {} frames: {}", file.string(), frames, reason_of(result)));
  }

  /// Every frame comes out as soon as it went in, and depends on earlier ones only.
  bool open_encoder(const AVCodec* encoder) {
    if (!encoder) return false;
    codec.reset(avcodec_alloc_context3(encoder));
    codec->width = size.width & ~1;  // colour has half the resolution
    codec->height = size.height & ~1;
    codec->pix_fmt = AV_PIX_FMT_YUV420P;
    codec->time_base = {1, kTicksPerSecond};
    codec->framerate = av_d2q(fps, 100000);
    codec->gop_size = std::max(1, static_cast<int>(std::lround(fps)));
    codec->max_b_frames = 0;
    codec->thread_count = 1;
    codec->colorspace = AVCOL_SPC_SMPTE170M;
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_QSCALE;
    codec->global_quality = 3 * FF_QP2LAMBDA;  // of MPEG-4; x264 has its own
    av_opt_set(codec->priv_data, "preset", "superfast", 0);
    av_opt_set(codec->priv_data, "tune", "zerolatency", 0);
    av_opt_set(codec->priv_data, "crf", std::to_string(quality_crf).c_str(), 0);
    return avcodec_open2(codec.get(), encoder, nullptr) >= 0;
  }

  /// A fragment per frame: what is on the disk plays, wherever the program ends.
  bool open_file() {
    AVFormatContext* context = nullptr;
    avformat_alloc_output_context2(&context, nullptr, "mp4", nullptr);
    if (!context) return false;
    output.reset(context);
    output->flags |= AVFMT_FLAG_FLUSH_PACKETS;
    output->flush_packets = 1;
    AVStream* stream = avformat_new_stream(context, nullptr);
    stream->time_base = codec->time_base;
    stream->avg_frame_rate = codec->framerate;
    avcodec_parameters_from_context(stream->codecpar, codec.get());
    av_opt_set(context->priv_data, "movflags", "frag_custom+empty_moov+default_base_moof", 0);
    if (avio_open(&context->pb, ("file:" + file.string()).c_str(), AVIO_FLAG_WRITE) < 0) return false;
    has_header = avformat_write_header(context, nullptr) >= 0;
    return has_header;
  }

  /// Whatever the encoder has ready goes to the disk.
  void drain() {
    const AVStream& stream = *output->streams[0];
    while (avcodec_receive_packet(codec.get(), packet.get()) >= 0) {
      packet->duration = ticks(1 / fps);
      av_packet_rescale_ts(packet.get(), codec->time_base, stream.time_base);
      packet->stream_index = 0;
      const int written = av_write_frame(output.get(), packet.get());
      av_packet_unref(packet.get());
      check(written);
      check(av_write_frame(output.get(), nullptr));  // ends the fragment
    }
  }

  void close() {
    if (!output) return;
    if (has_header) {
      avcodec_send_frame(codec.get(), nullptr);
      drain();
      check(av_write_trailer(output.get()));
    }
    const int64_t written = avio_tell(output->pb);
    check(avio_closep(&output->pb));
    output.reset();
    std::error_code error;
    const std::uintmax_t held = std::filesystem::file_size(file, error);
    if (error || held != static_cast<std::uintmax_t>(written))
      throw Unfinished(fmt::format("{} does not hold the {} frames written to it", file.string(), frames));
  }
};

VideoWriter::VideoWriter(const std::filesystem::path& file, double fps, const cv::Size& size, int quality_crf)
    : state_(std::make_unique<State>()) {
  av_log_set_level(AV_LOG_QUIET);
  State& s = *state_;
  s.file = file;
  s.fps = fps;
  s.size = size;
  s.quality_crf = quality_crf;
  require_room(file, 0);
  const bool opened = s.open_encoder(avcodec_find_encoder_by_name("libx264")) ||
                      s.open_encoder(avcodec_find_encoder(AV_CODEC_ID_MPEG4));
  if (!opened)
    throw Unfinished(
        fmt::format("cannot write {}: no video encoder takes {}x{} px", file.string(), size.width, size.height));
  if (!s.open_file()) throw Unfinished(fmt::format("cannot write {}", file.string()));
  s.picture->format = s.codec->pix_fmt;
  s.picture->width = s.codec->width;
  s.picture->height = s.codec->height;
  s.check(av_frame_get_buffer(s.picture.get(), 0));
  s.scaler.reset(sws_getContext(s.codec->width, s.codec->height, AV_PIX_FMT_BGR24, s.codec->width, s.codec->height,
                                s.codec->pix_fmt, SWS_BICUBIC, nullptr, nullptr, nullptr));
}

VideoWriter::~VideoWriter() {
  try {
    if (state_) state_->close();
  } catch (const Unfinished&) {  // who wants to know asks finish()
  }
}
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;

void VideoWriter::write(const cv::Mat& bgr) {
  write(bgr, state_->frames / state_->fps);
}

void VideoWriter::write(const cv::Mat& bgr, double time_s) {
  State& s = *state_;
  if (bgr.size() != s.size || bgr.type() != CV_8UC3)
    throw std::invalid_argument("VideoWriter::write: the image is not an 8-bit BGR image of the video's size");
  require_room(s.file, 0);
  s.check(av_frame_make_writable(s.picture.get()));
  const uint8_t* const rows[] = {bgr.data};
  const int strides[] = {static_cast<int>(bgr.step)};
  sws_scale(s.scaler.get(), rows, strides, 0, s.codec->height, s.picture->data, s.picture->linesize);
  s.picture->pts = std::max(s.ticks(time_s), s.next_tick);
  s.next_tick = s.picture->pts + 1;
  s.check(avcodec_send_frame(s.codec.get(), s.picture.get()));
  s.drain();
  ++s.frames;
}

void VideoWriter::finish() {
  state_->close();
}

}  // namespace palpate
