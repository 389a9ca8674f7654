#include "palpate/feedback/report_page.h"

namespace palpate {
namespace {

constexpr const char* kStyle = R"css(
:root{--paper:#fff;--panel:#f5f7f8;--ink:#15202b;--faint:#5b6875;--line:#d9dfe4;--estimate:#0a6ebd;--truth:#d1650a;
--good:#2e9e5b;--idle:#b8c2cb;--doubt:#c43e6a;--caution:#d9a400;--second:#7a4fc2}
@media (prefers-color-scheme:dark){:root{--paper:#12171c;--panel:#1b222a;--ink:#e8edf2;--faint:#9aa7b4;--line:#33404c;
--estimate:#58b4ff;--truth:#ffab5c;--good:#49c97f;--idle:#4b5864;--doubt:#ff7da3;--second:#b79bf2}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif;color-scheme:light dark}
main{max-width:980px;margin:0 auto;padding:20px 16px 48px}
h1{font-size:1.6rem;line-height:1.2;margin:.2em 0}
h2{font-size:1.15rem;margin:2em 0 .6em}
p{margin:.5em 0}
.faint{color:var(--faint);font-size:.9rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(140px,1fr));gap:10px;margin:18px 0}
.card{background:var(--panel);border-radius:10px;padding:12px 14px}
.card b{display:block;font-size:1.35rem;font-weight:650;white-space:nowrap}
.card span{color:var(--faint);font-size:.82rem}
.note{border-left:3px solid var(--estimate);background:var(--panel);padding:10px 14px;border-radius:0 8px 8px 0}
.caution{border-color:var(--caution);margin:.5em 0}.caution ul{margin:.2em 0;padding-left:1.3em}
.chart svg{display:block;width:100%;height:auto;touch-action:pan-y}
.chart .narrow{display:none}
.chart{margin:0 0 8px}
polyline{fill:none;stroke-width:2;stroke-linejoin:round}
.estimate{stroke:var(--estimate)}.truth{stroke:var(--truth);stroke-dasharray:6 4}
.estimate.second{stroke:var(--second)}.truth.second{stroke:var(--second);stroke-dasharray:2 4}
.grid{stroke:var(--line)}.cursor{stroke:var(--faint)}
text{fill:var(--ink);font-size:12px}.tick{fill:var(--faint)}.end{text-anchor:end}.middle{text-anchor:middle}
.readout{min-height:1.5em;font-variant-numeric:tabular-nums;color:var(--faint);font-size:.88rem}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:.88rem;margin:.4em 0}
.legend i{display:inline-block;width:18px;height:10px;border-radius:2px;margin-right:6px}
.legend i.curve{height:0;border-top:3px solid;border-radius:0;vertical-align:middle}
i.estimate{border-color:var(--estimate)!important}i.truth{border-color:var(--truth)!important;border-top-style:dashed!important}
i.second{border-color:var(--second)!important}
rect.ok,rect.contact{fill:var(--good)}rect.no_contact{fill:var(--idle)}
rect.tool_lost,rect.not_converged,rect.map_stale{fill:var(--doubt)}rect.true_contact{fill:var(--truth)}
i.ok{background:var(--good)}i.no_contact{background:var(--idle)}i.doubt{background:var(--doubt)}
i.true_contact{background:var(--truth)}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:4px 18px 4px 0;border-bottom:1px solid var(--line);white-space:nowrap}
th{color:var(--faint);font-weight:500}td.number,th.number{text-align:right}
.tables{display:grid;grid-template-columns:repeat(auto-fit,minmax(300px,1fr));gap:0 40px}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(280px,1fr));gap:14px}
figure{margin:0}figure img{width:100%;border-radius:8px;display:block}
figcaption{color:var(--faint);font-size:.85rem;margin-top:4px}
pre{background:var(--panel);padding:12px;border-radius:8px;overflow-x:auto;font-size:.82rem;line-height:1.4}
footer{margin-top:40px;border-top:1px solid var(--line);padding-top:12px}
@media (max-width:640px){.chart .wide{display:none}.chart .narrow{display:block}h1{font-size:1.35rem}}
)css";

constexpr const char* kScript = R"js(
document.querySelectorAll('.chart').forEach(chart => {
  const data = JSON.parse(chart.querySelector('script').textContent);
  const readout = chart.querySelector('.readout');
  chart.querySelectorAll('svg').forEach(svg => {
    const at = name => Number(svg.dataset[name]);
    svg.addEventListener('pointermove', event => {
      const box = svg.getBoundingClientRect();
      const x = (event.clientX - box.left) / box.width * svg.viewBox.baseVal.width;
      const time = at('fromS') + (x - at('left')) / (at('right') - at('left')) * (at('toS') - at('fromS'));
      const texts = [];
      let shown = time;
      data.forEach(series => {
        let best = -1;
        series.time.forEach((t, i) => {
          if (best < 0 || Math.abs(t - time) < Math.abs(series.time[best] - time)) best = i;
        });
        if (best < 0) return;
        shown = series.time[best];
        const value = series.value[best];
        texts.push(series.name + ' ' + (value === null ? '–' : value.toFixed(3)));
      });
      readout.textContent = shown.toFixed(2) + ' s: ' + texts.join(', ') + ' ' + chart.dataset.unit;
      const cursor = svg.querySelector('.cursor');
      const cx = at('left') + (shown - at('fromS')) / (at('toS') - at('fromS')) * (at('right') - at('left'));
      cursor.setAttribute('x1', cx);
      cursor.setAttribute('x2', cx);
    });
  });
});
)js";

}  // namespace

std::string escape_html(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>" +
         escape_html(title) + "</title><style>" + kStyle + "</style></head>\n<body><main>\n" + body +
         "\n</main><script>" + kScript + "</script></body></html>\n";
}

}  // namespace palpate
