#include "palpate/feedback/report.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "palpate/core/errors.h"
#include "tests/feedback/temporary_folder.h"

namespace palpate {
namespace {

ForceRow row(int frame, const std::string& status, double force_N) {
  ForceRow r;
  r.frame = frame;
  r.time_s = 0.04 * frame;
  r.status = status;
  r.in_contact = force_N > 0;
  r.force_N = {0, 0, force_N};
  r.force_magnitude_N = force_N;
  r.tip_mm = {1, 2, 80.0 + frame};
  r.frame_ms = 20 + frame;
  r.max_von_mises_kPa = 7 * force_N;
  return r;
}

Report small_report() {
  Report report;
  report.title = "Pull <of> a patch";
  report.rows = {row(0, "no_contact", 0), row(1, "tool_lost", 0), row(2, "ok", 3), row(3, "ok", 7.5), row(4, "ok", 6)};
  report.truth = {row(0, "", 0), row(1, "", 0), row(2, "", 4), row(3, "", 8), row(4, "", 6)};
  for (int i = 1; i <= 5; ++i) {
    FrameTimes times;
    times.solve_ms = i;
    report.times.push_back(times);
  }
  report.tissue.young_modulus_kPa = 250;
  report.tissue.poisson_ratio = 0.45;
  report.settings = "map: {elements: 1344}  # <5000";
  report.pictures = {{cv::Mat(36, 64, CV_8UC3, cv::Scalar(10, 200, 30)), "frame 3 & its stress"}};
  return report;
}

std::vector<uchar> decoded(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<uchar> bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : base64) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<uchar>(bits >> (count -= 8)));
  }
  return bytes;
}

TEST(Report, SaysTheFigures) {
  const std::string html = report_html(small_report());
  EXPECT_THAT(html, testing::HasSubstr("7.50 N"));
  EXPECT_THAT(html, testing::HasSubstr("52.5 kPa"));
  EXPECT_THAT(html, testing::HasSubstr("F/E = 30.0 mm")) << "7.5 N over 0.25 N/mm^2";
  EXPECT_THAT(html, testing::HasSubstr("6.2 %")) << "RMSE sqrt(1.25 / 5) = 0.5 N of 8 N";
  EXPECT_THAT(html, testing::HasSubstr("no_contact: 1, ok: 3, tool_lost: 1"));
  EXPECT_THAT(html, testing::HasSubstr("<td>solve</td><td class=\"number\">3.00</td><td class=\"number\">5.00</td>"));
  EXPECT_THAT(html, testing::HasSubstr("saint-venant-kirchhoff, E = 250 kPa"));
  EXPECT_THAT(html, testing::HasSubstr("not a medical device"));
}

TEST(Report, TellsWarningsInWordsWithTheirNameAndCount) {
  Report report = small_report();
  EXPECT_THAT(report_html(report), testing::Not(testing::HasSubstr("Warnings")));
  report.rows[3].warnings = "law_out_of_range;sliding";
  report.rows[4].warnings = "law_out_of_range";
  const std::string html = report_html(report);
  EXPECT_THAT(html, testing::HasSubstr("tissue deformed beyond the law's range <span class=\"faint\">(2 of 5 frames, "
                                       "<code>law_out_of_range</code>)"));
  EXPECT_THAT(html, testing::HasSubstr("(1 of 5 frames, <code>sliding</code>)"));
}

TEST(Report, SaysThatNoInstrumentWasSeen) {
  const std::string sentence = "No instrument was seen in any frame";
  Report report = small_report();
  EXPECT_THAT(report_html(report), testing::Not(testing::HasSubstr(sentence)));
  for (ForceRow& r : report.rows) r.status = "tool_lost";
  EXPECT_THAT(report_html(report), testing::HasSubstr(sentence));
  report.rows.clear();
  EXPECT_THAT(report_html(report), testing::Not(testing::HasSubstr(sentence)));
}

TEST(Report, GivesTheMedianAndNinetyNinePercentOfTheFrameTime) {
  Report report = small_report();
  report.rows.assign(200, row(0, "ok", 1));
  for (int i = 0; i < 200; ++i) report.rows[static_cast<size_t>(i)].frame_ms = i;
  EXPECT_THAT(report_html(report), testing::HasSubstr("per frame (median; 99 %: 197.0 ms)"));
}

TEST(Report, NeedsNothingButItself) {
  const std::string html = report_html(small_report());
  for (const char* outside : {"http", "src=\"/", "<link", "@import", "url("})
    EXPECT_THAT(html, testing::Not(testing::HasSubstr(outside)));
}

TEST(Report, KeepsTextFromBecomingMarkup) {
  const std::string html = report_html(small_report());
  EXPECT_THAT(html, testing::HasSubstr("Pull &lt;of&gt; a patch"));
  EXPECT_THAT(html, testing::HasSubstr("# &lt;5000"));
  EXPECT_THAT(html, testing::HasSubstr("frame 3 &amp; its stress"));
}

TEST(Report, EmbedsItsPictures) {
  const std::string html = report_html(small_report());
  const std::string prefix = "data:image/jpeg;base64,";
  const size_t begin = html.find(prefix) + prefix.size();
  const cv::Mat picture = cv::imdecode(decoded(html.substr(begin, html.find('"', begin) - begin)), cv::IMREAD_COLOR);
  ASSERT_EQ(picture.size(), cv::Size(64, 36));
  EXPECT_NEAR(picture.at<cv::Vec3b>(18, 32)[1], 200, 4);
}

TEST(Report, BreaksTheCurveWhereTheToolIsLost) {
  Report report = small_report();
  const auto curves = [](const Report& r) {
    const std::string html = report_html(r);
    int count = 0;
    for (size_t at = 0; (at = html.find("<polyline class=\"estimate\"", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  const int broken = curves(report);
  report.rows[1].status = "no_contact";
  // Four charts (force, x, y, z), each drawn for a wide and a narrow page.
  EXPECT_EQ(curves(report), 8);
  EXPECT_EQ(broken, 16);
}

TEST(Report, LeavesOutWhatItDoesNotHave) {
  Report report;
  report.title = "empty";
  const std::string html = report_html(report);
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("Against the truth")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("Time per frame")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr(">nan")));
  EXPECT_THAT(html, testing::Not(testing::HasSubstr("=\"nan")));
}

class ReportFile : public test::TemporaryFolder {};

TEST_F(ReportFile, IsWrittenWholeOrNotAtAll) {
  write_report(file("report.html"), small_report());
  EXPECT_EQ(text_of("report.html"), report_html(small_report()));
  EXPECT_THROW(write_report(file("nowhere") / "report.html", small_report()), Unfinished);
}

}  // namespace
}  // namespace palpate
