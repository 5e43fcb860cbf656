// Whole pictures of interlaced ones.
#include "capture/deinterlacer.h"

#include <new>
#include <utility>

extern "C" {
#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavutil/frame.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

namespace capture {
namespace {

constexpr int filter_threads = 2;

// The same samples in planes; none = there is no such format, or it is in planes already.
AVPixelFormat in_planes(int format) {
  switch (format) {
    case AV_PIX_FMT_UYVY422:
    case AV_PIX_FMT_YUYV422:
      return AV_PIX_FMT_YUV422P;
    case AV_PIX_FMT_NV12:
    case AV_PIX_FMT_NV21:
      return AV_PIX_FMT_YUV420P;
    case AV_PIX_FMT_RGB24:
    case AV_PIX_FMT_BGR24:
    case AV_PIX_FMT_BGR0:  // FFV1's
      return AV_PIX_FMT_GBRP;
    default:
      return AV_PIX_FMT_NONE;
  }
}

bool have_one_layout(const AVFrame& a, const AVFrame& b) {
  return a.width == b.width && a.height == b.height && a.format == b.format;
}

void take_layout(AVFrame& to, const AVFrame& from) {
  to.width = from.width;
  to.height = from.height;
  to.format = from.format;
}

}  // namespace

struct Deinterlacer::Graph {
  Graph() : graph(avfilter_graph_alloc()) {
    if (graph == nullptr) throw std::bad_alloc();
  }
  ~Graph() { avfilter_graph_free(&graph); }
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  // Adds a filter behind the last one. Returns libav's error, or 0.
  int add(const char* name, const std::string& settings) {
    const AVFilter* filter = avfilter_get_by_name(name);
    if (filter == nullptr) return AVERROR_FILTER_NOT_FOUND;
    AVFilterContext* context = nullptr;
    int error =
        avfilter_graph_create_filter(&context, filter, name, settings.c_str(), nullptr, graph);
    if (error >= 0 && end != nullptr) error = avfilter_link(end, 0, context, 0);
    if (begin == nullptr) begin = context;
    end = context;
    return error;
  }

  AVFilterGraph* graph;
  AVFilterContext* begin = nullptr;
  AVFilterContext* end = nullptr;
};

Deinterlacer::Deinterlacer()
    : like_(libav::make_frame()),
      given_(libav::make_frame()),
      whole_(libav::make_frame()),
      packed_like_(libav::make_frame()) {}

Deinterlacer::~Deinterlacer() = default;

void Deinterlacer::unpack(libav::FrameHandle& picture) {
  const AVPixelFormat format = in_planes(picture->format);
  if (format == AV_PIX_FMT_NONE) return;
  if (!scaler_ || !have_one_layout(*picture, *packed_like_)) {
    take_layout(*packed_like_, *picture);
    scaler_.reset(sws_getContext(picture->width, picture->height,
                                 static_cast<AVPixelFormat>(picture->format), picture->width,
                                 picture->height, format, SWS_POINT | SWS_ACCURATE_RND, nullptr,
                                 nullptr, nullptr));
  }
  libav::FrameHandle planes = libav::make_frame();
  take_layout(*planes, *picture);
  planes->format = format;
  if (!scaler_ || av_frame_get_buffer(planes.get(), 0) < 0 ||
      av_frame_copy_props(planes.get(), picture.get()) < 0) {
    return;
  }
  sws_scale(scaler_.get(), picture->data, picture->linesize, 0, picture->height, planes->data,
            planes->linesize);
  picture = std::move(planes);
}

// The next graph is another one.
void Deinterlacer::forget() {
  graph_.reset();
  is_fresh_ = false;
  like_->format = AV_PIX_FMT_NONE;
}

// Returns whether there is a graph for such pictures.
bool Deinterlacer::build(const AVFrame& like) {
  if (have_one_layout(like, *like_)) return graph_ != nullptr;
  graph_.reset();
  take_layout(*like_, like);
  auto graph = std::make_unique<Graph>();
  graph->graph->nb_threads = filter_threads;
  // What it would convert to is not known to keep the fields apart.
  avfilter_graph_set_auto_convert(graph->graph, AVFILTER_AUTO_CONVERT_NONE);
  libav::gather_log();
  libav::forget_log();
  int error = graph->add(
      "buffer", "width=" + std::to_string(like.width) + ":height=" + std::to_string(like.height) +
                    ":pix_fmt=" + std::to_string(like.format) + ":time_base=1/1");
  if (error >= 0) error = graph->add("bwdif", "mode=send_frame:parity=auto:deint=interlaced");
  if (error >= 0) error = graph->add("buffersink", "");
  if (error >= 0) error = avfilter_graph_config(graph->graph, nullptr);
  if (error < 0) {
    const char* format = av_get_pix_fmt_name(static_cast<AVPixelFormat>(like.format));
    why_not_ = "pictures of " + std::string(format == nullptr ? "this format" : format) + ", " +
               std::to_string(like.width) + " x " + std::to_string(like.height) +
               ", cannot be: " + libav::reason(error);
    libav::forget_log();
    return false;
  }
  graph_ = std::move(graph);
  is_fresh_ = true;
  stamp_ = 0;
  return true;
}

// Puts the next picture into the graph. What comes out of it, twice its stamp, replaces whole_.
// Returns whether that went well.
bool Deinterlacer::give(const AVFrame& picture, bool interlaced, bool top_field_first) {
  av_frame_unref(given_.get());
  int error = av_frame_ref(given_.get(), &picture);
  if (error >= 0) {
    given_->pts = ++stamp_;
    given_->interlaced_frame = interlaced ? 1 : 0;
    given_->top_field_first = top_field_first ? 1 : 0;
    given_->repeat_pict = 0;
    error = av_buffersrc_add_frame(graph_->begin, given_.get());
  }
  while (error >= 0) {
    error = av_buffersink_get_frame(graph_->end, given_.get());
    if (error < 0) break;
    av_frame_unref(whole_.get());
    av_frame_move_ref(whole_.get(), given_.get());
  }
  return error == AVERROR(EAGAIN);
}

// Makes whole_. Returns whether that went well.
bool Deinterlacer::filter(const AVFrame& before,
                          const AVFrame& picture,
                          const AVFrame& after,
                          bool top_field_first) {
  is_fresh_ = false;
  // The filter gives a picture when it has the next one, and lets pass what is not marked.
  return give(before, false, false) && give(picture, true, top_field_first) &&
         give(after, false, false) && whole_->pts == 2 * (stamp_ - 1);
}

const AVFrame* Deinterlacer::make_whole(const AVFrame* before,
                                        const AVFrame& picture,
                                        const AVFrame* after,
                                        bool top_field_first) {
  if (before != nullptr && !have_one_layout(*before, picture)) before = nullptr;
  if (after == nullptr || !have_one_layout(*after, picture)) after = &picture;
  // The first picture of a graph is made from its own rows alone, and no other one.
  if (before == nullptr && !is_fresh_) forget();
  if (!build(picture)) return nullptr;
  if (before != nullptr && is_fresh_) filter(*before, picture, *after, top_field_first);
  if (filter(before == nullptr ? picture : *before, picture, *after, top_field_first)) {
    return whole_.get();
  }
  why_not_ = "the filter bwdif made none of its pictures";
  forget();
  return nullptr;
}

}  // namespace capture
