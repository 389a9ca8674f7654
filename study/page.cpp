#include "study/page.h"

#include <cmark-gfm-core-extensions.h>
#include <cmark-gfm.h>

#include <cstdlib>
#include <memory>

#include "study/files.h"

namespace palpate::study {

namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light dark;--ink:#1c2430;--line:#d9dee5;--paper:#fff}
@media(prefers-color-scheme:dark){:root{--ink:#e6e9ee;--line:#333b47;--paper:#14181f}}
body{margin:0 auto;max-width:66rem;padding:1rem;background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.7rem;line-height:1.2}h2{margin:2.5rem 0 .3rem;font-size:1.25rem}
table{display:block;overflow-x:auto;border-collapse:collapse;font-size:.84rem;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .55rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:bottom}
img,video{max-width:100%;border-radius:.3rem}
)css";

std::string html_of(const std::string& markdown) {
  cmark_gfm_core_extensions_ensure_registered();
  const std::unique_ptr<cmark_parser, void (*)(cmark_parser*)> parser(cmark_parser_new(CMARK_OPT_DEFAULT),
                                                                      cmark_parser_free);
  cmark_parser_attach_syntax_extension(parser.get(), cmark_find_syntax_extension("table"));
  cmark_parser_feed(parser.get(), markdown.data(), markdown.size());
  const std::unique_ptr<cmark_node, void (*)(cmark_node*)> document(cmark_parser_finish(parser.get()), cmark_node_free);
  const std::unique_ptr<char, void (*)(void*)> html(
      cmark_render_html(document.get(), CMARK_OPT_DEFAULT, cmark_parser_get_syntax_extensions(parser.get())),
      std::free);
  return html.get();
}

std::string type_of(const std::filesystem::path& file) {
  const std::string ending = file.extension();
  return ending == ".svg" ? "image/svg+xml" : ending == ".mp4" ? "video/mp4" : "image/jpeg";
}

}  // namespace

std::string html_page(const std::string& markdown, const std::filesystem::path& folder) {
  const std::string html = html_of(markdown);
  std::string page =
      "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>Palpate study</title><style>" +
      std::string(kStyle) + "</style></head><body>\n";
  const std::string opening = "<img src=\"";
  size_t done = 0;
  for (size_t at = 0; (at = html.find(opening, done)) != std::string::npos;) {
    const size_t name = at + opening.size(), end = html.find('"', name);
    const std::filesystem::path file = html.substr(name, end - name);
    const std::string type = type_of(file);
    page += html.substr(done, at - done) +
            (type == "video/mp4" ? "<video controls loop muted playsinline src=\"" : opening) +
            data_uri(folder / file, type);
    done = end;
  }
  return page + html.substr(done) + "</body></html>\n";
}

}  // namespace palpate::study
