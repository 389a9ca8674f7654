#pragma once

#include "palpate/core/settings.h"
#include "palpate/surface/depth_cells.h"

namespace palpate {

/// Where S* ends although the picture goes on; keys of `tuning`.
struct EdgeOptions {
  double cell_mm = 0.3;        ///< resolution at the middle depth; a window of the matcher blurs an edge by more
  double min_jump_mm = 2;      ///< what moving least squares over a few points would still take for a slope
  double jump_deviations = 4;  ///< and so many deviations of the depths to either side, carried to the edge
  double min_edge_mm = 4;      ///< shorter edges are noise: S* goes around them
  double max_bridge_mm = 3;    ///< a face spans no wider stretch in which nothing was measured
  double min_piece_mm2 = 40;   ///< smaller pieces are dropped
  double max_covered_mm = 15;  ///< an instrument hides no wider stretch that may be closed
};

void describe(Settings& settings, EdgeOptions& options);

/// Occlusion edges in a depth image: cells where the depth that one side continues to is not that of the other side.
struct DepthEdges {
  DepthCells cells;  ///< without those in which both sides are mixed
  EdgeOptions options;
  cv::Mat1f jump_w;  ///< of the inverse depth, in the cells beside an edge; 0 elsewhere
};

/// Along rows and columns, a line is fitted over a few cells to either side and both are carried to the cell between; a
/// crease or a steep slope is no edge.
DepthEdges find_depth_edges(DepthCells cells, const EdgeOptions& options);

/// Closes cells behind instruments where what is seen to both sides along a row or a column continues the same surface.
void close_covered(DepthCells& cells, const EdgeOptions& options);

/// Whether the way between two points of the surface, as the camera sees it, crosses an edge or a stretch in which
/// nothing was measured: no face has it for a side.
bool is_torn(const DepthEdges& edges, const Vec3& a_mm, const Vec3& b_mm);

/// Whether, between two points, something else is seen than a surface that connects them.
bool shows_another_depth(const DepthEdges& edges, const Vec3& a_mm, const Vec3& b_mm);

/// Cells that hang together without crossing an edge: numbers from 0, -1 where nothing is known (CV_32S).
cv::Mat1i label_pieces(const DepthEdges& edges);

}  // namespace palpate
