#include "bench/accuracy/error_budget.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "palpate/core/errors.h"
#include "palpate/core/table.h"

namespace palpate {

namespace {

/// Sums of squares of errors, split by the viewing ray.
class ErrorSum {
 public:
  void add(const Vec3& error_mm, const Vec3& at_mm) {
    const double along = error_mm.dot(at_mm.normalized());
    along_ += along * along;
    across_ += error_mm.squaredNorm() - along * along;
    ++count_;
  }
  TipError rms() const {
    if (count_ == 0) return {};
    return {std::sqrt(across_ / count_), std::sqrt(along_ / count_)};
  }

 private:
  double across_ = 0, along_ = 0;
  int count_ = 0;
};

}  // namespace

TipFigures tip_figures(const std::vector<ForceRow>& estimate, const std::vector<ForceRow>& truth,
                       const std::vector<bool>& visible) {
  std::map<int, const ForceRow*> by_frame;
  for (const ForceRow& row : estimate) by_frame[row.frame] = &row;
  TipFigures figures;
  ErrorSum tips, since_onset;
  const ForceRow *onset = nullptr, *true_onset = nullptr;
  int right = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    const ForceRow& t = truth[i];
    const auto found = by_frame.find(t.frame);
    const bool seen = found != by_frame.end() && found->second->has_tip();
    right += seen == visible[i];
    if (!seen || !t.has_tip()) continue;
    const ForceRow& e = *found->second;
    const Vec3 error = e.tip_mm - t.tip_mm;
    tips.add(error, t.tip_mm);
    figures.worst_tip_mm = std::max(figures.worst_tip_mm, error.norm());
    if (!e.in_contact || !t.in_contact) continue;
    if (!onset) onset = &e, true_onset = &t;
    since_onset.add(error - (onset->tip_mm - true_onset->tip_mm), t.tip_mm);
  }
  figures.tip = tips.rms();
  figures.since_onset = since_onset.rms();
  if (!truth.empty()) figures.seen_right_fraction = static_cast<double>(right) / static_cast<double>(truth.size());
  return figures;
}

std::vector<bool> read_visible(const std::filesystem::path& truth_file) {
  const Table table(truth_file, {{"frame"}, {"visible"}});
  std::vector<bool> visible;
  for (const Table::Row& row : table.rows())
    visible.push_back(!table.has("visible") || table.number(row, "visible") != 0);
  return visible;
}

void write_true_track(const std::vector<ForceRow>& truth, const std::filesystem::path& file) {
  std::ofstream stream(file);
  stream << "frame,time_s,x_mm,y_mm,z_mm,closed\n";
  for (const ForceRow& row : truth)
    stream << fmt::format("{},{},{},{},{},{}\n", row.frame, row.time_s, row.tip_mm.x(), row.tip_mm.y(), row.tip_mm.z(),
                          row.in_contact ? 1 : 0);
  if (!stream.flush()) throw Unfinished(file.string() + ": cannot be written");
}

}  // namespace palpate
