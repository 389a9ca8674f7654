#include "palpate/simulate/instrument_shape.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

const int kAround = 40;  // points of a ring
const double kShaftLength_mm = 260;
const double kPi = std::numbers::pi;

// Parts are built in the tool's own frame: tip at the origin, z towards the tip (so the shaft lies at z < 0), x the
// direction in which the jaws open.
using Ring = std::vector<Vec3>;

Ring ellipse(const Vec3& center, double half_x, double half_y) {
  Ring ring;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * kPi * i / kAround;
    ring.push_back(center + Vec3(half_x * std::cos(angle), half_y * std::sin(angle), 0));
  }
  return ring;
}

// Skin through rings that follow each other in +z, closed at both ends, shared vertices (smooth).
void add_skin(Surface& surface, const std::vector<Ring>& rings) {
  const int first = static_cast<int>(surface.vertices_mm.size());
  for (const Ring& ring : rings) surface.vertices_mm.insert(surface.vertices_mm.end(), ring.begin(), ring.end());
  for (int r = 0; r + 1 < static_cast<int>(rings.size()); ++r)
    for (int i = 0; i < kAround; ++i) {
      const int a = first + r * kAround + i, b = first + r * kAround + (i + 1) % kAround;
      surface.triangles.push_back({a, b, b + kAround});
      surface.triangles.push_back({a, b + kAround, a + kAround});
    }
  for (const bool front : {false, true}) {
    const Ring& ring = front ? rings.back() : rings.front();
    const int rim = static_cast<int>(surface.vertices_mm.size());
    surface.vertices_mm.insert(surface.vertices_mm.end(), ring.begin(), ring.end());
    Vec3 middle = Vec3::Zero();
    for (const Vec3& point : ring) middle += point / kAround;
    surface.vertices_mm.push_back(middle);
    for (int i = 0; i < kAround; ++i) {
      const int a = rim + i, b = rim + (i + 1) % kAround;
      surface.triangles.push_back(front ? Triangle{a, b, rim + kAround} : Triangle{b, a, rim + kAround});
    }
  }
}

// Straight piece between two radii, with edges at both ends.
void add_cone(Surface& surface, double from_z, double from_radius, double to_z, double to_radius) {
  add_skin(surface, {ellipse({0, 0, from_z}, from_radius, from_radius), ellipse({0, 0, to_z}, to_radius, to_radius)});
}

// `pieces` more than one let a texture vary along it.
void add_shaft(Surface& surface, double radius, double end_z, int pieces) {
  std::vector<Ring> rings;
  for (int i = 0; i < pieces; ++i) {
    const double z = end_z - kShaftLength_mm + i * (kShaftLength_mm - 0.8) / pieces;
    rings.push_back(ellipse({0, 0, z}, radius, radius));
  }
  rings.push_back(ellipse({0, 0, end_z - 0.8}, radius, radius));
  add_skin(surface, rings);
  add_cone(surface, end_z - 0.8, radius, end_z, radius - 0.7);
}

// One jaw from the hinge to the tip, on one side of the plane in which they meet, tapered and rounded at the end.
void add_jaw(Surface& surface, double shaft_radius, double length, double angle, double side) {
  std::vector<Ring> rings;
  const int steps = 14;
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    const double round = t < 0.85 ? 1 : std::sqrt(std::max(0.02, 1 - std::pow((t - 0.85) / 0.15, 2)));
    const double wide = shaft_radius * (0.62 - 0.34 * t) * round;
    const double thick = shaft_radius * (0.34 - 0.16 * t) * round;
    const double z = -length * (1 - t);
    rings.push_back(ellipse({side * thick, 0, z}, thick, wide));
  }
  const Mat3 turn = Eigen::AngleAxisd(side * angle, Vec3::UnitY()).toRotationMatrix();
  const Vec3 hinge(0, 0, -length);
  for (Ring& ring : rings)
    for (Vec3& point : ring) {
      const Vec3 turned = turn * (point - hinge);
      // stretched so that the far end stays level with the tip whatever the angle
      point = hinge + Vec3(turned.x(), turned.y(), turned.z() / std::cos(angle));
    }
  add_skin(surface, rings);
}

