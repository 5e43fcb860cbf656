// Containers of video and sound, through libav. For the files that wrap libav.
#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>

#include "capture/frame.h"
#include "capture/libav.h"

struct AVStream;

namespace capture {

// Throws std::runtime_error with path and reason unless it is a file that can be read and is not
// empty.
void check_is_file(const std::string& path);

enum class Track { video, sound };

// An open container: its best video stream and, if it has any, the sound that goes with it.
// Playlists and other files that point elsewhere are refused.
//
// MPEG's streams may have been joined: then the stamps of both tracks jump there, back by more than
// 1 s or on by more than 10 s. They are moved so that the pictures go on, and the sound with them.
class MediaFile {
 public:
  // Throws std::runtime_error with path, reason and what to do.
  explicit MediaFile(const std::string& path);

  const std::string& path() const { return path_; }
  AVFormatContext& context() const { return *context_; }
  AVStream& video() const { return *video_; }
  AVStream* sound() const { return sound_; }  // null if silent

  // The next packet of a track; null at the end. Packets of the other track that lie before it wait
  // in memory, up to a bound: beyond it the oldest of the sound are dropped, but none of the video,
  // and this returns null for the sound although the file goes on, until some of them are read.
  libav::PacketHandle next_packet(Track track);
  // Whether nothing more can be read: what waits in memory is the rest.
  bool at_end() const { return at_end_; }
  // Whether packets of the track lie in memory already.
  bool has_packet(Track track) const { return !waiting_[index(track)].empty(); }

  // The latest stamp of a picture that was read, in the video's time base.
  std::optional<std::int64_t> latest_picture() const { return latest_picture_; }
  // As the file tells it; nothing where it does not, or is only guessed at.
  std::optional<Time> length() const;

  // After the end: the time of pictures that the file tells of and that were not there; nothing
  // where it tells none, or is only guessed at.
  std::optional<Time> missing_pictures() const;

  // From now on it is silent.
  void leave_sound_out();

  // Back to the beginning, or to the last picture at or before `pts` (the video's time base) from
  // which decoding can start. Returns whether the container can; MPEG's streams cannot rewind.
  bool rewind();
  bool seek(std::int64_t pts);

 private:
  static std::size_t index(Track track) { return track == Track::video ? 0 : 1; }
  libav::PacketHandle read();
  libav::PacketHandle read_as_stamped();
  std::optional<Track> track_of(const AVPacket& packet) const;
  bool stamps_may_jump() const;
  std::optional<Time> time_of(const AVPacket& packet, Track track) const;
  Time jump_of(const AVPacket& packet, Track track) const;
  const AVPacket* look_ahead(Track track);
  void find_join(const AVPacket& packet, Track track);
  void move(AVPacket& packet, Track track);

  std::string path_;
  libav::FormatContext context_;
  AVStream* video_ = nullptr;
  AVStream* sound_ = nullptr;
  std::array<std::deque<libav::PacketHandle>, 2> waiting_;
  std::int64_t waiting_bytes_ = 0;
  bool at_end_ = false;
  std::deque<libav::PacketHandle> ahead_;    // read, to find out about a jump
  std::array<std::optional<Time>, 2> ends_;  // of the tracks' last packets, moved
  Time moved_by_{};
  std::optional<std::int64_t> latest_picture_;
  std::int64_t pictures_end_ = 0;  // of all that were ever read, in the video's time base
};

}  // namespace capture
