#include "app/study_page_parts.h"

#include <fstream>
#include <iterator>

#include "app/chart_library.h"
#include "palpate/core/errors.h"

namespace palpate::app {

namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light dark;--ink:#1c2430;--soft:#5b6675;--line:#d9dee5;--paper:#fff;--good:#18794e;--bad:#b42318}
@media(prefers-color-scheme:dark){:root{--ink:#e6e9ee;--soft:#9aa5b4;--line:#333b47;--paper:#14181f;--good:#4cc38a;
--bad:#ff8a7a}}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif}
main{max-width:66rem;margin:0 auto;padding:1rem}
h1{font-size:1.7rem;line-height:1.2}h2{margin:2.5rem 0 .3rem;font-size:1.25rem}
.soft{color:var(--soft);font-size:.92rem}.table{overflow-x:auto}
table{border-collapse:collapse;font-size:.84rem;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .55rem;border-bottom:1px solid var(--line);text-align:right;vertical-align:bottom}
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:var(--paper)}
td{white-space:nowrap}td:first-child{white-space:normal;min-width:6rem}td.words{white-space:normal;min-width:13rem;text-align:left}
.good{color:var(--good)}.bad{color:var(--bad);font-weight:600}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr));gap:1rem;margin:1rem 0}
.chart{position:relative;height:19rem;min-width:0}video,img{width:100%;border-radius:.3rem}figure{margin:0}
)css";

constexpr const char* kScript = R"js(
const data = JSON.parse(document.getElementById('data').textContent);
const root = document.querySelector('main');
const add = (parent, tag, text, kind) => {
  const node = document.createElement(tag);
  if (text !== undefined) node.textContent = text;
  if (kind) node.className = kind;
  parent.appendChild(node);
  return node;
};
const short = v => typeof v !== 'number' ? (v === null || v === undefined ? '-' : String(v))
  : Number.isInteger(v) ? String(v) : Math.abs(v) >= 100 ? v.toFixed(0) : Math.abs(v) >= 10 ? v.toFixed(1)
  : Math.abs(v) >= 0.1 ? v.toFixed(2) : Number(v.toPrecision(3)).toString();
const colours = ['#2f6fde', '#d9822b', '#2a9d6f', '#b3459b', '#7a6ff0', '#c0392b', '#5d8a00', '#008b9a', '#946200', '#555f6e'];
const ink = getComputedStyle(document.documentElement).getPropertyValue('--ink');
const line = getComputedStyle(document.documentElement).getPropertyValue('--line');
Chart.defaults.color = ink; Chart.defaults.borderColor = line; Chart.defaults.animation = false;
Chart.defaults.maintainAspectRatio = false;

function chart(parent, title, x, y, sets, logX, logY) {
  const canvas = add(add(parent, 'div', undefined, 'chart'), 'canvas');
  new Chart(canvas, {type: 'line', data: {datasets: sets.map((set, i) => ({
      label: set.label, data: set.points, borderColor: set.colour || colours[i % colours.length], borderWidth: 1.8,
      backgroundColor: set.colour || colours[i % colours.length], borderDash: set.dash || [],
      pointRadius: set.dots ? 3 : 0, pointHitRadius: 8}))},
    options: {interaction: {mode: 'nearest', axis: 'x', intersect: false},
      plugins: {title: {display: true, text: title}, legend: {display: sets.length > 1, labels: {boxWidth: 18}}},
      scales: {x: {type: logX ? 'logarithmic' : 'linear', title: {display: true, text: x}},
               y: {type: logY ? 'logarithmic' : 'linear', title: {display: true, text: y}, beginAtZero: !logY}}}});
}

function table(parent, experiment) {
  const shown = data.columns.filter(c => experiment.runs.some(r => r.figures[c.name] !== null) &&
    (experiment.key === 'map.elements' || !/^stage_|^frames_per_second/.test(c.name)));
  const node = add(add(parent, 'div', undefined, 'table'), 'table');
  const head = add(add(node, 'thead'), 'tr');
  add(head, 'th', experiment.key ? experiment.key + (experiment.unit ? ', ' + experiment.unit : '') : 'run');
  shown.forEach(c => add(head, 'th', c.title));
  add(head, 'th', 'warnings (frames)');
  const body = add(node, 'tbody');
  if (Object.keys(experiment.goals).length) {
    const row = add(body, 'tr', undefined, 'soft');
    add(row, 'td', 'goal');
    shown.forEach(c => add(row, 'td', c.name in experiment.goals ? '\u2264 ' + experiment.goals[c.name] : ''));
    add(row, 'td', experiment.expects_warning || '');
  }
  experiment.runs.forEach(run => {
    const row = add(body, 'tr');
    add(row, 'td', run.label || run.name);
    if (run.status !== 'done') {
      const cell = add(row, 'td', run.status + ': ' + run.reason, run.status === 'failed' ? 'bad' : 'soft');
      cell.colSpan = shown.length + 1; cell.style.textAlign = 'left';
      return;
    }
    shown.forEach(c => {
      const value = run.figures[c.name], goal = experiment.goals[c.name];
      const kind = goal === undefined || typeof value !== 'number' ? '' : Math.abs(value) <= goal ? 'good' : 'bad';
      add(row, 'td', short(value), kind);
    });
    const names = Object.entries(run.warnings).map(([n, k]) => n + ' (' + k + ')').join(', ');
    add(row, 'td', names);
  });
}

