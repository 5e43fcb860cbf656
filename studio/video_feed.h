// The videos of a set: from their sources to a frame's live textures and the lamps that they are.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/pool.h"
#include "render/area_light.h"
#include "render/video_texture.h"
#include "studio/set_scene.h"
#include "studio/timed_source.h"

namespace studio {

// A video at one time.
struct VideoFrame {
  std::shared_ptr<const render::VideoTexture> texture;
  capture::Time time{};  // of its picture
};

// One thread uses it. Each source gives its newest frame whose time is not after the show's; one
// that ends or stalls holds its last. Videos of the same source share it.
class VideoFeed {
 public:
  // Opens the sources of a set; those that `before` has open run on. Files begin at `start` of the
  // show's time, or, without one, at the next time that is asked for. `live`: the show's time is
  // the monotonic clock. Throws SetError.
  VideoFeed(const Set& set,
            std::optional<capture::Time> start,
            bool live,
            const VideoFeed* before = nullptr);

  // Where the videos shine from, after the scene has changed. Throws SetError.
  void place(const Set& set, const SetScene& scene);

  // One for each of the set's videos. Times must not fall.
  std::vector<VideoFrame> at(capture::Time time);
  // Of these frames.
  std::vector<render::LocalLight> lamps(const std::vector<VideoFrame>& frames) const;

  // Another source for the video of that name, from the next frame on; what `before` has open runs
  // on. Returns the source that it had, to be let go. Throws std::invalid_argument if there is no
  // such video, std::runtime_error if it cannot be opened.
  std::shared_ptr<void> change_source(const std::string& name,
                                      const std::string& uri,
                                      const VideoFeed* before = nullptr);

  // What went wrong since the last call, in words.
  std::vector<std::string> take_notes();

 private:
  // An open source, with the texture of its newest frame.
  struct Player {
    VideoSettings settings;
    std::unique_ptr<TimedSource> source;
    std::shared_ptr<const capture::Image> image;  // that `frame` was made from
    VideoFrame frame;
    bool reported = false;  // numbers that are none
    capture::Pool<render::VideoTexture> textures;
  };
  struct Channel {
    VideoSettings settings;
    std::shared_ptr<Player> player;
    std::vector<render::AreaLight> lights;
  };

  std::shared_ptr<Player> open(const VideoSettings& settings, const VideoFeed* before);
  void update(Player& player, capture::Time time);

  std::string base_dir_;
  bool live_ = false;
  std::optional<capture::Time> start_;  // for sources opened now; nothing = the next time asked for
  std::vector<Channel> channels_;
  std::vector<std::string> notes_;
};

}  // namespace studio
