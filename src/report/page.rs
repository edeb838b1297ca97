//! Self-contained HTML pages: text, tables, charts and 3-D views. The plotting script is embedded, so that a page opens
//! without a network.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;

use super::doubt::Doubt;
use super::foreign::{escape_texts, escaped};
use crate::files::{WriteError, write_atomic};

/// A page under construction.
#[derive(Debug, Clone, Default)]
pub struct Page {
    title: String,
    body: String,
    scripts: String,
    plots: usize,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str) -> Self {
        let body = format!("<h1>{}</h1>\n", escaped(title));
        Self { title: title.to_owned(), body, ..Self::default() }
    }

    /// A section heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// A box with the doubts about the content of the page; nothing if there are none.
    pub fn doubts(&mut self, doubts: &[Doubt]) {
        if doubts.is_empty() {
            return;
        }
        self.body.push_str("<section class=\"doubts\"><h2>Doubts: this result must not be trusted as it is</h2><ul>\n");
        for doubt in doubts {
            let _ = writeln!(
                self.body,
                "<li><code>{}</code> {}</li>",
                escaped(doubt.code.as_str()),
                escaped(&doubt.text)
            );
        }
        self.body.push_str("</ul></section>\n");
    }

    /// A box with notes on how to read the content of the page; nothing if there are none.
    pub fn notes(&mut self, notes: &[String]) {
        if notes.is_empty() {
            return;
        }
        self.body.push_str("<section class=\"notes\"><h2>Notes</h2><ul>\n");
        for note in notes {
            let _ = writeln!(self.body, "<li>{}</li>", escaped(note));
        }
        self.body.push_str("</ul></section>\n");
    }

    /// A table. Cells that parse as numbers are right-aligned, unless no column has a name. Words with hyphens, such as codes,
    /// do not break. A table wider than the page scrolls in its own box with a fixed first column.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        self.body.push_str("<div class=\"wide\"><table><thead><tr>");
        for cell in head {
            let _ = write!(self.body, "<th>{}</th>", escaped(cell));
        }
        self.body.push_str("</tr></thead><tbody>\n");
        let named = head.iter().any(|cell| !cell.is_empty());
        for row in rows {
            self.body.push_str("<tr>");
            for cell in row {
                let number = cell.parse::<f64>().is_ok();
                let class = match cell {
                    _ if named && number => " class=\"n\"",
                    text if text.chars().count() > NARROW_MAX => " class=\"t\"",
                    _ => "",
                };
                let text = if number { escaped(cell) } else { whole_words(cell) };
                let _ = write!(self.body, "<td{class}>{text}</td>");
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody></table></div>\n");
    }

    /// A plot of plotly traces and layout, `height` in CSS pixels. Their texts are escaped: plotly's markup is not
    /// interpreted.
    pub fn plot(&mut self, traces: &[Value], layout: &Value, height: usize) {
        let id = format!("plot{}", self.plots);
        self.plots += 1;
        let _ = writeln!(self.body, "<div id=\"{id}\" style=\"height:{height}px\"></div>");
        let (mut data, mut layout) = (Value::from(traces), layout.clone());
        escape_texts(&mut data);
        escape_texts(&mut layout);
        let _ = writeln!(
            self.scripts,
            "Plotly.newPlot(\"{id}\",{data},{layout},{{responsive:true,displaylogo:false}});"
        );
    }

    /// The complete page.
    #[must_use]
    pub fn html(&self) -> String {
        let mut out = Vec::new();
        // Writing to memory does not fail.
        let _ = self.write_to(&mut out);
        String::from_utf8_lossy(&out).into_owned()
    }

    /// Writes the page in parts: the plotting script has several megabytes and is not copied.
    fn write_to(&self, out: &mut dyn std::io::Write) -> std::io::Result<()> {
        let library = plotly::Plot::offline_js_sources();
        let start = library.find('>').map_or(0, |at| at + 1);
        let end = library.find("</script>").unwrap_or(library.len());
        let library = &library[start.min(end)..end];
        let scripts = format!("\n{}", in_script(&self.scripts));
        let policy = policy(&[library, &scripts]);
        write!(
            out,
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\"><title>{}</title>\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>{STYLE}</style>\n",
            escaped(&self.title)
        )?;
        write!(out, "<script>{library}</script>\n</head><body><main>\n{}</main>\n", self.body)?;
        write!(out, "<script>{scripts}")?;
        out.write_all(b"</script></body></html>\n")
    }

    /// Writes the page to a temporary file beside `path`, then renames it.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| self.write_to(w))
    }
}

