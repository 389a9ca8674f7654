#include "palpate/surface/clean_points.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"

namespace palpate {

namespace {

// All work is done over the image plane of the camera at the origin: u = x/z, v = y/z, and the inverse depth w = 1/z,
// in which a plane is exactly linear and in which noise acts, because a point moves along its ray only.
constexpr double kSteepest = 5.0;             // depth per lateral mm; beyond (79 degrees) a slope is a depth edge
constexpr double kUnknownDeviation_mm = 0.3;  // where the cloud brings none
constexpr double kMinDeviation_mm = 0.02;
constexpr int kMinPoints = 50;
constexpr int kMinForAFit = 12;

struct Sight {
  double u, v, w;  ///< viewing ray and inverse depth, 1/mm
  float sigma_w;   ///< one standard deviation of w
  int source;      ///< number in the cloud
};

/// Coarse view of the surface in one cell of the image plane: w = w0 + gu (u - u0) + gv (v - v0).
struct Cell {
  double u0 = 0, v0 = 0, w0 = 0, gu = 0, gv = 0;
  bool valid = false;
};

/// Viewing rays sorted into square cells of the image plane.
struct SightGrid {
  double u_min = 0, v_min = 0, pitch = 0;
  int columns = 0, rows = 0;
  std::vector<int> first;  ///< per cell, and the end
  std::vector<Sight> sights;

  int column_of(double u) const { return std::clamp(static_cast<int>((u - u_min) / pitch), 0, columns - 1); }
  int row_of(double v) const { return std::clamp(static_cast<int>((v - v_min) / pitch), 0, rows - 1); }
  size_t cell(int row, int column) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column);
  }

  template <class Visit>
  void for_each_around(int row, int column, int reach, Visit visit) const {
    for (int r = std::max(0, row - reach); r <= std::min(rows - 1, row + reach); ++r) {
      const int begin = first[cell(r, std::max(0, column - reach))];
      const int end = first[cell(r, std::min(columns - 1, column + reach)) + 1];
      for (int i = begin; i < end; ++i) visit(sights[static_cast<size_t>(i)]);
    }
  }
};

std::vector<Sight> sights_of(const PointCloud& cloud) {
  std::vector<Sight> sights;
  sights.reserve(cloud.size());
  const bool has_deviation = cloud.depth_deviation_mm.size() == cloud.size();
  for (size_t i = 0; i < cloud.size(); ++i) {
    const Vec3& p = cloud.position_mm[i];
    if (!p.allFinite() || p.z() <= 0) continue;
    double deviation = has_deviation ? cloud.depth_deviation_mm[i] : kUnknownDeviation_mm;
    if (!std::isfinite(deviation) || deviation <= 0) deviation = kUnknownDeviation_mm;
    const double w = 1 / p.z();
    sights.push_back({p.x() * w, p.y() * w, w, static_cast<float>(std::max(deviation, kMinDeviation_mm) * w * w),
                      static_cast<int>(i)});
  }
  return sights;
}

/// Cells of a third of the spacing at the middle depth.
SightGrid make_grid(std::vector<Sight> sights, double spacing_mm) {
  SightGrid grid;
  double u_max = -1e9, v_max = -1e9;
  grid.u_min = grid.v_min = 1e9;
  std::vector<double> depths;
  depths.reserve(sights.size());
  for (const Sight& s : sights) {
    grid.u_min = std::min(grid.u_min, s.u);
    grid.v_min = std::min(grid.v_min, s.v);
    u_max = std::max(u_max, s.u);
    v_max = std::max(v_max, s.v);
    depths.push_back(s.w);
  }
  constexpr double kMaxCells = 4e6;
  grid.pitch = std::max({spacing_mm / 3 * median_in_place(depths),
                         std::sqrt((u_max - grid.u_min) * (v_max - grid.v_min) / kMaxCells),
                         (u_max - grid.u_min) / kMaxCells, (v_max - grid.v_min) / kMaxCells, 1e-9});
  grid.columns = static_cast<int>((u_max - grid.u_min) / grid.pitch) + 1;
  grid.rows = static_cast<int>((v_max - grid.v_min) / grid.pitch) + 1;
  grid.first.assign(static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows) + 1, 0);
  std::vector<size_t> cell_of(sights.size());
  for (size_t i = 0; i < sights.size(); ++i) {
    cell_of[i] = grid.cell(grid.row_of(sights[i].v), grid.column_of(sights[i].u));
    ++grid.first[cell_of[i] + 1];
  }
  for (size_t c = 1; c < grid.first.size(); ++c) grid.first[c] += grid.first[c - 1];
  std::vector<int> next(grid.first.begin(), grid.first.end() - 1);
  grid.sights.resize(sights.size());
  for (size_t i = 0; i < sights.size(); ++i) grid.sights[static_cast<size_t>(next[cell_of[i]]++)] = sights[i];
  return grid;
}

