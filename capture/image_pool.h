// Images that are used again, so that a running source does not allocate.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "capture/image.h"

namespace capture {

// Lends images. One comes back when its last holder lets go, in any thread, also after the pool is
// gone. As many exist as are held at one time.
class ImagePool {
 public:
  ImagePool();
  // An image of any size and content.
  std::shared_ptr<Image> lend();

 private:
  struct Shelf {
    std::mutex mutex;
    std::vector<std::unique_ptr<Image>> images;
  };
  std::shared_ptr<Shelf> shelf_;
};

}  // namespace capture
