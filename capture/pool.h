// Things that are used again, so that a running source does not allocate.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace capture {

// Lends things. One comes back when its last holder lets go, in any thread, also after the pool is
// gone. As many exist as are held at one time.
template <class T>
class Pool {
 public:
  // One of any content: new, or as its last holder left it.
  std::shared_ptr<T> lend() {
    std::unique_ptr<T> one;
    {
      const std::lock_guard lock(shelf_->mutex);
      if (!shelf_->things.empty()) {
        one = std::move(shelf_->things.back());
        shelf_->things.pop_back();
      }
    }
    if (!one) one = std::make_unique<T>();
    return {one.release(), [shelf = shelf_](T* returned) {
              std::unique_ptr<T> owned(returned);
              const std::lock_guard lock(shelf->mutex);
              if (shelf->things.size() < most_kept) shelf->things.push_back(std::move(owned));
            }};
  }

 private:
  // More than these are not kept: a consumer that once held many does not cost memory for ever.
  static constexpr std::size_t most_kept = 4;

  struct Shelf {
    std::mutex mutex;
    std::vector<std::unique_ptr<T>> things;
  };
  std::shared_ptr<Shelf> shelf_ = std::make_shared<Shelf>();
};

}  // namespace capture