Surface grasper(double radius, double opening, int pieces) {
  const double jaw = 13, angle = (2.0 + 6 * opening) * kPi / 180;
  Surface surface;
  add_jaw(surface, radius, jaw, angle, 1);
  add_jaw(surface, radius, jaw, angle, -1);
  add_cone(surface, -jaw - 7, 0.72 * radius, -jaw + 1, 0.62 * radius);
  add_cone(surface, -jaw - 12, 1.03 * radius, -jaw - 6, 0.98 * radius);
  add_shaft(surface, radius, -jaw - 12, pieces);
  return surface;
}

Surface probe(double radius, int pieces) {
  const double tip_radius = 0.6 * radius;
  Surface surface;
  std::vector<Ring> rings;
  for (int i = 0; i <= 10; ++i) {
    const double angle = 0.5 * kPi * i / 10.2;
    rings.push_back(ellipse({0, 0, tip_radius * (std::sin(angle) - 1)}, tip_radius * std::cos(angle),
                            tip_radius * std::cos(angle)));
  }
  add_skin(surface, rings);
  add_cone(surface, -16, tip_radius, -tip_radius, tip_radius);
  add_shaft(surface, radius, -16, pieces);
  return surface;
}

// A bar that runs beside the axis and bends back to it in a half circle that ends at the tip's level.
Surface hook(double radius, int pieces) {
  const double bar = 0.28 * radius, bend = 0.9 * radius;
  Surface surface;
  std::vector<Ring> rings;
  for (int i = 0; i <= 24; ++i) {
    const double angle = kPi * 0.75 * i / 24;
    const Vec3 middle(bend * std::cos(angle) - 0.1 * bend, 0, bend * std::sin(angle) - bend - bar);
    const Vec3 outward(std::cos(angle), 0, std::sin(angle));
    Ring ring;
    for (int k = 0; k < kAround; ++k) {
      const double around = 2 * kPi * k / kAround;
      ring.push_back(middle + bar * (std::cos(around) * outward + std::sin(around) * Vec3::UnitY()));
    }
    rings.push_back(ring);
  }
  add_skin(surface, rings);
  add_skin(surface, {ellipse({0.9 * bend, 0, -16}, bar, bar), ellipse({0.9 * bend, 0, -bend - bar}, bar, bar)});
  add_shaft(surface, radius, -15, pieces);
  return surface;
}

Surface in_own_frame(const SimulatedInstrument& instrument, double opening) {
  const double radius = instrument.shaft_mm / 2;
  const int pieces = instrument.look == SimulatedInstrument::Look::steel && instrument.blood == 0 ? 1 : 64;
  switch (instrument.model) {
    case SimulatedInstrument::Model::probe:
      return probe(radius, pieces);
    case SimulatedInstrument::Model::hook:
      return hook(radius, pieces);
    case SimulatedInstrument::Model::grasper:
      break;
  }
  return grasper(radius, opening, pieces);
}

}  // namespace

Surface make_instrument(const SimulatedInstrument& instrument, const InstrumentPlace& place) {
  Surface surface = in_own_frame(instrument, place.opening);
  // The jaws open across the view, so that the camera sees them open.
  Vec3 across = place.axis.cross(Vec3::UnitZ());
  if (across.norm() < 1e-6) across = Vec3::UnitX();
  Mat3 left_from_tool;
  left_from_tool.col(0) = across.normalized();
  left_from_tool.col(2) = place.axis;
  left_from_tool.col(1) = left_from_tool.col(2).cross(left_from_tool.col(0));
  for (Vec3& vertex : surface.vertices_mm) vertex = left_from_tool * vertex + place.tip_mm;
  return surface;
}

}  // namespace palpate
