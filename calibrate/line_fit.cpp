// A fish-eye from straight lines of the scene, where there is no board.
#include "calibrate/line_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <ceres/autodiff_cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>
#include <Eigen/LU>

#include "calibrate/keep_ceres_quiet.h"
#include "calibrate/line_planes.h"
#include "capture/median.h"

namespace calibrate {
namespace {

using Block = std::array<double, 3>;

using std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double loss_scale = line_loss_scale;

Vec3 vec_of(const Block& b) { return {b[0], b[1], b[2]}; }
Block block_of(Vec3 v) { return {v.x, v.y, v.z}; }

struct MarkCost {
  FisheyeLaw law;
  Vec2 q;
  double noise_px;
  template <class T>
  bool operator()(const T* lens, const T* normal, T* residual) const {
    if (!distance_px(law, lens, normal, q, *residual)) return false;
    *residual /= T(noise_px);
    return true;
  }
};

struct ParallelCost {
  double noise_rad;
  template <class T>
  bool operator()(const T* normal, const T* direction, T* residual) const {
    *residual = (normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2]) /
                T(noise_rad);
    return true;
  }
};

double cauchy(double r) {
  return loss_scale * loss_scale * std::log1p(r * r / (loss_scale * loss_scale));
}

Lens lens_of(FisheyeLaw law, const Block& block, const LineMarks& marks) {
  Lens lens;
  lens.width = marks.width;
  lens.height = marks.height;
  const double f = block[0];
  if (law == FisheyeLaw::equisolid) {
    lens.model = "equisolid";
    lens.parameters = {f, block[1], block[2]};
  } else {
    lens.model = "kannala_brandt";
    lens.parameters = {f, f, block[1], block[2]};
  }
  if (marks.max_angle_rad) lens.max_angle_rad = *marks.max_angle_rad;
  return lens;
}

// The lines by their words, of two or more.
struct Group {
  std::string name;
  std::vector<std::size_t> lines;
};

std::vector<Group> groups_of(const std::vector<MarkedLine>& lines) {
  std::vector<Group> groups;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].parallel.empty()) continue;
    const auto known = std::ranges::find(groups, lines[i].parallel, &Group::name);
    if (known == groups.end()) {
      groups.push_back({lines[i].parallel, {i}});
    } else {
      known->lines.push_back(i);
    }
  }
  std::erase_if(groups, [](const Group& group) { return group.lines.size() < 2; });
  return groups;
}

struct State {
  Block lens{};  // f, cx, cy
  std::vector<Block> normals;
  std::vector<Block> directions;  // of groups
  double cost = 0;
};

// Every line's plane and group's direction under a lens, each for itself.
std::optional<State> state_of(const std::vector<MarkedLine>& lines,
                              const std::vector<Group>& groups,
                              const LineFitOptions& options,
                              const Block& lens) {
  State state{lens, {}, {}, 0};
  for (const MarkedLine& line : lines) {
    const auto normal = plane_of(options.law, lens, line, options.noise_px);
    if (!normal) return std::nullopt;
    state.normals.push_back(block_of(*normal));
    const auto off = distances_px(options.law, lens, *normal, line);
    if (!off) return std::nullopt;
    for (const double d : *off) state.cost += cauchy(d / options.noise_px);
  }
  for (const Group& group : groups) {
    std::vector<Vec3> normals;
    for (const std::size_t i : group.lines) normals.push_back(vec_of(state.normals[i]));
    const Vec3 direction = common_direction(normals);
    state.directions.push_back(block_of(direction));
    for (const Vec3 n : normals) {
      state.cost += cauchy(dot(n, direction) / options.parallel_noise_rad);
    }
  }
  return state;
}

struct Solved {
  State state;
  std::array<double, 9> covariance{};  // of the lens, row by row
};

