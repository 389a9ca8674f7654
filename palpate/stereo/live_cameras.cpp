#include "palpate/stereo/live_cameras.h"

#include <fmt/core.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <atomic>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <thread>

#include "palpate/core/clock.h"
#include "palpate/core/errors.h"
#include "palpate/core/source_kind.h"

namespace palpate {
namespace {

constexpr const char* kSinkName = "palpate_sink";
constexpr const char* kSink =
    " ! videoconvert ! appsink name=palpate_sink caps=video/x-raw,format=BGR max-buffers=1 drop=true sync=false "
    "async=false";
constexpr auto kFirstPicture = std::chrono::seconds(10);
constexpr int64_t kBeforeStartingAgain_ns = 500'000'000;
/// A camera that shows nothing for so long is started again: a connection may be dead without knowing it.
constexpr int64_t kLongSilence_ns = 5'000'000'000;
constexpr GstClockTime kLook_ns = 50'000'000;

template <class Object>
struct Unref {
  void operator()(Object* object) const { gst_object_unref(object); }
};
using Element = std::unique_ptr<GstElement, Unref<GstElement>>;
struct FreeError {
  void operator()(GError* error) const { g_error_free(error); }
};
using Error = std::unique_ptr<GError, FreeError>;
struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using Sample = std::unique_ptr<GstSample, UnrefSample>;
struct UnrefMessage {
  void operator()(GstMessage* message) const { gst_message_unref(message); }
};
using Message = std::unique_ptr<GstMessage, UnrefMessage>;

void begin_gstreamer() {
  static std::once_flag once;
  std::call_once(once, [] {
    GError* reason = nullptr;
    if (!gst_init_check(nullptr, nullptr, &reason)) {
      const Error error(reason);
      throw BadInput(fmt::format("GStreamer does not start: {}", error ? error->message : "no reason given"));
    }
    // The sentences of our own exceptions say what matters.
    if (!std::getenv("GST_DEBUG")) gst_debug_set_default_threshold(GST_LEVEL_NONE);
  });
}

/// The sink of a pipeline written for other programs is replaced by ours.
std::string without_sink(const std::string& pipeline) {
  const size_t at = pipeline.rfind(" ! appsink");
  return at == std::string::npos ? pipeline : pipeline.substr(0, at);
}

/// What went wrong, and the last line of the details, which names the cause.
std::string sentence_of(GstMessage* message) {
  GError* reason = nullptr;
  gchar* details = nullptr;
  gst_message_parse_error(message, &reason, &details);
  const Error error(reason);
  std::string sentence = error ? error->message : "it fails";
  while (!sentence.empty() && (sentence.back() == '.' || sentence.back() == '\n')) sentence.pop_back();
  const std::string more = details ? details : "";
  g_free(details);
  const size_t line = more.rfind('\n');
  return line == std::string::npos ? sentence : fmt::format("{} ({})", sentence, more.substr(line + 1));
}

bool is_live(GstElement* sink) {
  GstPad* pad = gst_element_get_static_pad(sink, "sink");
  GstQuery* query = gst_query_new_latency();
  gboolean live = FALSE;
  if (gst_pad_peer_query(pad, query)) gst_query_parse_latency(query, &live, nullptr, nullptr);
  gst_query_unref(query);
  gst_object_unref(pad);
  return live;
}

cv::Mat image_of(GstSample* sample, const GstVideoInfo& info) {
  GstVideoFrame frame;
  if (!gst_video_frame_map(&frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ)) return {};
  const cv::Mat mapped(info.height, info.width, CV_8UC3, GST_VIDEO_FRAME_PLANE_DATA(&frame, 0),
                       static_cast<size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0)));
  cv::Mat image = mapped.clone();
  gst_video_frame_unmap(&frame);
  return image;
}

}  // namespace

std::string pipeline_of(const std::string& name) {
  switch (kind_of_source(name)) {
    case SourceKind::pipeline:
      return name;
    case SourceKind::device:
      return fmt::format("v4l2src device={}{} ! decodebin", name.starts_with('/') ? "" : "/dev/video", name);
    case SourceKind::address:
      if (name.starts_with("rtsp://")) return fmt::format("rtspsrc location=\"{}\" latency=0 ! decodebin", name);
      return {};
    case SourceKind::file:
      break;
  }
  return {};
}

