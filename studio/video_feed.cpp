// Live textures, frame by frame.
#include "studio/video_feed.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "capture/pool.h"

namespace studio {
namespace {

bool same_source(const VideoSettings& a, const VideoSettings& b) {
  return a.source == b.source && a.loop == b.loop && a.colour == b.colour;
}

}  // namespace

// An open source, with the texture of its newest frame.
struct VideoFeed::Player {
  VideoSettings settings;
  std::unique_ptr<TimedSource> source;          // null = the plate's
  std::shared_ptr<const capture::Image> image;  // that `frame` was made from
  VideoFrame frame;
  bool reported = false;  // numbers that are none
  capture::Pool<render::VideoTexture> textures;
};

// For people.
std::string VideoFeed::name_of(const Channel& channel) const {
  if (!channel.settings.name.empty()) return fmt::format("video \"{}\"", channel.settings.name);
  return fmt::format("video {}", &channel - channels_.data() + 1);
}

VideoFeed::VideoFeed(const Set& set,
                     std::optional<capture::Time> start,
                     bool live,
                     const VideoFeed* before)
    : base_dir_(std::filesystem::absolute(set.path).parent_path().string()),
      live_(live),
      plate_(set.camera.source),
      start_(start) {
  Faults faults(set.path);
  for (const VideoSettings& video : set.videos) {
    Channel& channel = channels_.emplace_back();
    channel.settings = video;
    try {
      channel.player = open(video, before);
    } catch (const std::runtime_error& error) {
      faults.add(video.source_place, error.what());
    } catch (const std::invalid_argument& error) {
      faults.add(video.source_place, error.what());
    }
  }
  start_.reset();
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
}

std::shared_ptr<VideoFeed::Player> VideoFeed::find(const VideoSettings& settings,
                                                   const VideoFeed* before) const {
  for (const VideoFeed* feed : {this, before}) {
    if (feed == nullptr) continue;
    for (const Channel& channel : feed->channels_) {
      if (channel.player && same_source(channel.player->settings, settings)) return channel.player;
    }
  }
  return nullptr;
}

std::shared_ptr<VideoFeed::Player> VideoFeed::open(const VideoSettings& settings,
                                                   const VideoFeed* before) const {
  if (auto found = find(settings, before)) return found;
  const auto video_of = [&](const VideoSettings& s) {
    return VideoSource{s.source, base_dir_, s.loop, 0, s.colour};
  };
  auto player = std::make_shared<Player>();
  player->settings = settings;
  if (live_ && settings.source == plate_) return player;
  try {
    player->source = std::make_unique<TimedSource>(video_of(settings), start_, live_);
  } catch (const std::runtime_error& error) {
    for (const VideoFeed* feed : {this, before}) {
      if (feed == nullptr) continue;
      for (const Channel& channel : feed->channels_) {
        if (!channel.player || channel.player->settings.source != settings.source) continue;
        if (!channel.player->source || !channel.player->source->info().live) continue;
        throw std::runtime_error(error.what() + words_for_held(video_of(channel.player->settings),
                                                               video_of(settings),
                                                               feed->name_of(channel)));
      }
    }
    throw;
  }
  return player;
}

void VideoFeed::place(const Set& set, const SetScene& scene) {
  Faults faults(set.path);
  std::size_t lamps = set.lamps.size();
  std::vector<std::vector<render::AreaLight>> lights(channels_.size());
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const VideoSettings& video = channels_[i].settings;
    if (!video.lights) continue;
    try {
      lights[i] = area_lights_of(scene, i, video.samples);
      for (const render::AreaLight& light : lights[i]) lamps += light.samples.size() + 1;
      if (lamps > static_cast<std::size_t>(render::most_lights)) {
        faults.add(video.object_place,
                   fmt::format("{} lamps so far, a video light's samples and one more, but a set "
                               "holds at most {}: fewer samples",
                               lamps, render::most_lights));
        break;
      }
    } catch (const std::invalid_argument& error) {
      faults.add(video.object_place, error.what());
    }
  }
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
  for (std::size_t i = 0; i < channels_.size(); ++i) channels_[i].lights = std::move(lights[i]);
}

void VideoFeed::update(Player& player, capture::Time time, const capture::Frame& plate) {
  if (!player.source) return show(player, plate);
  TimedSource& source = *player.source;
  const std::optional<capture::Frame> frame = source.at(time);
  for (const std::string& note : source.take_notes())
    notes_.push_back("video " + player.settings.source + " " + note);
  if (frame) {
    show(player, *frame);
  } else if (player.frame.texture == nullptr) {
    show(player, source.newest());
  }
}

void VideoFeed::show(Player& player, const capture::Frame& shown) {
  if (player.frame.texture != nullptr && shown.image == player.image) return;
  auto texture = player.textures.lend();
  render::make_video_texture(shown.image ? *shown.image : capture::make_image(1, 1), *texture);
  player.image = shown.image;
  if (texture->not_numbers > 0 && !player.reported) {
    notes_.push_back(fmt::format("video {}: {} values of a picture are no numbers, and count as 0",
                                 player.settings.source, texture->not_numbers));
    player.reported = true;
  }
  player.frame = {std::move(texture), shown.time};
}

std::vector<VideoFrame> VideoFeed::at(capture::Time time, const capture::Frame& plate) {
  std::vector<VideoFrame> frames;
  for (const Channel& channel : channels_) {
    update(*channel.player, time, plate);
    frames.push_back(channel.player->frame);
  }
  return frames;
}

std::vector<render::LocalLight> VideoFeed::lamps(const std::vector<VideoFrame>& frames) const {
  std::vector<render::LocalLight> all;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const VideoSettings& video = channels_[i].settings;
    const auto& [red, green, blue] = video.gain;
    for (const render::AreaLight& light : channels_[i].lights) {
      const auto lamps =
          render::lamps_of(light, *frames[i].texture, {{red, green, blue}, video.ambient});
      all.insert(all.end(), lamps.begin(), lamps.end());
    }
  }
  return all;
}

// Of another source for the video of that name.
VideoSettings VideoFeed::settings_of(const std::string& name, const std::string& uri) const {
  const auto channel =
      std::ranges::find(channels_, name, [](const Channel& c) { return c.settings.name; });
  if (channel == channels_.end()) {
    throw std::invalid_argument(fmt::format("the set has no video named \"{}\"", name));
  }
  VideoSettings settings = channel->settings;
  settings.source = uri;
  return settings;
}

std::shared_ptr<VideoFeed::Player> VideoFeed::find_source(const std::string& name,
                                                          const std::string& uri,
                                                          const VideoFeed* before) const {
  return find(settings_of(name, uri), before);
}

std::shared_ptr<VideoFeed::Player> VideoFeed::open_source(const std::string& name,
                                                          const std::string& uri) const {
  return open(settings_of(name, uri), nullptr);
}

std::shared_ptr<VideoFeed::Player> VideoFeed::take_source(const std::string& name,
                                                          std::shared_ptr<Player> player) {
  VideoSettings settings = settings_of(name, player->settings.source);
  if (!same_source(settings, player->settings)) return nullptr;
  const auto channel =
      std::ranges::find(channels_, name, [](const Channel& c) { return c.settings.name; });
  channel->settings = std::move(settings);
  return std::exchange(channel->player, std::move(player));
}

std::vector<std::string> VideoFeed::take_notes() { return std::exchange(notes_, {}); }

}  // namespace studio
