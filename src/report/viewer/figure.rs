//! A view as an HTML figure: its picture, colour bar, and its data for the script of the page.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::arrays::Arrays;
use super::colors;
use super::description;
use super::picture;
use super::view::View;
use crate::digits::four_digits;
use crate::foreign::{escaped, json_text};

impl View {
    /// The figure with the number `id` on its page.
    pub(crate) fn figure(&self, id: usize, arrays: &mut Arrays) -> String {
        let fields = self.fields();
        let shown = fields
            .first()
            .and_then(|&(name, signed)| Some((name, signed, self.limits(name, signed)?)));
        let picture = STANDARD.encode(picture::picture(self, shown));
        let mut out = format!(
            "<figure class=\"view\" id=\"view{id}\"><img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{picture}\">\n",
            escaped(&self.alternative(shown)),
            picture::SIZE[0],
            picture::SIZE[1],
        );
        if let Some(shown) = shown {
            color_bar(&mut out, shown, id);
        }
        let _ = writeln!(
            out,
            "<script type=\"application/json\" class=\"scene\">{}</script></figure>",
            json_text(&description::description(self, arrays))
        );
        out
    }

    /// The picture in words.
    fn alternative(&self, shown: Option<(&str, bool, [f64; 2])>) -> String {
        let names: Vec<&str> = self.surfaces.iter().map(|s| s.name.as_str()).collect();
        let field = shown.map_or_else(String::new, |(name, _, [low, high])| {
            format!("; colours: {name}, {} to {}", four_digits(low), four_digits(high))
        });
        format!("{}: {}{field}", self.title, names.join(", "))
    }
}

/// The colour bar of the picture.
fn color_bar(out: &mut String, (name, signed, [low, high]): (&str, bool, [f64; 2]), id: usize) {
    let table = colors::table(signed);
    let _ = write!(
        out,
        "<figcaption class=\"scale\"><span>{}</span> <svg viewBox=\"0 0 200 12\" aria-hidden=\"true\"><defs><linearGradient \
         id=\"g{id}\">",
        four_digits(low)
    );
    for (k, [r, g, b]) in table.iter().enumerate() {
        let at = 100.0 * k as f64 / (table.len() - 1) as f64;
        let _ = write!(out, "<stop offset=\"{at:.1}%\" stop-color=\"rgb({r},{g},{b})\"/>");
    }
    let _ = writeln!(
        out,
        "</linearGradient></defs><rect width=\"200\" height=\"12\" fill=\"url(#g{id})\"/></svg> <span>{}</span> {}</figcaption>",
        four_digits(high),
        escaped(name)
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::surface::{Field, Surface};
    use kanagata_geometry::Vec3;

    #[test]
    fn a_figure_has_a_picture_and_its_words() {
        let points = [(0.0, 0.0), (2.0, 0.0), (0.0, 2.0)].map(|(a, b)| Vec3::new(a, b, 0.0));
        let surface = Surface {
            name: "</script>\u{202e}".into(),
            points: points.into(),
            triangles: vec![[0, 1, 2]],
            fields: vec![Field {
                name: "error [mm]".into(),
                signed: true,
                values: vec![-0.1, 0.02, 0.03],
                ..Field::default()
            }],
            ..Surface::default()
        };
        let title = "tools <b>".into();
        let view = View { title, surfaces: vec![surface], ..View::default() };
        let text = view.figure(2, &mut Arrays::default());
        assert!(text.contains("src=\"data:image/png;base64,iVBOR") && text.contains("-0.1</span>"));
        assert!(text.contains("alt=\"tools &lt;b&gt;: &lt;/script&gt;"));
        assert!(text.matches("</script>").count() == 1 && !text.contains('\u{202e}'));
        let empty = View::default().figure(0, &mut Arrays::default());
        assert!(empty.contains("<img") && !empty.contains("figcaption"));
    }
}