struct LiveCameras::State {
  struct Source {
    Camera camera;
    size_t number = 0;
    State* state = nullptr;
    GstElement* bin = nullptr;  ///< the pipeline's
    Element sink;
    std::atomic<bool> at_end{false};
    // of the thread that looks after the cameras
    bool stopped = false;
    int64_t started_ns = 0;
    // under the mutex
    cv::Size size;
    double stated_fps = 0;
    int64_t last_came_ns = 0;
    std::optional<bool> stamps_by_our_clock;
  };

  Listener listener;
  std::deque<Source> sources;
  Element pipeline;
  std::mutex mutex;
  std::atomic<bool> quits{false};
  std::thread caretaker;

  State(const std::vector<Camera>& cameras, Listener l) : listener(std::move(l)) {
    begin_gstreamer();
    pipeline.reset(gst_pipeline_new(nullptr));
    gst_object_ref_sink(pipeline.get());
    // Stamps can be compared with the steady clock then.
    GstClock* clock = gst_system_clock_obtain();
    gst_pipeline_use_clock(GST_PIPELINE(pipeline.get()), clock);
    gst_object_unref(clock);
    for (const Camera& camera : cameras) add(camera);
  }

  ~State() {
    quits = true;
    if (caretaker.joinable()) caretaker.join();
    if (pipeline) gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  }

  void add(const Camera& camera) {
    Source& source = sources.emplace_back();
    source.camera = camera;
    source.number = sources.size() - 1;
    source.state = this;
    GError* reason = nullptr;
    source.bin = gst_parse_bin_from_description_full((without_sink(pipeline_of(camera.name)) + kSink).c_str(), FALSE,
                                                     nullptr, GST_PARSE_FLAG_FATAL_ERRORS, &reason);
    const Error error(reason);
    if (!source.bin)
      throw BadInput(fmt::format("{}: {} is no GStreamer pipeline that can be made: {}", camera.key, camera.name,
                                 error ? error->message : "no reason given"));
    gst_bin_add(GST_BIN(pipeline.get()), source.bin);
    source.sink.reset(gst_bin_get_by_name(GST_BIN(source.bin), kSinkName));
    GstAppSinkCallbacks callbacks{};
    callbacks.new_sample = [](GstAppSink*, gpointer data) { return take(*static_cast<Source*>(data)); };
    callbacks.eos = [](GstAppSink*, gpointer data) { static_cast<Source*>(data)->at_end = true; };
    gst_app_sink_set_callbacks(GST_APP_SINK(source.sink.get()), &callbacks, &source, nullptr);
  }

  static GstFlowReturn take(Source& source) {
    const int64_t came_ns = steady_ns();
    GstElement* sink = source.sink.get();
    const Sample sample(gst_app_sink_pull_sample(GST_APP_SINK(sink)));
    GstVideoInfo info;
    if (!sample || !gst_video_info_from_caps(&info, gst_sample_get_caps(sample.get()))) return GST_FLOW_OK;
    StampedPicture picture;
    picture.image = image_of(sample.get(), info);
    picture.came_ns = came_ns;
    const auto base_ns = static_cast<int64_t>(gst_element_get_base_time(sink));
    const GstClockTime stamp = gst_segment_to_running_time(gst_sample_get_segment(sample.get()), GST_FORMAT_TIME,
                                                           GST_BUFFER_PTS(gst_sample_get_buffer(sample.get())));
    const bool has_stamp = GST_CLOCK_TIME_IS_VALID(stamp);
    picture.stamp_ns = has_stamp ? static_cast<int64_t>(stamp) : came_ns - base_ns;
    State& state = *source.state;
    {
      const std::lock_guard lock(state.mutex);
      if (!source.stamps_by_our_clock) source.stamps_by_our_clock = is_live(sink);
      if (*source.stamps_by_our_clock || !has_stamp) picture.clock_ns = base_ns;
      source.last_came_ns = came_ns;
      if (source.size.empty()) {
        source.size = picture.image.size();
        if (info.fps_n > 0 && info.fps_d > 0) source.stated_fps = 1.0 * info.fps_n / info.fps_d;
      }
      // Who comes back with pictures of another size is as good as silent.
      if (picture.image.empty() || picture.image.size() != source.size) return GST_FLOW_OK;
    }
    state.listener.on_picture(source.number, std::move(picture));
    return GST_FLOW_OK;
  }