// Of the lens's parameters where the problem stands, row by row; those that are held have none.
// Nothing if they stay open. (Not by ceres::Covariance: its matrices are Eigen's on the heap, which
// libceres and we may align differently.)
std::optional<std::array<double, 9>> covariance_of(ceres::Problem& problem, State& state) {
  ceres::Problem::EvaluateOptions all;
  all.parameter_blocks.push_back(state.lens.data());
  for (Block& normal : state.normals) all.parameter_blocks.push_back(normal.data());
  for (Block& direction : state.directions) all.parameter_blocks.push_back(direction.data());
  ceres::CRSMatrix J;
  if (!problem.Evaluate(all, nullptr, nullptr, nullptr, &J)) return std::nullopt;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(J.num_cols, J.num_cols);
  for (std::size_t row = 0; row + 1 < J.rows.size(); ++row) {
    const auto begin = static_cast<std::size_t>(J.rows[row]);
    const auto end = static_cast<std::size_t>(J.rows[row + 1]);
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t j = begin; j < end; ++j) {
        information(J.cols[i], J.cols[j]) += J.values[i] * J.values[j];
      }
    }
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> solver(information);
  if (!solver.isInvertible()) return std::nullopt;
  const Eigen::MatrixXd inverse = solver.inverse();
  std::array<double, 9> covariance{};
  const int free = problem.ParameterBlockTangentSize(state.lens.data());
  for (int i = 0; i < free; ++i) {
    for (int j = 0; j < free; ++j) {
      covariance[static_cast<std::size_t>(3 * i + j)] = inverse(i, j);
    }
  }
  return covariance;
}

// Moves all of it to the least sum of losses. Nothing if lens or lines stay open.
std::optional<Solved> refine(const std::vector<MarkedLine>& lines,
                             const std::vector<Group>& groups,
                             const LineFitOptions& options,
                             State state,
                             bool with_covariance) {
  keep_ceres_quiet();
  ceres::Problem problem;
  int residuals = 0;
  problem.AddParameterBlock(state.lens.data(), 3);
  if (!options.free_centre) {
    problem.SetManifold(state.lens.data(), new ceres::SubsetManifold(3, {1, 2}));
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    problem.AddParameterBlock(state.normals[i].data(), 3, new ceres::SphereManifold<3>);
    for (const Vec2 q : lines[i].pixels) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MarkCost, 1, 3, 3>(
                                   new MarkCost{options.law, q, options.noise_px}),
                               new ceres::CauchyLoss(loss_scale), state.lens.data(),
                               state.normals[i].data());
      ++residuals;
    }
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    problem.AddParameterBlock(state.directions[g].data(), 3, new ceres::SphereManifold<3>);
    for (const std::size_t i : groups[g].lines) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ParallelCost, 1, 3, 3>(
                                   new ParallelCost{options.parallel_noise_rad}),
                               new ceres::CauchyLoss(loss_scale), state.normals[i].data(),
                               state.directions[g].data());
      ++residuals;
    }
  }
  const int freedoms = residuals - (options.free_centre ? 3 : 1) -
                       2 * static_cast<int>(lines.size() + groups.size());
  if (freedoms < 0) return std::nullopt;
  ceres::Solver::Options solving;
  solving.linear_solver_type = ceres::DENSE_QR;
  solving.max_num_iterations = 100;
  solving.function_tolerance = 1e-12;
  solving.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solving, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  state.cost = 2 * summary.final_cost;
  Solved solved{state, {}};
  if (!with_covariance) return solved;
  const auto covariance = covariance_of(problem, state);
  if (!covariance) return std::nullopt;
  solved.covariance = *covariance;
  return solved;
}

// Standard deviation by the median of what should be about 0, of which the fit takes `fitted` up.
double sigma_of(std::vector<double> off, std::size_t fitted) {
  if (off.size() <= fitted) return 0;
  const auto count = static_cast<double>(off.size());
  for (double& d : off) d = std::abs(d);
  return capture::sigma_by_median * capture::median_in_place(off) *
         std::sqrt(count / (count - static_cast<double>(fitted)));
}

// The options with what marks and parallels are off by, where that is more than they expect.
LineFitOptions as_found(const std::vector<MarkedLine>& lines,
                        const std::vector<Group>& groups,
                        LineFitOptions options,
                        const State& state) {
  std::vector<double> marks, parallels;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto off = distances_px(options.law, state.lens, vec_of(state.normals[i]), lines[i]);
    if (off) marks.insert(marks.end(), off->begin(), off->end());
  }
  std::size_t directions = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (groups[g].lines.size() < 3) continue;  // two planes always meet
    ++directions;
    for (const std::size_t i : groups[g].lines) {
      parallels.push_back(dot(vec_of(state.normals[i]), vec_of(state.directions[g])));
    }
  }
  options.noise_px = std::max(options.noise_px, sigma_of(marks, 2 * lines.size() + 1));
  options.parallel_noise_rad =
      std::max(options.parallel_noise_rad, sigma_of(parallels, 2 * directions));
  return options;
}

double farthest_mark(const LineMarks& marks, Vec2 centre) {
  double farthest = 0;
  for (const MarkedLine& line : marks.lines) {
    for (const Vec2 q : line.pixels) {
      farthest = std::max(farthest, hypotenuse(q.x - centre.x, q.y - centre.y));
    }
  }
  return farthest;
}

