// By how much a picture is shifted against another one, roughly, wherever that is.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace compositing {

// Of pictures of a few thousand cells: shifts at which the edges of both lie upon each other, of
// all up to a quarter of their size. By edges of the logarithm, so that neither gain nor one bright
// thing counts. Rooms repeat themselves: which of them it is has to be looked at more closely.
class CoarseShift {
 public:
  // Light of the picture that others are held against, row by row.
  CoarseShift(int rows, int columns, std::span<const float> light);

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  // The likeliest ones first, as many as stand out, and as there is room for. Allocates nothing.
  struct Shift {
    float right = 0, down = 0;  // cells
  };
  std::size_t find(std::span<const float> light, std::span<Shift> found);

 private:
  // Two planes of a picture: to the right, and down.
  using Edges = std::array<std::vector<float>, 2>;

  void find_edges(std::span<const float> light, Edges& edges) const;
  float likeness(int right, int down) const;
  float& at(int right, int down);

  int rows_, columns_, across_, along_;  // the largest shifts
  Edges plate_, seen_;
  std::vector<float> likeness_;  // by shift
};

}  // namespace compositing
