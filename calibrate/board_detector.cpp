// Finders in a helper program, one after the other.
#include "calibrate/board_detector.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "calibrate/board_grid.h"
#include "calibrate/charuco.h"
#include "calibrate/corner_refinement.h"
#include "calibrate/detect_wire.h"
#include "calibrate/marker_bits.h"
#include "calibrate/tangent_views.h"
#include "capture/sandbox.h"

namespace calibrate {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::size_t min_charuco_corners = 6;
constexpr double min_refined = 0.8;  // of the corners found
constexpr int quick_side = 1000;     // the longer side of pictures for the fast finder
constexpr int usual_side = 2000;

std::string seconds_text(Seconds time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f s", time.count());
  return text.data();
}

// A file in memory, for a helper's standard input.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("pictures", MFD_CLOEXEC)) {
    if (fd_ < 0) fail();
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  template <class T>
  void append(const T& value) {
    append(std::as_bytes(std::span(&value, 1)));
  }
  void append(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t done = write(fd_, bytes.data(), bytes.size());
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) fail();
      bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
  }
  int rewound() {
    if (lseek(fd_, 0, SEEK_SET) < 0) fail();
    return fd_;
  }

 private:
  [[noreturn]] static void fail() {
    throw std::runtime_error("cannot hand pictures to the finders: " +
                             std::generic_category().message(errno));
  }
  int fd_;
};

// What a finder found in one picture, in that picture's pixels.
struct Found {
  std::vector<Vec2> points;
  std::vector<std::int32_t> ids;  // of markers, one for each four points
};

// Nothing if the helper ended before it answered, or answers what cannot be.
std::optional<Found> receive(capture::SandboxedChild& child, wire::Finder finder) {
  wire::Reply reply;
  if (!child.read(std::as_writable_bytes(std::span(&reply, 1)))) return std::nullopt;
  if (reply.points > wire::max_points) return std::nullopt;
  Found found;
  found.points.resize(reply.points);
  if (!child.read(std::as_writable_bytes(std::span(found.points)))) return std::nullopt;
  for (const Vec2& q : found.points) {
    if (!std::isfinite(q.x) || !std::isfinite(q.y)) return std::nullopt;
  }
  if (finder == wire::Finder::markers) {
    found.ids.resize(reply.points / 4);
    if (!child.read(std::as_writable_bytes(std::span(found.ids)))) return std::nullopt;
  }
  return found;
}

// Of the same picture, no larger than this.
GreyPicture limited(const GreyPicture& picture, int side) {
  const int longer = std::max(picture.width, picture.height);
  if (longer <= side) return picture;
  const double scale = static_cast<double>(side) / longer;
  const auto scaled = [&](int size) {
    return std::max(1, static_cast<int>(std::lround(size * scale)));
  };
  return resized(picture, scaled(picture.width), scaled(picture.height));
}

Lens made_fisheye(const GreyPicture& picture) {
  const double focal_px = std::max(picture.width, picture.height) / std::numbers::pi;
  return {"kannala_brandt",
          picture.width,
          picture.height,
          {focal_px, focal_px, (picture.width - 1) / 2.0, (picture.height - 1) / 2.0}};
}

// One search for a board: time, what was tried, what came of it.
class Search {
 public:
  Search(const GreyPicture& picture, const Board& board, const DetectionOptions& options)
      : picture_(picture),
        board_(board),
        lens_(options.lens),
        quick_(options.quick),
        start_(Clock::now()),
        deadline_(start_ + options.time_limit) {
    if (!lens_ && options.fisheye) lens_ = made_fisheye(picture);
    if (board.kind == Board::Kind::charuco) dictionary_ = *dictionary_number(board.dictionary);
  }

  BoardDetection run();

 private:
  // How a point of a picture that was looked at lies in the whole picture.
  using Map = std::function<std::optional<Vec2>(std::size_t picture, Vec2 q)>;

  bool try_whole(const char* name, wire::Finder finder, const GreyPicture& picture, double share);
  bool try_views(const char* name, wire::Finder finder);
  bool try_markers(bool bent);
  bool try_pictures(const char* name,
                    wire::Finder finder,
                    std::span<const GreyPicture* const> pictures,
                    double share,
                    const Map& map,
                    const Lens* lens);
  std::string accept(const Found& found, std::size_t picture, const Map& map, const Lens* lens);
  void note(const std::string& what) { notes_ += (notes_.empty() ? "" : ", ") + what; }