// Whether the farthest mark would lie farther off the axis than any lens sees. Lines through the
// middle, which agree with every focal length, end in the least one.
bool sees_too_far(const LineMarks& marks, const Block& lens, FisheyeLaw law) {
  constexpr double widest_rad = 145 * pi / 180;
  const double over = farthest_mark(marks, {lens[1], lens[2]}) / lens[0];
  return law == FisheyeLaw::equisolid ? over > 2 * std::sin(widest_rad / 2) : over > widest_rad;
}

struct Searched {
  State best;
  // The longest focal length, through which every picture is nearly flat.
  std::optional<Block> flat;
};

// The best of many focal lengths, with the centre where it is to be expected.
std::optional<Searched> search(const LineMarks& marks,
                               const std::vector<Group>& groups,
                               const LineFitOptions& options) {
  const Vec2 centre =
      marks.centre.value_or(Vec2{0.5 * (marks.width - 1), 0.5 * (marks.height - 1)});
  const double least =
      1.001 * farthest_mark(marks, centre) / (options.law == FisheyeLaw::equisolid ? 2 : pi);
  constexpr int steps = 100;
  constexpr double range = 40;
  std::optional<Searched> found;
  for (int i = 0; i <= steps; ++i) {
    const double f = least * std::pow(range, static_cast<double>(i) / steps);
    const auto state = state_of(marks.lines, groups, options, {f, centre.x, centre.y});
    if (!state) continue;
    if (!found) found = Searched{*state, {}};
    if (state->cost < found->best.cost) found->best = *state;
    if (i == steps) found->flat = state->lens;
  }
  return found;
}

