//! Self-contained HTML pages: text, tables, plots and 3-D views. A page needs no network, and no script to be read; its
//! scripts add values on hover and turn pictures into views.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use super::bars::Bars;
use super::doubt::Doubt;
use super::foreign::{escaped, json_text};
use super::plot::{self, Plot};
use super::viewer::{Arrays, View};
use kanagata_files::{WriteError, write_atomic};

/// A page under construction.
#[derive(Debug, Clone, Default)]
pub struct Page {
    title: String,
    body: String,
    /// The last heading: title of the figures below it.
    heading: String,
    figures: usize,
    arrays: Arrays,
    /// Whether plots and views need their scripts.
    has_plots: bool,
    has_views: bool,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str) -> Self {
        let body = format!("<h1>{}</h1>\n", escaped(title));
        Self { title: title.to_owned(), heading: title.to_owned(), body, ..Self::default() }
    }

    /// A section heading.
    pub fn heading(&mut self, text: &str) {
        text.clone_into(&mut self.heading);
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// The outcome in one sentence, coloured by how it is.
    pub fn outcome(&mut self, outcome: Outcome, text: &str) {
        let class = match outcome {
            Outcome::Good => "good",
            Outcome::Doubtful => "doubtful",
            Outcome::Failed => "failed",
        };
        let _ = writeln!(self.body, "<p class=\"outcome {class}\">{}</p>", escaped(text));
    }

    /// A part that is folded until its title is clicked, and is open in print; `content` fills it.
    pub fn folded(&mut self, title: &str, content: impl FnOnce(&mut Self)) {
        let _ =
            writeln!(self.body, "<details class=\"part\"><summary>{}</summary>", escaped(title));
        content(self);
        self.body.push_str("</details>\n");
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

    /// A plot, `height` in CSS pixels at full width.
    pub fn plot(&mut self, plot: &Plot, height: usize) {
        let id = self.next_figure();
        self.has_plots = true;
        self.body.push_str(&plot::figure(plot, &self.heading, id, height));
    }

    /// A bar chart.
    pub fn bars(&mut self, bars: &Bars) {
        let id = self.next_figure();
        self.body.push_str(&bars.figure(id));
    }

    /// A 3-D view.
    pub fn view(&mut self, view: &View) {
        let id = self.next_figure();
        self.has_views = true;
        self.body.push_str(&view.figure(id, &mut self.arrays));
    }

    fn next_figure(&mut self) -> usize {
        self.figures += 1;
        self.figures - 1
    }

    /// The complete page.
    #[must_use]
    pub fn html(&self) -> String {
        let mut out = Vec::new();
        // Writing to memory does not fail.
        let _ = self.write_to(&mut out);
        String::from_utf8_lossy(&out).into_owned()
    }

    fn write_to(&self, out: &mut dyn std::io::Write) -> std::io::Result<()> {
        let scripts = self.scripts();
        write!(
            out,
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{}\"><title>{}</title>\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n{STYLE}</style>\n\
             </head><body><main>\n{}</main>\n",
            policy(&scripts),
            escaped(&self.title),
            self.body
        )?;
        if self.has_views {
            let arrays = json_text(&json!(self.arrays.texts()));
            writeln!(out, "<script type=\"application/json\" id=\"arrays\">{arrays}</script>")?;
        }
        for script in scripts {
            writeln!(out, "<script>{script}</script>")?;
        }
        out.write_all(b"</body></html>\n")
    }

    /// The scripts that the page needs.
    fn scripts(&self) -> Vec<&'static str> {
        let all = [(self.has_plots, HOVER), (self.has_views, VIEWER)];
        all.into_iter().filter(|(needed, _)| *needed).map(|(_, script)| script).collect()
    }

    /// Writes the page to a temporary file beside `path`, then renames it.
    ///
    /// # Errors
    /// [`WriteError`] when the folder is missing or full.
    pub fn write(&self, path: &Path) -> Result<(), WriteError> {
        write_atomic(path, |w| self.write_to(w))
    }
}

/// How a result is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Without doubts.
    Good,
    /// With doubts, or incomplete.
    Doubtful,
    /// There is no result to the end.
    Failed,
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

const STYLE: &str = include_str!("style.css");

/// Values of plots on hover.
const HOVER: &str = include_str!("plot/hover.js");
/// 3-D views. The files are one script with one scope.
const VIEWER: &str = concat!(
    "\"use strict\";(()=>{\n",
    include_str!("viewer/data.js"),
    include_str!("viewer/geometry.js"),
    include_str!("viewer/draw.js"),
    include_str!("viewer/controls.js"),
    include_str!("viewer/view.js"),
    "})();\n"
);

/// The content security policy: only these scripts, and nothing from a network.
fn policy(scripts: &[&str]) -> String {
    use base64::Engine as _;
    let digest = |script: &&str| {
        let digest = kanagata_files::digest::sha256(script.as_bytes());
        format!(" 'sha256-{}'", base64::engine::general_purpose::STANDARD.encode(digest))
    };
    let scripts: String = match scripts {
        [] => " 'none'".into(),
        some => some.iter().map(digest).collect(),
    };
    format!(
        "default-src 'none'; script-src{scripts}; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
         form-action 'none'"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Series;

    #[test]
    fn a_page_needs_no_network_and_escapes_what_it_is_given() {
        let mut page = Page::new("a <b> & \"c\"");
        page.table(&["x"], &[vec!["1.5".into()], vec!["</td>".into()]]);
        page.table(&["codes"], &[vec!["energy-balance; </b>-x".into()], vec!["-1.5e-3".into()]]);
        assert!(page.html().contains("default-src 'none'; script-src 'none';"));
        let series = Series { name: "</script>".into(), x: vec![1.0, 2.0], y: vec![3.0, 4.0] };
        page.plot(&Plot::lines(vec![series], "x", "y"), 300);
        page.view(&View { title: "</script>".into(), ..View::default() });
        let html = page.html();
        assert!(html.contains("<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
        assert!(html.contains("<td class=\"n\">1.5</td>") && html.contains("&lt;/td&gt;"));
        assert!(html.contains("<td><span>energy-balance;</span> <span>&lt;/b&gt;-x</span></td>"));
        assert!(html.contains("<td class=\"n\">-1.5e-3</td>"));
        assert!(html.contains("\\u003c/script>") && !html.contains("\"</script>"));
        assert_eq!(html.matches("<script").count(), html.matches("</script>").count());
        assert!(
            html.contains("default-src 'none'; script-src 'sha256-")
                && !html.contains("unsafe-eval")
        );
        assert!(html.contains("<div class=\"wide\"><table>") && html.contains("position: sticky"));
        for loads in ["<script src", "<link", "http:", "https:", "@import", "url(h"] {
            assert!(!html.contains(loads), "{loads}");
        }
    }

    /// A script that contains the end of its element, or a comment, would be cut.
    #[test]
    fn scripts_can_stand_in_a_page() {
        for script in [HOVER, VIEWER] {
            assert!(!script.contains("</") && !script.contains("<!--"));
            assert!(!script.contains("eval(") && !script.contains("innerHTML"));
        }
        let lines: usize = [HOVER, VIEWER].map(|script| script.lines().count()).iter().sum();
        assert!(lines <= 1500, "{lines} lines");
    }
}