/// Median inverse depth of three by three cells, and its slope from the medians beside.
std::vector<Cell> coarse_surface(const SightGrid& grid) {
  std::vector<Cell> cells(grid.first.size() - 1);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    std::vector<float> around;
    for (int column = 0; column < grid.columns; ++column) {
      const size_t c = grid.cell(row, column);
      const int begin = grid.first[c], end = grid.first[c + 1];
      if (begin == end) continue;
      Cell& cell = cells[c];
      around.clear();
      grid.for_each_around(row, column, 1, [&](const Sight& s) { around.push_back(static_cast<float>(s.w)); });
      cell.w0 = static_cast<double>(median_in_place(around));
      for (int i = begin; i < end; ++i) {
        cell.u0 += grid.sights[static_cast<size_t>(i)].u / (end - begin);
        cell.v0 += grid.sights[static_cast<size_t>(i)].v / (end - begin);
      }
      cell.valid = around.size() >= 3;
    }
  });
  return cells;
}

/// Slopes by the difference of the two neighbours that exist; cells on a depth edge become invalid.
void find_slopes(const SightGrid& grid, std::vector<Cell>& cells) {
  std::vector<char> steep(cells.size(), 0);
  const auto slope = [&](const Cell& here, int row, int column, int dr, int dc) {
    const Cell* ends[2] = {&here, &here};
    for (int side = 0; side < 2; ++side) {
      const int r = row + (side ? dr : -dr), c = column + (side ? dc : -dc);
      if (r < 0 || c < 0 || r >= grid.rows || c >= grid.columns) continue;
      const Cell& other = cells[grid.cell(r, c)];
      if (other.valid) ends[side] = &other;
    }
    const double apart = dc ? ends[1]->u0 - ends[0]->u0 : ends[1]->v0 - ends[0]->v0;
    return apart > 0.2 * grid.pitch ? (ends[1]->w0 - ends[0]->w0) / apart : 0.0;
  };
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const size_t c = grid.cell(row, column);
      Cell& cell = cells[c];
      if (!cell.valid) continue;
      cell.gu = slope(cell, row, column, 0, 1);
      cell.gv = slope(cell, row, column, 1, 0);
      // dz/dx in mm per mm: z = 1/w, x = u z.
      steep[c] = std::hypot(cell.gu, cell.gv) / cell.w0 > kSteepest;
    }
  });
  for (size_t c = 0; c < cells.size(); ++c)
    if (steep[c]) cells[c].valid = false;
}

/// Drops the fraction of points that stand farthest from their neighbourhood, in units of their own deviation, and all
/// points of invalid cells.
std::vector<Sight> without_outliers(const SightGrid& grid, const std::vector<Cell>& cells, double fraction) {
  std::vector<float> isolation(grid.sights.size(), -1);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const size_t c = grid.cell(row, column);
      const Cell& cell = cells[c];
      if (!cell.valid) continue;
      for (int i = grid.first[c]; i < grid.first[c + 1]; ++i) {
        const Sight& s = grid.sights[static_cast<size_t>(i)];
        const double expected = cell.w0 + cell.gu * (s.u - cell.u0) + cell.gv * (s.v - cell.v0);
        isolation[static_cast<size_t>(i)] =
            static_cast<float>(std::abs(s.w - expected) / static_cast<double>(s.sigma_w));
      }
    }
  });
  std::vector<float> ranked;
  for (float value : isolation)
    if (value >= 0) ranked.push_back(value);
  if (ranked.empty()) return {};
  const size_t kept =
      std::min(ranked.size() - 1, static_cast<size_t>((1 - fraction) * static_cast<double>(ranked.size())));
  std::nth_element(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(kept), ranked.end());
  const float limit = ranked[kept];
  std::vector<Sight> left;
  left.reserve(grid.sights.size());
  for (size_t i = 0; i < isolation.size(); ++i)
    if (isolation[i] >= 0 && isolation[i] <= limit) left.push_back(grid.sights[i]);
  return left;
}

