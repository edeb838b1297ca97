//! `kanagata material list`, `kanagata material show NAME|FILE [--json] [--html FILE]` and `kanagata material fit FILE`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Subcommand;

use super::exit::{EXIT_HELP, Exit, Failure};
use super::fit;
use super::output_clash::refuse_clashes;
use super::paths::input_path;
use super::terminal::{out, out_json, out_lines};
use crate::files::standard::is_stdin;
use crate::report::page::Page;
use crate::report::plot::{Plot, Series};
use crate::scene::read::parse_card;
use crate::solver::material::card::{self, CardError, MaterialCard};
use crate::solver::material::forming_limit::FormingLimit;
use crate::solver::material::yield_function::YieldFunction;

/// Arguments of `material`.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("Example:\n  kanagata material show aa2090-t3-barlat2005 --html sheet.html\n\n{EXIT_HELP}"))]
pub struct MaterialArgs {
    #[command(subcommand)]
    command: MaterialCommand,
}

#[derive(Debug, Subcommand)]
enum MaterialCommand {
    /// List the material cards in the program
    List,
    /// Show a card: checks, r values, yield ratios, hardening curve
    Show {
        /// Name of a card in the program, or a JSON file; - for standard input
        card: String,
        /// Print the card as JSON, complete and ready for a scene
        #[arg(long, conflicts_with = "html")]
        json: bool,
        /// Also write a page with the hardening curve and the yield locus
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
    },
    /// Fit a hardening law to a measured, noisy curve (a table must not fall)
    Fit {
        /// Plastic strain and true stress [MPa]: two columns of text, or a card or scene with a `table`; - for standard
        /// input
        #[arg(value_parser = input_path)]
        curve: PathBuf,
        /// Law to print; default: the best fit
        #[arg(long, value_enum)]
        law: Option<fit::Law>,
    },
}

/// Plastic strains of the printed tension curve.
const STRAINS: [f64; 11] = [0.0, 0.002, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0];

/// Lists or shows material cards.
///
/// # Errors
/// Exit code 2 for an unknown name or a card out of range, 4 when a file cannot be read or written.
pub fn run(args: &MaterialArgs) -> Result<Exit, Failure> {
    match &args.command {
        MaterialCommand::List => {
            let cards = card::library();
            let width = cards.iter().map(|c| c.name.len()).max().unwrap_or(0);
            for card in cards {
                out!("{:width$}  {}", card.name, card.source);
            }
        }
        MaterialCommand::Fit { curve, law } => return fit::run(curve, *law),
        MaterialCommand::Show { card, json, html } => {
            let file = input_path(card).map_err(Failure::input)?;
            refuse_clashes(&[&file], &[("--html", html.as_deref())])?;
            show(card, &file, *json, html.as_deref())?;
        }
    }
    Ok(Exit::Done)
}

/// Shows a checked card: as text, as JSON, as a page.
fn show(name: &str, file: &Path, json: bool, html: Option<&Path>) -> Result<(), Failure> {
    let card = load(name, file)?;
    let refused = |error: CardError| {
        // The name of the card need not tell its file.
        let is_file = is_stdin(file) || file.is_file();
        let place = if is_file { format!("{}: ", file.display()) } else { String::new() };
        Failure::input(format!("{place}{error}"))
    };
    card.build(0.0).map_err(refused)?;
    let function = card.yield_function().map_err(refused)?;
    if json {
        out_json!("{}", serde_json::to_string_pretty(&card).map_err(Failure::input)?);
        return Ok(());
    }
    out_lines!(text_of(&card, function.as_ref()).trim_end());
    if let Some(path) = html {
        page(&card, function.as_ref()).write(path)?;
        out!("page: {}", path.display());
    }
    Ok(())
}

/// Standard input, a file if it exists, otherwise a card of the library.
fn load(name: &str, path: &Path) -> Result<MaterialCard, Failure> {
    if !is_stdin(path) && !path.is_file() {
        return card::find(name).map_err(|error| {
            Failure::input(format!("{error}; a path names a JSON file, and there is none of it"))
        });
    }
    let text = crate::files::read_text(path, crate::files::Input::Description)
        .map_err(|error| Failure::new(Exit::Io, format!("{}: {error}", path.display())))?;
    parse_card(text.as_bytes())
        .map_err(|error| Failure::input(format!("{}: {error}", path.display())))
}

