#include "palpate/core/table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "palpate/core/errors.h"
#include "palpate/core/time_column.h"

namespace palpate {
namespace {

class TableFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) const {
    std::ofstream(file_, std::ios::binary) << text;
    return file_;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::vector<TableColumn> columns() const {
    std::vector<TableColumn> columns = time_columns();
    for (const char* axis : {"x", "y", "z"})
      columns.push_back({std::string("f") + axis + "_N", {std::string("f") + axis, std::string("force.") + axis}});
    return columns;
  }

  /// Time of the second row and its three forces.
  void expect_row(const std::string& text, double time, double x, double y, double z) const {
    SCOPED_TRACE(text);
    const Table table(write(text), columns());
    ASSERT_GE(table.rows().size(), 2U);
    const Table::Row& row = table.rows()[1];
    EXPECT_NEAR(table.number(row, "time_s"), time, 1e-12 + 1e-12 * time);
    EXPECT_DOUBLE_EQ(table.number(row, "fx_N"), x);
    EXPECT_DOUBLE_EQ(table.number(row, "fy_N"), y);
    EXPECT_DOUBLE_EQ(table.number(row, "fz_N"), z);
  }

  std::string refusal(const std::string& text, const TimeHints& hints = {}) const {
    try {
      const Table table(write(text), columns());
      table.require({"fx_N", "fy_N", "fz_N"});
      times_s(table, hints);
    } catch (const BadInput& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() /
      (std::string("palpate_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
};

TEST_F(TableFile, IsReadWhateverSeparatesItsColumns) {
  expect_row("Time,Fx,Fy,Fz\n0,1,2,3\n0.5,1.25,-2,3e1\n", 0.5, 1.25, -2, 30);
  expect_row("Time;Fx;Fy;Fz\r\n0;1;2;3\r\n0,5;1,25;-2;3,0e1\r\n", 0.5, 1.25, -2, 30);
  expect_row("Time\tFx\tFy\tFz\n0\t1\t2\t3\n0,5\t1,25\t-2\t+30\n", 0.5, 1.25, -2, 30);
  expect_row("Time  Fx Fy   Fz\n0 1 2 3\n 0.5  1.25 -2 30\n", 0.5, 1.25, -2, 30);
  expect_row("Time|Fx|Fy|Fz\n0|1|2|3\n0.5|1.25|-2|30\n", 0.5, 1.25, -2, 30);
  expect_row("\"Time\",\"Fx\",\"Fy\",\"Fz\"\n\"0\",\"1\",\"2\",\"3\"\n\"0,5\",\"1,25\",\"-2\",\"30\"\n", 0.5, 1.25, -2,
             30);
  expect_row("Time;Fx;Fy;Fz\n0;1;2;3\n0,5;1.234,25;-2;30\n", 0.5, 1234.25, -2, 30);
  expect_row("\xEF\xBB\xBFTime,Fx,Fy,Fz\r\n0,1,2,3\r\n0.5,1.25,-2,30\r\n", 0.5, 1.25, -2, 30);
  const std::string plain = "Time\tFx\tFy\tFz\n0\t1\t2\t3\n0.5\t1.25\t-2\t30\n";
  std::string utf16 = "\xFF\xFE";
  for (const char c : plain) utf16 += std::string{c, '\0'};
  expect_row(utf16, 0.5, 1.25, -2, 30);
}

TEST_F(TableFile, HasColumnsOfAnyNameOrderAndUnit) {
  expect_row("t[ms],Fx (N),Fy (N),Fz (N)\n0,1,2,3\n500,1.25,-2,30\n", 0.5, 1.25, -2, 30);
  expect_row("TIME_MS,FX_N,FY_MN,FZ_KN\n0,1,2,3\n500,1.25,-2000,0.03\n", 0.5, 1.25, -2, 30);
  expect_row("Fz/N,Fy/N,Fx/N,t in s\n3,2,1,0\n30,-2,1.25,0.5\n", 0.5, 1.25, -2, 30);
  expect_row(
      "%time,field.header.seq,field.header.stamp,field.wrench.force.x,field.wrench.force.y,field.wrench.force.z\n"
      "7,1,500000000,1,2,3\n9,2,1000000000,1.25,-2,30\n",
      1e9, 1.25, -2, 30);
  expect_row("__time,/ft/wrench/force/x,/ft/wrench/force/y,/ft/wrench/force/z\n0,1,2,3\n0.5,1.25,-2,30\n", 0.5, 1.25,
             -2, 30);
  expect_row("Time,Fx,Fy,Fz\n(s),(N),[N],mN\n0,1,2,3\n0.5,1.25,-2,30000\n", 0.5, 1.25, -2, 30);
  expect_row("# Time, Fx, Fy, Fz\n# sensor 7\n0,1,2,3\n0.5,1.25,-2,30\n", 0.5, 1.25, -2, 30);
}

TEST_F(TableFile, MayBeginBelowOtherLines) {
  const std::string text =
      "Start Time: 11/3/25 1:05 PM\nRDT Sample Rate: 100\n\"PLEASE NOTE: the time, and fx, is wrong\"\n"
      "Counts per Unit Force: 1000000.0\n\nStatus (hex), Fx, Fy, Fz, Time\n\"0x0\",\"1\",\"2\",\"3\",\"0\"\n"
      "\"0x0\",\"1.25\",\"-2\",\"30\",\"0.5\"\n";
  expect_row(text, 0.5, 1.25, -2, 30);
  const Table table(write(text), columns());
  EXPECT_EQ(table.before_header({"count", "force"}), "1000000.0");
  EXPECT_EQ(table.before_header({"rate"}), "100");
  EXPECT_FALSE(table.before_header({"torque"}));
  EXPECT_EQ(table.header_found(), "the header in line 6 is 'Status (hex), Fx, Fy, Fz, Time'");
}

TEST_F(TableFile, SaysWhatItFoundWhereAColumnIsMissing) {
  EXPECT_THAT(refusal("Zeitpunkt;Fx;Fy;Kraft\n0;1;2;3\n"),
              testing::AllOf(testing::HasSubstr("no column fz_N"), testing::HasSubstr("Zeitpunkt;Fx;Fy;Kraft")));
  EXPECT_THAT(refusal("0,1,2,3\n1,2,3,4\n"), testing::HasSubstr("the header in line 1 is '0,1,2,3'"));
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz\n0,00,1,25,2,50,3,75\n0,01,1,25,2,50,3,75\n"),
              testing::HasSubstr("comma both separates columns and marks decimals"));
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz\n0,1,2,3\n").size(), 0U);
  const Table volts(write("Time,Fx (V),Fy (Nm),Fz\n0,1,2,3\n"), columns());
  EXPECT_THROW(volts.number(volts.rows()[0], "fx_N"), BadInput);
}

TEST_F(TableFile, WithMoreValuesThanColumnsIsRefusedByItsLine) {
  const std::string plain = "Time,Fx,Fy,Fz\n0,1,2,3\n";
  EXPECT_THAT(refusal(plain + "0.5,1,234.5,2,3\n"),
              testing::AllOf(testing::HasSubstr("line 3 has 5 values, the header 4 columns"),
                             testing::HasSubstr("decimals or thousands"), testing::HasSubstr("'Time,Fx,Fy,Fz'")));
  // Where only some of the numbers have decimals, most rows are not twice as long.
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz,a,b\n0,5,1,2,3,0,0\n0,6,1,2,3,0,0\n"), testing::HasSubstr("line 2 has 7 values"));
  EXPECT_THAT(refusal("Time;Fx;Fy;Fz\n0;1;2;3;4\n"), testing::HasSubstr("one value in each column"));
  EXPECT_EQ(refusal(plain + "0.5,1,2,3,,\n1,1,2,3, ,\"\"\n"), "");
  expect_row(plain + "0.5,1.25,-2,30,,,\n", 0.5, 1.25, -2, 30);
  expect_row("Time,Fx,Fy,Fz\n0,1,2,3\n0.5,\"1,234.5\",-2,30\n", 0.5, 1234.5, -2, 30);
}

TEST_F(TableFile, HasItsUnitsBelowTheHeaderInAnyBrackets) {
  for (const char* units : {"ms,mN,N,kN", "[ms],[mN],[N],[kN]", "(ms),(mN),(N),(kN)", "{ms},\"[mN]\",[N],[kN]"})
    expect_row(std::string("Time,Fx,Fy,Fz\n") + units + "\n0,1,2,3\n500,1250,-2,0.03\n", 0.5, 1.25, -2, 30);
  // What the header states holds where the line below it says nothing.
  expect_row("Time (ms),Fx (mN),Fy,Fz\n,,[N],[kN]\n0,1,2,3\n500,1250,-2,0.03\n", 0.5, 1.25, -2, 30);
  const Table volts(write("Time,Fx,Fy,Fz\n[-],[V],[V],[V]\n0,1,2,3\n"), columns());
  ASSERT_EQ(volts.rows().size(), 1U);
  EXPECT_THAT([&] { volts.number(volts.rows()[0], "fx_N"); },
              testing::ThrowsMessage<BadInput>(testing::HasSubstr("fx_N is in V")));
}

TEST_F(TableFile, MayHaveTheMinusOfUnicodeAndTheHeaderOfNumpy) {
  expect_row(
      "Time,Fx,Fy,Fz\n0,1,2,3\n0.5,1.25,\xE2\x88\x92"
      "2,3e\xE2\x88\x92"
      "1\n",
      0.5, 1.25, -2, 0.3);
  expect_row("# Time Fx Fy Fz\n0 1 2 3\n0.5 1.25 -2 30\n", 0.5, 1.25, -2, 30);
}

TEST_F(TableFile, HasItsTimeInSecondsWhateverItsUnit) {
  const auto times = [&](const std::vector<std::string>& stamps, const TimeHints& hints) {
    std::string text = "Time,Fx,Fy,Fz\n";
    for (const std::string& stamp : stamps) text += stamp + ",1,2,3\n";
    return times_s(Table(write(text), columns()), hints);
  };
  const auto counted = [&](double step, int rows, double start = 0) {
    std::vector<std::string> stamps;
    for (int i = 0; i < rows; ++i) stamps.push_back(std::to_string(static_cast<long long>(start + step * i)));
    return stamps;
  };
  EXPECT_NEAR(times(counted(10, 600), {4.0}).back(), 5.99, 1e-9);   // ms at 100 Hz
  EXPECT_NEAR(times(counted(1, 6000), {4.0}).back(), 5.999, 1e-9);  // ms at 1 kHz
  EXPECT_NEAR(times(counted(1e4, 600), {4.0}).back(), 5.99, 1e-9);  // us
  const auto ns = times(counted(1e7, 600, 1.7e18), {4.0});          // since 1970
  EXPECT_NEAR(ns.back() - ns.front(), 5.99, 1e-5);
  EXPECT_NEAR(times({"0.00", "0.01", "0.02"}, {}).back(), 0.02, 1e-12);
  const auto evening = times({"11/3/25 11:59:59.990 PM", "11/4/25 12:00:00.000 AM", "11/4/25 12:00:00.010 AM"}, {});
  EXPECT_NEAR(evening[2] - evening[0], 0.02, 1e-9);
  EXPECT_NEAR(times({"2025-11-03T13:05:07.250Z", "2025-11-03T13:05:07.260Z"}, {})[0], 47107.25, 1e-9);
  EXPECT_NEAR(times({"59:59.99", "00:00.01"}, {})[1], 3600.01, 1e-9);
  EXPECT_NEAR(times({"13:53:20:010", "13:53:20:020"}, {})[1], 50000.02, 1e-9);
  EXPECT_NEAR(times({"13:53:9.990", "13:53:10.000"}, {})[0], 49989.99, 1e-9);  // seconds of one digit
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz\n13:53:20:10,1,2,3\n"), testing::HasSubstr(":2: time_s is '13:53:20:10'"));
  EXPECT_THAT(refusal("Time (ms),Fx,Fy,Fz\n0,1,2,3\n0.1,1,2,3\n4,1,2,3\n", {4.0, 4}),
              testing::AllOf(testing::HasSubstr("from 0 to 4"), testing::HasSubstr("in s it would fit")));
  EXPECT_THAT(refusal("Time,Fx,Fy,Fz\n0,1,2,3\n777,1,2,3\n1554,1,2,3\n", {4.0}), testing::HasSubstr("steps of 777"));
  EXPECT_THAT(refusal("time_s,Fx,Fy,Fz\n0,1,2,3\n10,1,2,3\n20,1,2,3\n", {4.0}), testing::HasSubstr("10 s apart"));
  const Table ros(write("header.stamp.secs,header.stamp.nsecs,force.x\n1700000000,250000000,1\n"), columns());
  EXPECT_NEAR(times_s(ros, {})[0], 1700000000.25, 1e-6);
}

/// Stamps in whole seconds of a log with so many rows in each.
std::string whole_seconds(const std::vector<int>& rows, const char* header = "Time", const char* format = "13:53:{}") {
  std::string text = std::string(header) + ",Fx,Fy,Fz\n";
  for (size_t second = 0; second < rows.size(); ++second)
    for (int row = 0; row < rows[second]; ++row)
      text += fmt::format(fmt::runtime(format), 20 + second) + fmt::format(",{},2,3\n", row);
  return text;
}

TEST_F(TableFile, OfWholeSecondsHasItsRowsEvenlyWithinThem) {
  for (const auto& [header, format] : {std::pair{"Time", "13:53:{}"}, std::pair{"Time (s)", "{}"}}) {
    const std::vector<double> times =
        times_s(Table(write(whole_seconds({40, 100, 99, 25}, header, format)), columns()), {});
    ASSERT_EQ(times.size(), 264U);
    EXPECT_NEAR(times[139] - times[0], 1.39, 1e-9);
    EXPECT_NEAR(times[239] - times[0], 2.4, 1e-9);
    for (size_t i = 1; i < times.size(); ++i) EXPECT_NEAR(times[i] - times[i - 1], 0.01, 2e-4) << i;
  }
  EXPECT_THAT(refusal(whole_seconds({100, 100, 37, 100, 100})),
              testing::AllOf(testing::HasSubstr("'13:53:22' on 37 rows where other seconds have 100"),
                             testing::HasSubstr("the header in line 1")));
  // One row in each second is what it says.
  EXPECT_NEAR(times_s(Table(write(whole_seconds({1, 1, 1, 1})), columns()), {})[3], 50003, 1e-9);
}

}  // namespace
}  // namespace palpate
