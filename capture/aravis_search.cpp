// Cameras that come back.
#include "capture/aravis_search.h"

#include <stdexcept>
#include <utility>

namespace capture {
namespace {

using namespace std::chrono_literals;

constexpr auto search_period = 200ms;

}  // namespace

AravisSearch::AravisSearch(std::unique_ptr<AravisStream> gone,
                           AravisDevice device,
                           AravisRequest request)
    : device_(std::move(device)), request_(std::move(request)) {
  thread_ = std::thread([this, stream = std::move(gone)]() mutable { search(std::move(stream)); });
}

AravisSearch::~AravisSearch() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void AravisSearch::search(std::unique_ptr<AravisStream> gone) {
  gone.reset();
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    std::unique_ptr<AravisStream> stream;
    std::string fault;
    try {
      stream = std::make_unique<AravisStream>(device_, request_);
      const AravisDevice& there = stream->device();
      if (there.model != device_.model || there.serial != device_.serial) {
        fault = "another camera is there: " + there.model + " " + there.serial;
        stream.reset();
      }
    } catch (const std::exception& error) {
      fault = error.what();
    }
    lock.lock();
    fault_ = fault;
    if (stream) {
      found_ = std::move(stream);
      changed_.notify_all();
      return;
    }
    changed_.wait_for(lock, search_period, [this] { return stopping_; });
  }
}

std::unique_ptr<AravisStream> AravisSearch::wait_until(std::chrono::steady_clock::time_point time) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, time, [this] { return found_ != nullptr; });
  return std::move(found_);
}

std::string AravisSearch::last_fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

}  // namespace capture