fn text_of(card: &MaterialCard, function: Option<&YieldFunction>) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}\n  source: {}", card.name, card.source);
    let _ = writeln!(out, "  E {} MPa, nu {}", card.young_mpa, card.poisson);
    if let Some(function) = function {
        let _ = writeln!(out, "  yield surface: {}\n", surface(function));
        for row in [&["angle", "r", "yield ratio"].map(String::from)[..]]
            .into_iter()
            .chain(angles(function).iter().map(Vec::as_slice))
        {
            let _ = writeln!(out, "  {:>8} {:>9} {:>12}", row[0], row[1], row[2]);
        }
    }
    if let Some(angle) = function.and_then(negative_r_angle) {
        let _ = writeln!(
            out,
            "  WARNING    drawn at {angle:.0} degrees to rolling it would grow wider or thicker (r below 0 there): no sheet does; check the parameters"
        );
    }
    let rows = curve(card);
    if !rows.is_empty() {
        let _ = writeln!(out, "\n  tension along rolling:");
        let _ = writeln!(out, "  {:>8} {:>12} {:>12}", "p", "stress MPa", "slope MPa");
        for row in rows {
            let _ = writeln!(out, "  {:>8} {:>12} {:>12}", row[0], row[1], row[2]);
        }
        if let Some(strain) = card.uniform_strain() {
            let _ = writeln!(out, "  uniform plastic strain in tension (Considere): {strain:.4}");
        }
        if let Some(n) = card.strain_hardening_exponent() {
            let _ = writeln!(out, "  strain-hardening exponent n (ISO 10275): {n:.4}");
        }
    }
    out += &limit_text(card);
    for (k, one) in card.backstresses.iter().enumerate() {
        let _ = writeln!(out, "  backstress {}: C {} MPa, gamma {}", k + 1, one.c_mpa, one.gamma);
    }
    out
}

/// Thicknesses of printed limit curves [mm].
const LIMIT_THICKNESSES: [f64; 3] = [0.8, 1.0, 1.5];

/// The forming limit curve of a card: its points, for laws at several thicknesses.
fn limit_text(card: &MaterialCard) -> String {
    let mut out = String::new();
    let law = !matches!(card.forming_limit, Some(FormingLimit::Points { .. }));
    for thickness in &LIMIT_THICKNESSES[..if law { LIMIT_THICKNESSES.len() } else { 1 }] {
        let Ok(Some(curve)) = card.limit_curve(*thickness) else { continue };
        let points =
            curve.points().iter().map(|[minor, major]| format!("({minor:.3}, {major:.3})"));
        let points: Vec<String> = points.collect();
        let of = if law { format!(" at {thickness} mm") } else { String::new() };
        let _ = writeln!(
            out,
            "  forming limit{of}, minor and major logarithmic strain: {}",
            points.join(" ")
        );
    }
    out
}

fn surface(function: &YieldFunction) -> String {
    match function {
        YieldFunction::Hill48(_) => "Hill48 (or von Mises), convex".into(),
        YieldFunction::Yld2004(law) => {
            format!("Yld2004-18p with exponent {}, convex and closed", law.exponent())
        }
    }
}

/// An angle to the rolling direction [degrees] with a negative r value.
fn negative_r_angle(function: &YieldFunction) -> Option<f64> {
    (0..=90).map(f64::from).find(|angle| function.r_value(angle.to_radians()) < 0.0)
}

/// Angle, r value and yield ratio every 15 degrees, then balanced biaxial tension.
fn angles(function: &YieldFunction) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = (0..7)
        .map(|k| {
            let angle = 15.0 * f64::from(k);
            let (r, ratio) =
                (function.r_value(angle.to_radians()), function.yield_ratio(angle.to_radians()));
            vec![format!("{angle}"), format!("{r:.4}"), format!("{ratio:.4}")]
        })
        .collect();
    rows.push(vec![
        "biaxial".into(),
        format!("{:.4}", function.biaxial_r_value()),
        format!("{:.4}", function.biaxial_ratio()),
    ]);
    rows
}