/// Cells at least `distance_mm` apart in space, taken greedily row by row.
std::vector<size_t> thin(const SightGrid& grid, const std::vector<Cell>& cells, double distance_mm) {
  std::vector<char> taken(cells.size(), 0);
  std::vector<size_t> result;
  const auto position = [](const Cell& cell) { return Vec3(cell.u0 / cell.w0, cell.v0 / cell.w0, 1 / cell.w0); };
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const size_t c = grid.cell(row, column);
      if (!cells[c].valid) continue;
      const Vec3 here = position(cells[c]);
      const int reach = std::min(40, static_cast<int>(distance_mm * cells[c].w0 / grid.pitch) + 1);
      bool is_free = true;
      for (int r = std::max(0, row - reach); r <= row && is_free; ++r)
        for (int k = std::max(0, column - reach); k <= std::min(grid.columns - 1, column + reach) && is_free; ++k)
          if (const size_t other = grid.cell(r, k); taken[other])
            is_free = (position(cells[other]) - here).squaredNorm() >= distance_mm * distance_mm;
      if (!is_free) continue;
      taken[c] = 1;
      result.push_back(c);
    }
  }
  return result;
}

struct Fit {
  bool valid = false;
  double w = 0, deviation_w = 0, slope = 0;
  int points = 0;
};

/// Quadratic moving least squares of w over (a, b), the lateral offset from the sample in mm: weights fall off along
/// the surface (Gaussian), with the deviation of each point, and with its residual (Tukey), so that outliers and a
/// second layer behind a depth edge do not pull.
Fit fit_surface(const SightGrid& grid, const Cell& sample, double reach_mm) {
  using Vec6 = Eigen::Matrix<double, 6, 1>;
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  struct Near {
    Vec6 basis;
    double w, sigma, along;
  };
  thread_local std::vector<Near> near;
  near.clear();
  const double z0 = 1 / sample.w0;
  const double gradient[2] = {-sample.gu * z0, -sample.gv * z0};  // dz per lateral mm
  const double gaussian = 2 / (reach_mm * reach_mm);              // standard deviation = half the reach
  const double curvature_w = 0.25 * reach_mm * sample.w0 * sample.w0;
  const int reach = static_cast<int>(reach_mm * sample.w0 / grid.pitch) + 1;
  grid.for_each_around(grid.row_of(sample.v0), grid.column_of(sample.u0), reach, [&](const Sight& s) {
    const double a = (s.u - sample.u0) * z0, b = (s.v - sample.v0) * z0;
    const double dz = gradient[0] * a + gradient[1] * b;
    const double squared = a * a + b * b + dz * dz;
    if (squared > reach_mm * reach_mm) return;
    const double w = s.w - sample.w0, plane = (sample.gu * a + sample.gv * b) * sample.w0;
    const double sigma = static_cast<double>(s.sigma_w);
    if (std::abs(w - plane) > 6 * sigma + curvature_w) return;
    near.push_back({(Vec6() << 1, a, b, a * a, a * b, b * b).finished(), w, sigma, std::exp(-gaussian * squared)});
  });
  Fit fit;
  fit.points = static_cast<int>(near.size());
  if (fit.points < kMinForAFit) return fit;
  Vec6 c = Vec6::Zero();
  double scale = 0;  // of the residuals in units of the stated deviations; 0 = not known yet
  for (int round = 0; round < 3; ++round) {
    Mat6 A = Mat6::Zero();
    Vec6 y = Vec6::Zero();
    double weight_sum = 0, residual_sum = 0, noise = 0;
    const auto accumulate = [&](const Near& n, double weight) {
      A.selfadjointView<Eigen::Lower>().rankUpdate(n.basis, weight);
      y += weight * n.w * n.basis;
    };
    for (const Near& n : near) {
      double weight = n.along / (n.sigma * n.sigma);
      const double t = scale > 0 ? (n.w - c.dot(n.basis)) / (4.5 * scale * n.sigma) : 0;
      if (std::abs(t) >= 1) continue;
      weight *= (1 - t * t) * (1 - t * t);
      accumulate(n, weight);
      weight_sum += n.along;
      noise += n.along * n.along;
    }
    // A little stiffness against curvature keeps the fit sane where neighbours lie on one side only.
    const double ridge = 1e-3 * A(0, 0);
    for (int i = 3; i < 6; ++i) A(i, i) += ridge * reach_mm * reach_mm * reach_mm * reach_mm * 0.02;
    const Eigen::LDLT<Mat6> factor(A);
    if (factor.info() != Eigen::Success || weight_sum <= 0) return fit;
    c = factor.solve(y);
    for (const Near& n : near) {
      const double r = (n.w - c.dot(n.basis)) / n.sigma;
      if (scale > 0 && std::abs(r) >= 4.5 * scale) continue;
      residual_sum += n.along * r * r;
    }
    scale = std::max(std::sqrt(residual_sum / weight_sum), 0.05);
    // Gaussian weights average fewer points than plain ones.
    fit.deviation_w = scale * std::sqrt(std::max(0.0, factor.solve(Vec6::Unit(0))[0]) * noise / weight_sum);
  }
  fit.w = sample.w0 + c[0];
  fit.slope = std::hypot(c[1], c[2]) * z0 * z0;
  fit.valid = c.allFinite() && fit.w > 0 && std::abs(c[0]) < 2 * reach_mm * sample.w0 * sample.w0;
  return fit;
}