  const GreyPicture& picture_;
  const Board& board_;
  std::optional<Lens> lens_;
  bool quick_ = false;
  int dictionary_ = 0;
  Clock::time_point start_;
  Clock::time_point deadline_;
  BoardDetection result_;
  std::string notes_;
  bool late_ = false;  // a finder was ended, or not begun, for want of time
};

// Takes what was found if it can be the board; else says why it cannot.
std::string Search::accept(const Found& found,
                           std::size_t picture,
                           const Map& map,
                           const Lens* lens) {
  std::vector<std::optional<Vec2>> points;
  for (const Vec2& q : found.points) points.push_back(map(picture, q));
  BoardView view;
  if (board_.kind == Board::Kind::chessboard) {
    view.corners = std::move(points);
    if (view.corners.size() != board_.corner_count()) return "found nothing";
    order_corners(picture_, board_, view);
  } else {
    std::vector<SeenMarker> markers;
    for (std::size_t i = 0; i < found.ids.size(); ++i) {
      SeenMarker marker{found.ids[i], {}};
      bool seen = true;
      for (std::size_t k = 0; k < 4; ++k) {
        const auto& q = points[4 * i + k];
        seen &= q.has_value();
        if (q) marker.corners[k] = *q;
      }
      if (seen) markers.push_back(marker);
    }
    if (markers.empty()) return "found nothing";
    view = corners_of_markers(board_, markers);
    if (count_corners(view) < min_charuco_corners) return "found too few markers";
  }
  if (const std::string fault = grid_fault(picture_, board_, view); !fault.empty()) {
    return "found what is no such board (" + fault + ")";
  }
  BoardView refined = lens != nullptr ? refine_corners(picture_, view, board_, *lens)
                                      : refine_corners(picture_, view, board_);
  const std::size_t seen = count_corners(refined);
  if (board_.kind == Board::Kind::charuco
          ? seen < min_charuco_corners
          : static_cast<double>(seen) < min_refined * static_cast<double>(count_corners(view))) {
    return "found corners that are too blurred, too small or none";
  }
  if (const std::string fault = grid_fault(picture_, board_, refined); !fault.empty()) {
    return "found what is no such board (" + fault + ")";
  }
  if (board_.kind == Board::Kind::chessboard) {
    if (ends_early(board_, refined)) return "found a smaller board";
    if (goes_on(picture_, board_, refined)) return "found a part of a larger board";
  }
  result_.view = std::move(refined);
  return "";
}

// Looks in pictures one after the other, for a share of the time that is left. True if found.
bool Search::try_pictures(const char* name,
                          wire::Finder finder,
                          std::span<const GreyPicture* const> pictures,
                          double share,
                          const Map& map,
                          const Lens* lens) {
  MemoryFile file;
  file.append(wire::Request{finder, board_.columns, board_.rows, dictionary_,
                            static_cast<std::uint32_t>(pictures.size())});
  for (const GreyPicture* picture : pictures) {
    file.append(wire::Picture{picture->width, picture->height});
    file.append(std::as_bytes(std::span(picture->pixels)));
  }
  const auto begin = Clock::now();
  const auto time =
      std::chrono::duration_cast<std::chrono::milliseconds>(share * (deadline_ - begin));
  if (time.count() <= 0) {
    note(std::string(name) + " had no time left");
    late_ = true;
    return false;
  }
  capture::SandboxedChild child(capture::helper_path("platelight-detect"), file.rewound(), time);
  std::string outcome = "found nothing";
  try {
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const std::optional<Found> found = receive(child, finder);
      if (!found) {
        const std::string ending = child.ending();
        outcome = "failed: " + (ending.empty() ? "its answer makes no sense" : ending);
        break;
      }
      const std::string fault = accept(*found, i, map, lens);
      if (fault.empty()) {
        result_.finder = name;
        return true;
      }
      if (fault != "found nothing") outcome = fault;
    }
  } catch (const std::runtime_error&) {
    if (Clock::now() < begin + time) throw;
    late_ = true;
    outcome = "was ended after " + seconds_text(time);
  }
  note(name + (" " + outcome));
  return false;
}