  void open() {
    for (Source& source : sources) source.started_ns = steady_ns();
    if (gst_element_set_state(pipeline.get(), GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
      const std::string sentence = look(kLook_ns);
      throw BadInput(sentence.empty()
                         ? fmt::format("{}: {} cannot be started", sources[0].camera.key, sources[0].camera.name)
                         : sentence);
    }
    const int64_t begun_ns = steady_ns();
    while (Source* missing = source_without_picture()) {
      const std::string sentence = look(kLook_ns);
      if (!sentence.empty()) throw BadInput(sentence);
      if (missing->at_end && source_without_picture() == missing)
        throw BadInput(fmt::format("{}: {} ends before its first picture", missing->camera.key, missing->camera.name));
      if (steady_ns() - begun_ns > std::chrono::nanoseconds(kFirstPicture).count())
        throw BadInput(fmt::format("{}: {} gives no picture within {} s", missing->camera.key, missing->camera.name,
                                   kFirstPicture.count()));
    }
    caretaker = std::thread([this] { care(); });
  }

  Source* source_without_picture() {
    const std::lock_guard lock(mutex);
    for (Source& source : sources)
      if (source.size.empty()) return &source;
    return nullptr;
  }

  /// Waits for what the pipeline has to say: why a source has stopped; empty = none has.
  std::string look(GstClockTime wait_ns) {
    GstBus* bus = gst_element_get_bus(pipeline.get());
    const Message message(gst_bus_timed_pop_filtered(bus, wait_ns, GST_MESSAGE_ERROR));
    gst_object_unref(bus);
    if (!message) return {};
    const std::string sentence = sentence_of(message.get());
    for (Source& source : sources)
      if (gst_object_has_as_ancestor(GST_MESSAGE_SRC(message.get()), GST_OBJECT(source.bin))) {
        source.stopped = true;
        return fmt::format("{}: {}: {}", source.camera.key, source.camera.name, sentence);
      }
    return sentence;
  }

  void care() {
    pthread_setname_np(pthread_self(), "palpate-cameras");
    while (!quits) {
      look(kLook_ns);
      for (Source& source : sources) {
        int64_t last_came_ns = 0;
        {
          const std::lock_guard lock(mutex);
          last_came_ns = source.last_came_ns;
        }
        const int64_t now_ns = steady_ns();
        if (source.at_end && knows_its_length(source)) return listener.on_end();
        const bool is_silent = now_ns - std::max(last_came_ns, source.started_ns) > kLongSilence_ns;
        const bool is_away = source.stopped || source.at_end || is_silent;
        if (is_away && now_ns - source.started_ns > kBeforeStartingAgain_ns) start_again(source);
      }
    }
  }

  static bool knows_its_length(const Source& source) {
    gint64 length = 0;
    return gst_element_query_duration(source.sink.get(), GST_FORMAT_TIME, &length) && length > 0;
  }

  void start_again(Source& source) {
    gst_element_set_state(source.bin, GST_STATE_NULL);
    source.at_end = source.stopped = false;
    {
      const std::lock_guard lock(mutex);
      source.stamps_by_our_clock.reset();
    }
    source.stopped = !gst_element_sync_state_with_parent(source.bin);
    source.started_ns = steady_ns();
  }
};

LiveCameras::LiveCameras(const std::vector<Camera>& cameras, Listener listener)
    : state_(std::make_unique<State>(cameras, std::move(listener))) {
  state_->open();
}

LiveCameras::~LiveCameras() = default;

cv::Size LiveCameras::size(size_t camera) const {
  return state_->sources[camera].size;
}

double LiveCameras::stated_fps() const {
  return state_->sources[0].stated_fps;
}

}  // namespace palpate