double rms(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// A lens, and the options that it was found with.
struct Fitted {
  LineFitOptions options;
  Solved solved;
  double flat_cost = HUGE_VAL;
};

// By the law of the options. Nothing if lens or lines stay open.
std::optional<Fitted> fit_law(const LineMarks& marks,
                              const std::vector<Group>& groups,
                              const LineFitOptions& options) {
  const auto start = search(marks, groups, options);
  if (!start) return std::nullopt;
  auto solved = refine(marks.lines, groups, options, start->best, true);
  if (!solved) return std::nullopt;
  Fitted fitted{options, *solved};
  constexpr int rounds = 3;
  constexpr double the_same = 1.05;
  for (int round = 0; round < rounds; ++round) {
    const LineFitOptions found = as_found(marks.lines, groups, options, fitted.solved.state);
    if (found.noise_px < the_same * fitted.options.noise_px &&
        found.parallel_noise_rad < the_same * fitted.options.parallel_noise_rad) {
      break;
    }
    solved = refine(marks.lines, groups, found, fitted.solved.state, true);
    if (!solved) return std::nullopt;
    fitted = {found, *solved};
  }
  if (start->flat) {
    const auto flat = state_of(marks.lines, groups, fitted.options, *start->flat);
    if (flat) fitted.flat_cost = flat->cost;
  }
  return fitted;
}

// Pixels all over the picture, as far off the middle as marks are.
std::vector<Vec2> marked_pixels(const LineMarks& marks, Vec2 centre) {
  constexpr int across = 40;
  const double farthest = farthest_mark(marks, centre);
  std::vector<Vec2> pixels;
  for (int y = 0; y < across; ++y) {
    for (int x = 0; x < across; ++x) {
      const Vec2 q{(x + 0.5) / across * marks.width - 0.5, (y + 0.5) / across * marks.height - 0.5};
      if (hypotenuse(q.x - centre.x, q.y - centre.y) <= farthest) pixels.push_back(q);
    }
  }
  return pixels;
}

// The other law's lens, judged by the noise that the better of both leaves.
std::optional<OtherLaw> fit_other_law(const LineMarks& marks,
                                      const std::vector<Group>& groups,
                                      const LineFitOptions& options,
                                      const Fitted& ours,
                                      std::span<const Vec2> pixels) {
  LineFitOptions theirs_options = options;
  theirs_options.law =
      options.law == FisheyeLaw::equisolid ? FisheyeLaw::equidistant : FisheyeLaw::equisolid;
  const auto theirs = fit_law(marks, groups, theirs_options);
  if (!theirs || sees_too_far(marks, theirs->solved.state.lens, theirs_options.law)) {
    return std::nullopt;
  }
  const auto cost = [&](const Fitted& fitted) {
    LineFitOptions judging = fitted.options;
    judging.noise_px = std::min(ours.options.noise_px, theirs->options.noise_px);
    judging.parallel_noise_rad =
        std::min(ours.options.parallel_noise_rad, theirs->options.parallel_noise_rad);
    const auto solved = refine(marks.lines, groups, judging, fitted.solved.state, false);
    return solved ? solved->state.cost : HUGE_VAL;
  };
  OtherLaw other{lens_of(theirs_options.law, theirs->solved.state.lens, marks),
                 0,
                 cost(*theirs) - cost(ours),
                 {}};
  if (std::isnan(other.against)) return std::nullopt;
  std::vector<double> off;
  for (std::size_t i = 0; i < marks.lines.size(); ++i) {
    const auto of_line = distances_px(theirs_options.law, theirs->solved.state.lens,
                                      vec_of(theirs->solved.state.normals[i]), marks.lines[i]);
    if (of_line) off.insert(off.end(), of_line->begin(), of_line->end());
  }
  other.rms_px = rms(off);
  const auto distance =
      distance_between(lens_of(options.law, ours.solved.state.lens, marks), other.lens, pixels);
  if (!distance) return std::nullopt;
  other.distance = *distance;
  return other;
}

// Of a lens's pixels along each axis: by the focal length, and by a law between both, which the
// lines hold the better to ours the more they are against the other.
double error_of_lines(const LineFit& fit, std::span<const Vec2> pixels, Vec2 centre) {
  double squares = 0;
  for (const Vec2 q : pixels) squares += squared(Vec2{q.x - centre.x, q.y - centre.y});
  const double radius_px = std::sqrt(squares / (2 * static_cast<double>(pixels.size())));
  const double of_focal = fit.focal_sigma_px / fit.lens.parameters[0] * radius_px;
  const double of_law =
      fit.other ? fit.other->distance.axis_px / std::sqrt(1 + std::max(fit.other->against, 0.0))
                : 0;
  return std::min(std::hypot(of_focal, of_law), most_error_px(fit.lens));
}

// What a lens fitted to the other lines makes of line `i`.
void hold_out(std::size_t i,
              const LineMarks& marks,
              const LineFitOptions& options,
              const Block& start,
              LineReport& report) {
  report.heldout_px = nan;
  report.heldout_parallel_rad = nan;
  std::vector<MarkedLine> others = marks.lines;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
  const std::vector<Group> groups = groups_of(others);
  const auto state = state_of(others, groups, options, start);
  const auto solved = state ? refine(others, groups, options, *state, false) : std::nullopt;
  if (!solved) return;
  const MarkedLine& line = marks.lines[i];
  const Block& lens = solved->state.lens;
  const auto normal = plane_of(options.law, lens, line, options.noise_px);
  const auto off = normal ? distances_px(options.law, lens, *normal, line) : std::nullopt;
  if (!off) return;
  report.heldout_px = rms(*off);
  const auto group = std::ranges::find(groups, line.parallel, &Group::name);
  if (group == groups.end()) return;
  std::vector<Vec3> normals;
  for (const std::size_t j : group->lines) {
    const auto other = plane_of(options.law, lens, others[j], options.noise_px);
    if (!other) return;
    normals.push_back(*other);
  }
  report.heldout_parallel_rad = std::asin(std::abs(dot(*normal, common_direction(normals))));
}

void report_lines(const LineMarks& marks,
                  const std::vector<Group>& groups,
                  const LineFitOptions& options,
                  const Block& lens,
                  LineFit& fit) {
  double squares = 0;
  std::size_t count = 0;
  for (const MarkedLine& line : marks.lines) {
    LineReport report;
    const auto normal = plane_of(options.law, lens, line, options.noise_px);
    const auto off = normal ? distances_px(options.law, lens, *normal, line) : std::nullopt;
    if (!off) throw std::runtime_error("the lens does not see line \"" + line.name + "\"");
    report.normal_cam = *normal;
    report.rms_px = rms(*off);
    for (const double d : *off) {
      report.worst_px = std::max(report.worst_px, std::abs(d));
      squares += d * d;
    }
    count += off->size();
    fit.lines.push_back(report);
  }
  fit.rms_px = std::sqrt(squares / static_cast<double>(count));
  for (const Group& group : groups) {
    std::vector<Vec3> normals;
    for (const std::size_t i : group.lines) normals.push_back(fit.lines[i].normal_cam);
    ParallelReport parallel{group.name, group.lines.size(), common_direction(normals), 0};
    std::vector<double> angles;
    for (const std::size_t i : group.lines) {
      fit.lines[i].parallel_rad =
          std::asin(std::abs(dot(fit.lines[i].normal_cam, parallel.direction_cam)));
      angles.push_back(fit.lines[i].parallel_rad);
    }
    parallel.rms_rad = rms(angles);
    fit.parallels.push_back(parallel);
  }
}

}  // namespace