function charts(parent, experiment) {
  const grid = add(parent, 'div', undefined, 'charts');
  const done = experiment.runs.filter(r => r.status === 'done');
  const numeric = experiment.key && done.length > 1 && done.every(r => r.value !== null);
  if (numeric) {
    const x = experiment.key + (experiment.unit ? ' (' + experiment.unit + ')' : ''), log = experiment.logarithmic;
    const over = name => done.filter(r => typeof r.figures[name] === 'number')
      .map(r => ({x: r.value, y: r.figures[name]}));
    const errors = over('force_nrmse_pct'), wide = Math.max(...errors.map(p => p.y)) > 300;
    const strong = over('gain').map(p => ({x: p.x, y: 100 * (p.y - 1)}));
    const sets = [{label: 'error (RMS, of the true peak)', points: errors, dots: true}];
    if (!wide && strong.length) sets.push({label: 'force too strong (+), too weak (-)', points: strong, dots: true});
    const slope = experiment.sensitivity && experiment.sensitivity.text;
    if (errors.length)
      chart(grid, ['Error of the force'].concat(slope ? [slope] : []), x, '% of the true force', sets, log, log && wide);
    const peaks = [{label: 'estimated peak', points: over('peak_force_N'), dots: true}];
    if (over('true_peak_N').length)
      peaks.push({label: 'true peak', points: over('true_peak_N'), colour: '#777', dash: [5, 4], dots: true});
    chart(grid, 'Peak force', x, 'force (N)', peaks, log, log && wide);
    if (experiment.key === 'map.elements')
      chart(grid, 'Time per frame', x, 'median (ms)',
        [{label: 'frame', points: over('median_frame_ms'), dots: true}], log, false);
    return;
  }
  (experiment.pictures || []).filter(p => p.data).forEach(p => {
    const figure = add(grid, 'figure'), image = add(figure, 'img');
    image.src = p.data; image.alt = p.caption;
    add(figure, 'figcaption', p.caption, 'soft');
  });
  const truth = done.find(r => r.series && r.series.truth);
  const sets = done.filter(r => !r.real && r.series && r.series.estimate)
    .map(r => ({label: r.label || 'estimate', points: r.series.estimate}));
  if (truth) sets.push({label: 'truth', points: truth.series.truth, colour: '#777', dash: [5, 4]});
  const sensor = done.find(r => r.series && r.series.sensor);
  if (sensor) sets.push({label: 'sensor, aligned', points: sensor.series.sensor, colour: '#2a9d6f', dash: [2, 3]});
  if (sets.length) chart(grid, 'Force over time', 'time (s)', 'force (N)', sets, false, false);
  if (experiment.clip) {
    const video = add(add(grid, 'div'), 'video');
    video.src = experiment.clip; video.controls = true; video.loop = true; video.muted = true; video.playsInline = true;
  }
}

add(root, 'h1', data.title);
if (data.about) add(root, 'p', data.about);
if (data.ranking && data.ranking.length) {
  add(root, 'h2', 'What matters most');
  add(root, 'p', 'The estimated force, when one setting is as wrong as it may well be and all else is known.');
  const node = add(add(root, 'div', undefined, 'table'), 'table'), head = add(add(node, 'thead'), 'tr');
  ['setting', 'force changes by', 'if it is wrong by', 'slope'].forEach(title => add(head, 'th', title));
  const body = add(node, 'tbody');
  data.ranking.forEach(r => {
    const row = add(body, 'tr');
    [r.title, (r.effect_pct > 0 ? '+' : '') + r.effect_pct.toFixed(1) + ' %', r.uncertainty, r.slope]
      .forEach((text, i) => add(row, 'td', text, i === 3 ? 'words' : undefined));
  });
}
data.experiments.forEach(experiment => {
  const section = add(root, 'section');
  add(section, 'h2', experiment.title);
  if (experiment.paper) add(section, 'div', 'Paper: ' + experiment.paper, 'soft');
  if (experiment.says) add(section, 'p', experiment.says);
  if (experiment.findings) add(section, 'p', 'Measured: ' + experiment.findings);
  if (experiment.why) add(section, 'p', 'Why: ' + experiment.why);
  charts(section, experiment);
  table(section, experiment);
});
add(root, 'p', 'Research software, not a medical device. Forces are proportional to the stated modulus. Charts: Chart.js, MIT licence.', 'soft');
)js";

/// No end of a script element may stand inside one.
std::string inside_script(std::string text) {
  for (size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.replace(at, 2, "<\\/");
  return text;
}

}  // namespace

std::string study_page_html(const nlohmann::ordered_json& data) {
  return std::string(
             "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
             "content=\"width=device-width,initial-scale=1\"><title>Palpate study</title><style>") +
         kStyle + "</style></head><body><main></main><script type=\"application/json\" id=\"data\">" +
         inside_script(data.dump()) + "</script><script>" + kChartLibrary + "</script><script>" + kScript +
         "</script></body></html>\n";
}

std::string data_uri(const std::filesystem::path& file, const std::string& type) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return "";
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:" + type + ";base64,";
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&bytes, i](size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i + k])) : 0U;
    };
    const unsigned word = byte(0) << 16 | byte(1) << 8 | byte(2);
    text += kDigits[word >> 18];
    text += kDigits[word >> 12 & 63];
    text += i + 1 < bytes.size() ? kDigits[word >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? kDigits[word & 63] : '=';
  }
  return text;
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw Unfinished(file.string() + ": cannot be written");
}

}  // namespace palpate::app