/// Largest number of characters of a cell that may become as narrow as its longest word. At 30 a sentence of a wide table has
/// few lines, and two or three codes stand in one.
const NARROW_MAX: usize = 30;
/// Largest number of characters of a word that does not break at its hyphens.
const WHOLE_MAX: usize = 40;

/// A text whose words do not break at their hyphens, unless they are very long.
fn whole_words(text: &str) -> String {
    let word = |word: &str| {
        let whole = word.contains('-') && word.chars().count() <= WHOLE_MAX;
        let text = escaped(word);
        if whole { format!("<span>{text}</span>") } else { text }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;margin:0;color:#1b2330;background:#fff}\
main{max-width:1080px;margin:0 auto;padding:24px}h1{font-size:28px;margin:0 0 8px}\
h2{font-size:20px;margin:32px 0 8px;border-bottom:1px solid #d5dbe3;padding-bottom:4px}\
table{border-collapse:collapse;font-size:14px;margin:8px 0}th,td{padding:3px 12px 3px 0;text-align:left;\
border-bottom:1px solid #e6eaef}th{color:#5a6675;font-weight:600}td.n{text-align:right;\
font-variant-numeric:tabular-nums}p{max-width:75ch}\
.doubts,.notes{border:2px solid #b3541e;background:#fdf3ec;padding:4px 20px;margin:16px 0}\
.notes{border-color:#5a6675;background:#f3f5f8}.doubts h2,.notes h2{border:0;margin:8px 0}\
.doubts li,.notes li{max-width:90ch;margin:4px 0}\
.wide td.t{min-width:32ch}.wide td span{white-space:nowrap}\
.wide{overflow-x:auto;max-width:100%}.wide th{vertical-align:bottom}\
.wide th:first-child,.wide td:first-child{position:sticky;left:0;background:#fff;min-width:9em}";

/// Scripts with strings from outside the program. A `<` in a string could end the script or open a comment, and is
/// written as an escape; scripts contain no `<` outside strings.
fn in_script(scripts: &str) -> String {
    scripts.replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}

/// The content security policy: only these scripts, and nothing from a network. The plotting library compiles functions
/// from text (`unsafe-eval`).
fn policy(scripts: &[&str]) -> String {
    use base64::Engine as _;
    let digest = |script: &&str| {
        let digest = crate::files::digest::sha256(script.as_bytes());
        format!(" 'sha256-{}'", base64::engine::general_purpose::STANDARD.encode(digest))
    };
    let scripts: String = scripts.iter().map(digest).collect();
    format!(
        "default-src 'none'; script-src{scripts} 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; \
         font-src data:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_page_needs_no_network_and_escapes_what_it_is_given() {
        let mut page = Page::new("a <b> & \"c\"");
        page.table(&["x"], &[vec!["1.5".into()], vec!["</td>".into()]]);
        page.table(&["codes"], &[vec!["energy-balance; </b>-x".into()], vec!["-1.5e-3".into()]]);
        page.plot(&[json!({"x":[1,2],"y":[3,4],"name":"</script>"})], &json!({}), 300);
        let html = page.html();
        assert!(html.contains("<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
        assert!(html.contains("<td class=\"n\">1.5</td>") && html.contains("&lt;/td&gt;"));
        assert!(html.contains("<td><span>energy-balance;</span> <span>&lt;/b&gt;-x</span></td>"));
        assert!(html.contains("<td class=\"n\">-1.5e-3</td>"));
        assert!(html.contains("\"&lt;/script&gt;\"") && !html.contains("\"</script>"));
        assert!(html.contains("default-src 'none'; script-src 'sha256-"));
        assert!(html.contains("<div class=\"wide\"><table>") && html.contains("position:sticky"));
        assert!(!html.contains("<script src") && !html.contains("<link"));
        assert!(html.len() > 1_000_000, "the plotting script is inside");
    }
}