bool Search::try_whole(const char* name,
                       wire::Finder finder,
                       const GreyPicture& picture,
                       double share) {
  const double sx = static_cast<double>(picture_.width) / picture.width;
  const double sy = static_cast<double>(picture_.height) / picture.height;
  const GreyPicture* const one = &picture;
  return try_pictures(
      name, finder, {&one, 1}, share,
      [&](std::size_t, Vec2 q) {
        return Vec2{(q.x + 0.5) * sx - 0.5, (q.y + 0.5) * sy - 0.5};
      },
      nullptr);
}

bool Search::try_views(const char* name, wire::Finder finder) {
  // Cutting them must leave time to look into them.
  const auto now = Clock::now();
  const std::vector<TangentView> views =
      tangent_views(stretched(picture_), *lens_, now + (deadline_ - now) / 3);
  std::vector<const GreyPicture*> pictures;
  for (const TangentView& view : views) pictures.push_back(&view.picture);
  return try_pictures(
      name, finder, pictures, 1,
      [&](std::size_t i, Vec2 q) { return project(*lens_, views[i].ray(q)); }, &*lens_);
}

// Of few markers the larger picture may show more; the better of both is kept.
bool Search::try_markers(bool bent) {
  const bool found = try_whole("detectMarkers", wire::Finder::markers, picture_, 0.4);
  if (!found || 2 * count_corners(*result_.view) < board_.corner_count()) {
    const BoardDetection first = result_;
    const bool small = std::max(picture_.width, picture_.height) <= usual_side / 2;
    const GreyPicture clear =
        small ? stretched(resized(picture_, 2 * picture_.width, 2 * picture_.height))
              : stretched(picture_);
    try_whole(
        small ? "detectMarkers after stretching and enlarging" : "detectMarkers after stretching",
        wire::Finder::markers, clear, bent ? 0.6 : 1);
    if (first.view && count_corners(*first.view) >= count_corners(*result_.view)) result_ = first;
  }
  return result_.view ||
         (bent && try_views("detectMarkers in straightened views", wire::Finder::markers));
}

BoardDetection Search::run() {
  // Shares of the time that is left, so that what one finder does not use goes to the next ones.
  const bool bent = lens_ && lens_->model != "pinhole";
  const auto found = [&] {
    if (quick_) {
      return board_.kind == Board::Kind::charuco
                 ? try_whole("detectMarkers", wire::Finder::markers, picture_, 1)
                 : try_whole("findChessboardCorners", wire::Finder::chessboard,
                             limited(picture_, quick_side), 1);
    }
    if (board_.kind == Board::Kind::charuco) {
      return try_markers(bent);
    }
    return try_whole("findChessboardCorners", wire::Finder::chessboard,
                     limited(picture_, quick_side), 0.1) ||
           try_whole("findChessboardCornersSB", wire::Finder::sector_based,
                     limited(picture_, usual_side), 0.3) ||
           try_whole("findChessboardCornersSB after stretching", wire::Finder::sector_based,
                     stretched(limited(picture_, usual_side)), 0.4) ||
           try_whole("exhaustive findChessboardCornersSB", wire::Finder::sector_based_exhaustively,
                     picture_, bent ? 0.5 : 1) ||
           (bent &&
            try_views("findChessboardCornersSB in straightened views", wire::Finder::sector_based));
  }();
  const auto end = Clock::now();
  result_.time_ms = std::chrono::duration<double, std::milli>(end - start_).count();
  if (!found) {
    const bool late = late_ || end >= deadline_;
    result_.reason = (late ? "no board within the time limit of " + seconds_text(deadline_ - start_)
                           : "no board in " + seconds_text(end - start_)) +
                     ": " + notes_;
  }
  return std::move(result_);
}

}  // namespace

BoardDetection detect_board(const GreyPicture& picture,
                            const Board& board,
                            const DetectionOptions& options) {
  check(picture);
  check(board);
  if (board.kind == Board::Kind::charuco) {
    marker_bits(board.dictionary, static_cast<int>(marker_squares(board).size()));
  }
  if (options.time_limit.count() <= 0) {
    throw std::invalid_argument("a time limit must be above 0");
  }
  if (options.lens) {
    check(*options.lens);
    if (options.lens->width != picture.width || options.lens->height != picture.height) {
      throw std::invalid_argument("the guess of the lens is not of the picture's size");
    }
  }
  return Search(picture, board, options).run();
}

}  // namespace calibrate
