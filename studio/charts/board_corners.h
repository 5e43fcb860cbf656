// Corners that were seen, as OpenCV's calibrations take them.
#pragma once

#include <cstddef>
#include <vector>

#include "calibrate/lens_solve.h"

namespace studio {

// For each view, on the board and in the picture. Point3 and Point2 are of cv::Point's kind.
template <class Point3, class Point2>
struct BoardCorners {
  std::vector<std::vector<Point3>> board;
  std::vector<std::vector<Point2>> picture;

  explicit BoardCorners(const calibrate::LensProblem& problem) {
    for (const calibrate::BoardView& view : problem.views) {
      board.emplace_back();
      picture.emplace_back();
      for (std::size_t i = 0; i < view.corners.size(); ++i) {
        if (!view.corners[i]) continue;
        const calibrate::Vec3 p = corner_of(problem.board, i);
        using Scalar3 = decltype(Point3::x);
        using Scalar2 = decltype(Point2::x);
        board.back().emplace_back(static_cast<Scalar3>(p.x), static_cast<Scalar3>(p.y), Scalar3{});
        picture.back().emplace_back(static_cast<Scalar2>(view.corners[i]->x),
                                    static_cast<Scalar2>(view.corners[i]->y));
      }
    }
  }
};

}  // namespace studio
