// The videos of a set: from their sources to a frame's live textures and the lamps that they are.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

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
// that ends or stalls holds its last. Videos of the same source share it; those of a live plate's
// camera, which is open already, show the frame's plate.
class VideoFeed {
 public:
  struct Player;  // an open source

  // Opens the sources of a set; those that `before` has open run on. Files begin at `start` of the
  // show's time, or, without one, at the next time that is asked for. `live`: the show's time is
  // the monotonic clock. Throws SetError.
  VideoFeed(const Set& set,
            std::optional<capture::Time> start,
            bool live,
            const VideoFeed* before = nullptr);

  // Where the videos shine from, after the scene has changed. Throws SetError.
  void place(const Set& set, const SetScene& scene);

  // One for each of the set's videos, beside the show's plate. Times must not fall.
  std::vector<VideoFrame> at(capture::Time time, const capture::Frame& plate);
  // Of these frames.
  std::vector<render::LocalLight> lamps(const std::vector<VideoFrame>& frames) const;

  // Another source for the video of that name, if this or `before` has it open, which then shares
  // it; else null. Throws std::invalid_argument if there is no such video.
  std::shared_ptr<Player> find_source(const std::string& name,
                                      const std::string& uri,
                                      const VideoFeed* before = nullptr) const;
  // The same; opens it if need be. Throws std::runtime_error if it cannot be opened.
  std::shared_ptr<Player> open_source(const std::string& name, const std::string& uri) const;
  // Shows it as that video from the next frame on; gives back the source that it had, to be let go.
  // Null, and nothing done, where the video is to be read in another way than it was opened for.
  // Throws std::invalid_argument if there is no such video.
  std::shared_ptr<Player> take_source(const std::string& name, std::shared_ptr<Player> player);

  // What went wrong since the last call, in words.
  std::vector<std::string> take_notes();

 private:
  struct Channel {
    VideoSettings settings;
    std::shared_ptr<Player> player;
    std::vector<render::AreaLight> lights;
  };

  std::string name_of(const Channel& channel) const;
  VideoSettings settings_of(const std::string& name, const std::string& uri) const;
  std::shared_ptr<Player> find(const VideoSettings& settings, const VideoFeed* before) const;
  std::shared_ptr<Player> open(const VideoSettings& settings, const VideoFeed* before) const;
  void update(Player& player, capture::Time time, const capture::Frame& plate);
  void show(Player& player, const capture::Frame& frame);

  std::string base_dir_;
  bool live_ = false;
  std::string plate_;                   // the set's camera
  std::optional<capture::Time> start_;  // for sources opened now; nothing = the next time asked for
  std::vector<Channel> channels_;
  std::vector<std::string> notes_;
};

}  // namespace studio
