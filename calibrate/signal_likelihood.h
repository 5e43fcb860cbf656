// How likely two sampled signals are averages of one random process, at a time offset.
#pragma once

#include <span>
#include <vector>

#include "calibrate/time_offset.h"

namespace calibrate {

// A covariance over time.
struct Smoothness {
  int order = 0;         // Matern's 1/2, 3/2, 5/2: 0, 1, 2
  double scale_s = 0.1;  // over which it falls
  double noise = 1e-3;   // variance of each sample's own noise, in parts of the process's
};

// Two signals cut into stretches that are taken for independent, so that the work grows with their
// length only.
class SignalLikelihood {
 public:
  // Of B's samples, those go with a stretch of A's that lie there at about this offset.
  SignalLikelihood(std::span<const SignalSample> a,
                   std::span<const SignalSample> b,
                   double about_offset_s,
                   double gain_b);

  // The logarithm, but for a constant, of every stride-th stretch.
  double log_likelihood(const Smoothness& smoothness,
                        double offset_s,
                        std::size_t stride = 1) const;
  // The same for each stretch, the process's variance being that of all; they sum up to it.
  std::vector<double> of_stretches(const Smoothness& smoothness, double offset_s) const;
  std::size_t stretches() const { return stretches_.size(); }
  double interval_s() const { return interval_s_; }  // between frames, of the slower camera

 private:
  struct Terms {
    double squares = 0;  // of the whitened samples
    double log_determinant = 0;
    double count = 0;
  };
  struct Stretch {
    std::vector<SignalSample> samples;  // A's, then B's
    std::size_t of_a = 0;
  };
  std::vector<Terms> terms(const Smoothness& smoothness, double offset_s, std::size_t stride) const;

  std::vector<Stretch> stretches_;
  double interval_s_ = 0;
};

}  // namespace calibrate
