#include "palpate/stream/igtl_messages.h"

#include <igtlImageMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>
#include <igtlUnit.h>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "palpate/core/clock.h"

namespace palpate {

namespace {

constexpr double kArrow_mm_per_N = 10;
constexpr double kHead_mm = 2;

Vec3 to_ras(const Vec3& camera) {
  return {-camera.x(), -camera.y(), camera.z()};
}

std::string device_of(const char* name, int instrument) {
  return instrument == 0 ? name : name + std::to_string(instrument + 1);
}

IgtlBytes packed(igtl::MessageBase& message, const std::string& device, int64_t stamp_ns) {
  message.SetDeviceName(device.c_str());
  const igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
  stamp->SetTimeInNanoseconds(static_cast<igtlUint64>(std::max<int64_t>(0, stamp_ns)));
  igtl::TimeStamp::Pointer given = stamp;
  message.SetTimeStamp(given);
  message.Pack();
  const auto* bytes = static_cast<const uint8_t*>(message.GetPackPointer());
  return std::make_shared<const std::vector<uint8_t>>(bytes, bytes + message.GetPackSize());
}

int add_point(igtl::PolyDataPointArray& points, const Vec3& camera_mm) {
  const Vec3 p = to_ras(camera_mm);
  points.AddPoint(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  return points.GetNumberOfPoints() - 1;
}

/// A line that ends at the tip, with a pyramid for its head; how many points it took.
int add_arrow(const ForceEstimate& estimate, igtl::PolyDataPointArray& points, igtl::PolyDataCellArray& lines,
              igtl::PolyDataCellArray& triangles) {
  const Vec3 along = estimate.force_N.normalized();
  const Vec3 from_mm = estimate.tip_mm - kArrow_mm_per_N * estimate.force_N;
  const Vec3 neck_mm = estimate.tip_mm - kHead_mm * along;
  const Vec3 side = along.unitOrthogonal(), other = along.cross(side);
  const auto start = static_cast<igtlUint32>(add_point(points, from_mm));
  const auto tip = static_cast<igtlUint32>(add_point(points, estimate.tip_mm));
  igtlUint32 corners[4];
  for (int i = 0; i < 4; ++i) {
    const Vec3 out = (i % 2 == 0 ? side : other) * (i < 2 ? 1 : -1);
    corners[i] = static_cast<igtlUint32>(add_point(points, neck_mm + 0.4 * kHead_mm * out));
  }
  igtlUint32 shaft[2] = {start, tip};
  lines.AddCell(2, shaft);
  for (int i = 0; i < 4; ++i) {
    igtlUint32 face[3] = {corners[i], corners[(i + 1) % 4], tip};
    triangles.AddCell(3, face);
  }
  return 6;
}

}  // namespace

IgtlBytes igtl_tip(const StreamFrame& frame, int instrument) {
  const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  const Vec3 tip = to_ras(estimate_of(frame, instrument).tip_mm);
  for (int row = 0; row < 3; ++row) matrix[row][3] = static_cast<float>(tip[row]);
  message->SetMatrix(matrix);
  return packed(*message, device_of("PalpateTip", instrument), frame.wall_ns);
}

IgtlBytes igtl_state(const StreamFrame& frame, const StreamScene& scene, int instrument) {
  const igtl::StringMessage::Pointer message = igtl::StringMessage::New();
  std::string text = state_json(frame, scene.tissue, instrument);
  message->SetString(text);
  return packed(*message, device_of("PalpateState", instrument), frame.wall_ns);
}

IgtlBytes igtl_force(const Vec3& force_N, bool valid, int64_t wall_ns, int instrument) {
  const igtl::SensorMessage::Pointer message = igtl::SensorMessage::New();
  const igtl::Unit::Pointer newton = igtl::Unit::New();
  newton->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  message->SetLength(4);
  message->SetUnit(newton.GetPointer());
  const Vec3 shown = valid ? to_ras(force_N) : Vec3::Zero().eval();
  for (int i = 0; i < 3; ++i) message->SetValue(static_cast<unsigned>(i), shown[i]);
  message->SetValue(3, valid ? 1 : 0);
  return packed(*message, device_of("PalpateForce", instrument), wall_ns);
}

IgtlBytes igtl_surface(const StreamFrame* frame, const StreamScene& scene) {
  const bool deformed = frame && !frame->estimate.deformed_nodes_mm.empty();
  const std::vector<Vec3>& nodes_mm = deformed ? frame->estimate.deformed_nodes_mm : scene.rest_nodes_mm;
  const std::vector<Triangle>& boundary = deformed ? frame->estimate.boundary : scene.rest_boundary;
  const igtl::PolyDataMessage::Pointer message = igtl::PolyDataMessage::New();
  const igtl::PolyDataPointArray::Pointer points = igtl::PolyDataPointArray::New();
  const igtl::PolyDataCellArray::Pointer triangles = igtl::PolyDataCellArray::New(),
                                         lines = igtl::PolyDataCellArray::New();
  std::vector<int> point_of(nodes_mm.size(), -1);  // nodes inside the body are not sent
  std::vector<float> stress_kPa;
  for (const Triangle& triangle : boundary) {
    igtlUint32 corners[3];
    for (size_t c = 0; c < 3; ++c) {
      const auto node = static_cast<size_t>(triangle[c]);
      if (point_of[node] < 0) {
        point_of[node] = add_point(*points, nodes_mm[node]);
        stress_kPa.push_back(deformed ? static_cast<float>(frame->estimate.node_von_mises_kPa[node]) : 0.0F);
      }
      corners[c] = static_cast<igtlUint32>(point_of[node]);
    }
    triangles->AddCell(3, corners);
  }
  for (int instrument = 0; frame && instrument < frame->instruments; ++instrument) {
    const ForceEstimate& e = estimate_of(*frame, instrument);
    if (has_force(e) && e.in_contact && e.force_N.norm() > 0)
      stress_kPa.resize(stress_kPa.size() + static_cast<size_t>(add_arrow(e, *points, *lines, *triangles)));
  }
  const igtl::PolyDataAttribute::Pointer stress = igtl::PolyDataAttribute::New();
  stress->SetType(igtl::PolyDataAttribute::POINT_SCALAR, 1);
  stress->SetName("von_mises_kPa");
  stress->SetSize(static_cast<igtlUint32>(stress_kPa.size()));
  stress->SetData(stress_kPa.data());
  message->SetPoints(points);
  message->SetPolygons(triangles);
  message->SetLines(lines);
  message->AddAttribute(stress);
  return packed(*message, "PalpateSurface", frame ? frame->wall_ns : wall_ns());
}

IgtlBytes igtl_overlay(const StreamFrame& frame, const StreamScene& scene) {
  const cv::Mat& bgr = frame.overlay;
  const igtl::ImageMessage::Pointer message = igtl::ImageMessage::New();
  message->SetDimensions(bgr.cols, bgr.rows, 1);
  message->SetScalarTypeToUint8();
  message->SetNumComponents(3);
  message->SetCoordinateSystem(igtl::ImageMessage::COORDINATE_RAS);
  const double x_spacing_mm = scene.depth_mm / scene.left.K(0, 0), y_spacing_mm = scene.depth_mm / scene.left.K(1, 1);
  message->SetSpacing(static_cast<float>(x_spacing_mm), static_cast<float>(y_spacing_mm), 1);
  igtl::Matrix4x4 matrix;
  igtl::IdentityMatrix(matrix);
  matrix[0][0] = matrix[1][1] = -1;  // pixels run along x and y of the camera
  const Vec3 middle = to_ras({(0.5 * (bgr.cols - 1) - scene.left.K(0, 2)) * x_spacing_mm,
                              (0.5 * (bgr.rows - 1) - scene.left.K(1, 2)) * y_spacing_mm, scene.depth_mm});
  for (int row = 0; row < 3; ++row) matrix[row][3] = static_cast<float>(middle[row]);
  message->SetMatrix(matrix);
  message->AllocateScalars();
  cv::Mat rgb(bgr.size(), CV_8UC3, message->GetScalarPointer());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return packed(*message, "PalpateOverlay", frame.wall_ns);
}

IgtlBytes igtl_status(bool ready, const std::string& sentence) {
  const igtl::StatusMessage::Pointer message = igtl::StatusMessage::New();
  message->SetCode(ready ? igtl::StatusMessage::STATUS_OK : igtl::StatusMessage::STATUS_NOT_READY);
  message->SetErrorName(ready ? "" : "NotReady");
  message->SetStatusString(sentence.c_str());
  return packed(*message, "PalpateStatus", wall_ns());
}

}  // namespace palpate