/// As wide as noise asks for: the deviation of the fitted point shall fall below a tenth of the spacing.
Fit smooth(const SightGrid& grid, const Cell& sample, double spacing_mm) {
  Fit fit;
  for (double reach = 1.5; reach <= 3.5; reach += 1) {
    fit = fit_surface(grid, sample, reach * spacing_mm);
    if (fit.valid && fit.deviation_w < 0.1 * spacing_mm * sample.w0 * sample.w0) break;
  }
  return fit;
}

}  // namespace

void describe(Settings& settings, SurfaceOptions& options) {
  settings.number("spacing_mm", options.spacing_mm, {0, 50},
                  "distance between the points of the surface; 0 = from the number of elements");
  settings.number("outlier_share", options.outlier_share, {0, 0.5},
                  "fraction of the points, those farthest from their neighbourhood, that is dropped");
  settings.number("largest_hole_mm", options.largest_hole_mm, {0, 1000},
                  "holes in the surface up to this diameter are closed");
}

PointCloud clean_points(const PointCloud& cloud, double spacing_mm, const SurfaceOptions& options) {
  const auto demand = [&](size_t points) {
    if (points < static_cast<size_t>(kMinPoints))
      throw BadInput(
          fmt::format("only {} of {} measured points of the tissue surface are left after cleaning at {:.2f} mm "
                      "spacing, expected at least {}",
                      points, cloud.size(), spacing_mm, kMinPoints));
  };
  if (!(spacing_mm > 0)) throw BadInput(fmt::format("spacing_mm is {}, expected above 0", spacing_mm));
  std::vector<Sight> sights = sights_of(cloud);
  demand(sights.size());
  SightGrid grid = make_grid(std::move(sights), spacing_mm);
  std::vector<Cell> cells = coarse_surface(grid);
  find_slopes(grid, cells);
  sights = without_outliers(grid, cells, options.outlier_share);
  demand(sights.size());
  grid = make_grid(std::move(sights), spacing_mm);
  cells = coarse_surface(grid);
  find_slopes(grid, cells);

  const std::vector<size_t> samples = thin(grid, cells, 0.9 * spacing_mm);
  std::vector<Fit> fits(samples.size());
  tbb::parallel_for(size_t{0}, samples.size(),
                    [&](size_t i) { fits[i] = smooth(grid, cells[samples[i]], spacing_mm); });

  PointCloud clean;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!fits[i].valid || fits[i].slope > kSteepest) continue;
    const Cell& cell = cells[samples[i]];
    const double z = 1 / fits[i].w;
    clean.position_mm.emplace_back(cell.u0 * z, cell.v0 * z, z);
    clean.depth_deviation_mm.push_back(static_cast<float>(fits[i].deviation_w * z * z));
    const auto source = static_cast<size_t>(grid.sights[static_cast<size_t>(grid.first[samples[i]])].source);
    clean.correlation.push_back(source < cloud.correlation.size() ? cloud.correlation[source] : 0.0f);
    clean.colour.push_back(source < cloud.colour.size() ? cloud.colour[source] : cv::Vec3b());
  }
  demand(clean.size());
  return clean;
}

}  // namespace palpate