/// Plastic strain, stress and slope in tension along the rolling direction, with backstresses; empty for an elastic
/// card.
fn curve(card: &MaterialCard) -> Vec<Vec<String>> {
    STRAINS
        .iter()
        .filter_map(|&p| {
            let (stress, slope) = card.tension(p)?;
            Some(vec![format!("{p}"), format!("{stress:.2}"), format!("{slope:.1}")])
        })
        .collect()
}

fn page(card: &MaterialCard, function: Option<&YieldFunction>) -> Page {
    let mut page = Page::new(&card.name);
    page.text(&format!("Source: {}", card.source));
    page.text(&format!("E {} MPa, Poisson's ratio {}", card.young_mpa, card.poisson));
    let rows = curve(card);
    if !rows.is_empty() {
        page.heading("Hardening");
        let x: Vec<f64> = (0..=200).map(|k| 0.0025 * f64::from(k)).collect();
        let y = x.iter().filter_map(|&p| Some(card.tension(p)?.0)).collect();
        let series = Series { name: "stress".into(), x, y };
        let title = "plastic strain in tension along rolling";
        page.plot(&Plot::lines(vec![series], title, "stress [MPa]"), 420);
        page.table(&["p", "stress [MPa]", "slope [MPa]"], &rows);
    }
    if let Some(function) = function {
        page.heading("Yield locus");
        page.text("Plane stress over the yield stress along rolling, at four levels of shear.");
        let series = SHEAR_FRACTIONS.map(|fraction| locus(function, fraction)).into();
        let plot = Plot { equal: true, ..Plot::lines(series, "rolling", "transverse") };
        page.plot(&plot, 560);
        add_anisotropy(&mut page, function);
    }
    page
}

/// Adds r values and yield ratios over the angle to the rolling direction.
fn add_anisotropy(page: &mut Page, function: &YieldFunction) {
    page.heading("Anisotropy");
    let x: Vec<f64> = (0..=90).map(f64::from).collect();
    let of = |name: &str, value: &dyn Fn(f64) -> f64| Series {
        name: name.into(),
        x: x.clone(),
        y: x.iter().map(|a| value(a.to_radians())).collect(),
    };
    let series = vec![
        of("r value", &|a| function.r_value(a)),
        of("yield ratio", &|a| function.yield_ratio(a)),
    ];
    page.plot(&Plot::lines(series, "angle to rolling [deg]", ""), 420);
    page.table(&["angle [deg]", "r", "yield ratio"], &angles(function));
}

/// Fractions of the shear yield stress at which the locus is drawn.
const SHEAR_FRACTIONS: [f64; 4] = [0.0, 0.4, 0.7, 0.9];