std::optional<RectangleReport> rectangle_of(const std::array<Vec3, 4>& sides,
                                            std::optional<Vec3> normal) {
  if (!normal) normal = cross(cross(sides[0], sides[2]), cross(sides[1], sides[3]));
  if (!(length(*normal) > 1e-9)) return std::nullopt;
  RectangleReport report;
  report.normal_cam = normalize(*normal);
  std::array<Vec3, 4> p;  // corners, one unit away from the camera's plane
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3 corner = cross(sides[i], sides[(i + 1) % 4]);
    const double depth = dot(corner, report.normal_cam);
    if (!(std::abs(depth) > 1e-9 * length(corner))) return std::nullopt;
    p[i] = corner / depth;
  }
  // p[i] lies between side i and the next one.
  const Vec3 first = p[0] - p[3];
  const Vec3 second = p[1] - p[0];
  const Vec3 third = p[2] - p[1];
  const Vec3 fourth = p[3] - p[2];
  const double across = length(second) + length(fourth);
  if (!(across > 1e-9 && length(first) + length(third) > 1e-9)) return std::nullopt;
  report.aspect = (length(first) + length(third)) / across;
  const std::array<Vec3, 4> around{first, second, third, fourth};
  for (std::size_t i = 0; i < around.size(); ++i) {
    const double cosine = std::abs(dot(normalize(around[i]), normalize(around[(i + 1) % 4])));
    report.off_square_rad = std::max(report.off_square_rad, std::asin(std::min(cosine, 1.0)));
  }
  return report;
}

LineFit fit_lens_to_lines(const LineMarks& marks, const LineFitOptions& expected) {
  check(marks);
  if (!(expected.noise_px > 0 && expected.parallel_noise_rad > 0)) {
    throw std::invalid_argument("expected noise must be above 0");
  }
  const std::vector<Group> groups = groups_of(marks.lines);
  const auto fitted = fit_law(marks, groups, expected);
  constexpr double most_unknown = 0.1;  // of the focal length
  const double sigma = fitted ? std::sqrt(fitted->solved.covariance[0]) : 0;
  constexpr double least_told = 9;  // three standard deviations
  if (!fitted || !(sigma < most_unknown * fitted->solved.state.lens[0]) ||
      !(fitted->solved.state.cost + least_told < fitted->flat_cost) ||
      sees_too_far(marks, fitted->solved.state.lens, expected.law)) {
    throw std::runtime_error(
        "these lines do not tell the lens: mark more, long ones that pass far from the picture's "
        "middle, or parallel ones" +
        std::string(expected.free_centre ? ", or give the centre" : ""));
  }
  const Block& lens = fitted->solved.state.lens;
  const LineFitOptions& options = fitted->options;
  const auto& covariance = fitted->solved.covariance;
  LineFit fit;
  fit.lens = lens_of(options.law, lens, marks);
  check(fit.lens);
  fit.focal_sigma_px = sigma;
  if (options.free_centre) {
    fit.centre_sigma_px = {std::sqrt(covariance[4]), std::sqrt(covariance[8])};
  }
  const Vec2 centre{lens[1], lens[2]};
  const std::vector<Vec2> pixels = marked_pixels(marks, centre);
  fit.other = fit_other_law(marks, groups, expected, *fitted, pixels);
  fit.lens.error_px = error_of_lines(fit, pixels, centre);
  report_lines(marks, groups, options, lens, fit);
  for (std::size_t i = 0; i < marks.lines.size(); ++i) {
    hold_out(i, marks, options, lens, fit.lines[i]);
  }
  for (const MarkedRectangle& marked : marks.rectangles) {
    std::array<Vec3, 4> sides;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      sides[i] = fit.lines[marked.sides[i]].normal_cam;
    }
    const auto group = std::ranges::find(fit.parallels, marked.across, &ParallelReport::name);
    auto report = rectangle_of(
        sides, group == fit.parallels.end() ? std::nullopt : std::optional(group->direction_cam));
    if (!report) throw std::runtime_error("rectangle \"" + marked.name + "\" has no area");
    report->name = marked.name;
    fit.rectangles.push_back(*report);
  }
  return fit;
}

}  // namespace calibrate