/// Section of the yield surface in plane stress at a fraction below 1 of the shear yield stress.
fn locus(function: &YieldFunction, fraction: f64) -> Series {
    let unit = std::f64::consts::SQRT_2;
    let strength = function.equivalent(&[0.0, 0.0, 0.0, unit, 0.0, 0.0]).recip();
    let name = match fraction {
        0.0 => "no shear".into(),
        _ => format!("shear {:.3}, {:.0} % of its strength", fraction * strength, 100.0 * fraction),
    };
    let mut series = Series { name, x: Vec::new(), y: Vec::new() };
    for k in 0..=360 {
        let (s, c) = f64::from(k).to_radians().sin_cos();
        let radius = function.locus_radius([c, s], fraction);
        series.x.push(radius * c);
        series.y.push(radius * s);
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_card_is_shown_and_drawn() {
        for card in card::library() {
            let function = card.yield_function().unwrap();
            let text = text_of(&card, function.as_ref());
            assert!(text.contains("biaxial") && text.contains("convex"), "{text}");
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            assert!(page(&card, function.as_ref()).html().contains("Yield locus"));
            for fraction in SHEAR_FRACTIONS {
                let locus = locus(function.as_ref().unwrap(), fraction);
                let wide = locus.x.iter().all(|x| x.is_finite() && x.abs() < 3.0);
                assert!(locus.x.len() == 361 && wide, "{}: {}", card.name, locus.name);
                let [low, high] =
                    [f64::min, f64::max].map(|f| locus.x.iter().copied().fold(0.0, f));
                assert!(low < -0.2 && high > 0.2, "{}: {low} {high}", card.name);
            }
        }
    }

    /// Von Mises: the ellipse through (1, 0), (1, 1); the Considère strain of Swift's law is n - eps0.
    #[test]
    fn shown_figures_are_the_closed_forms() {
        let card = load("sheet-ssnv501", Path::new("")).unwrap();
        let function = card.yield_function().unwrap().unwrap();
        let locus = locus(&function, 0.0);
        for (x, y) in locus.x.iter().zip(&locus.y) {
            assert!((x * x - x * y + y * y - 1.0).abs() < 1e-12);
        }
        let steel = card::find("mild-steel-neto2012").unwrap();
        let strain = steel.uniform_strain().unwrap();
        assert!((strain - (0.268 - 0.00439)).abs() < 1e-9);
    }

    /// Voce with two backstresses: `s = s0 + Q (1 - e^-bp) + Σ C/γ (1 - e^-γp)`; the Considère strain solves `ds/dp =
    /// s`.
    #[test]
    fn stress_and_uniform_strain_have_the_backstresses_in_them() {
        let mut card = card::find("structural-steel-hartloper-uvc").unwrap();
        let parts = [(100.7, 8.0), (11608.2 / 145.2, 145.2), (1026.3 / 4.7, 4.7)];
        let stress =
            |p: f64| 318.5 + parts.iter().map(|(q, b)| q * (1.0 - f64::exp(-b * p))).sum::<f64>();
        let slope = |p: f64| parts.iter().map(|(q, b)| q * b * f64::exp(-b * p)).sum::<f64>();
        let strain = card.uniform_strain().unwrap();
        assert!((slope(strain) - stress(strain)).abs() < 1e-6 && (strain - 0.188).abs() < 1e-3);
        let text = text_of(&card, card.yield_function().unwrap().as_ref());
        assert!(text.contains("(Considere): 0.18"), "{text}");
        assert!(
            text.contains(&format!("0.1 {:>12.2} {:>12.1}", stress(0.1), slope(0.1))),
            "{text}"
        );
        assert!(page(&card, None).html().contains(&format!("{:.2}", stress(0.1))));
        // Prager's law: a straight line.
        let before = card.tension(0.2).unwrap();
        card.backstresses.push(card::BackstressCard { c_mpa: 50.0, gamma: 0.0 });
        let after = card.tension(0.2).unwrap();
        // Of 500 MPa in a hundred steps: 2e-13 of it is rounding.
        assert!(
            (after.0 - before.0 - 10.0).abs() < 1e-10 && (after.1 - before.1 - 50.0).abs() < 1e-10
        );
    }

    /// A convex yield surface with negative r values.
    #[test]
    fn negative_r_values_are_reported() {
        let mut card = card::find("mild-steel-neto2012").unwrap();
        let shown = |card: &MaterialCard| text_of(card, card.yield_function().unwrap().as_ref());
        assert!(!shown(&card).contains("WARNING"));
        card.criterion =
            Some(card::YieldCriterion::Hill48 { f: -0.1, g: 0.5, h: 0.7, l: 1.5, m: 1.5, n: 1.5 });
        assert!(shown(&card).contains("r below 0"), "{}", shown(&card));
    }

    #[test]
    fn names_and_files_that_are_no_card_say_why() {
        let unknown = load("unobtainium", Path::new("unobtainium")).unwrap_err();
        assert!(unknown.error.to_string().contains("aa2090-t3-barlat2005"));
        let file = std::env::temp_dir().join(format!("kanagata-card-{}.json", std::process::id()));
        std::fs::write(&file, "{\"name\": 3}").unwrap();
        let error = load(&file.to_string_lossy(), &file).unwrap_err();
        std::fs::remove_file(&file).unwrap();
        assert!(error.error.to_string().contains("`young_mpa` (above zero)"));
    }
}
