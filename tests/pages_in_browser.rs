//! Pages in a browser: 3-D views and plots show the values of the result files.

mod bend;
mod browser;
mod skipping;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use browser::{CHROMIUM, chromium, document, driven};
use kanagata::geometry::Vec3;
use kanagata::report::record::History;
use kanagata::report::vtu_read::{self, Grid};
use serde_json::{Value, json};

/// The bend with a symmetry plane y = 0, in a folder of its own.
struct Run(tempfile::TempDir);

impl Run {
    fn new() -> Self {
        let run = Self(tempfile::tempdir().unwrap());
        bend::write_tools(run.0.path());
        let mut scene = bend::scene("");
        scene["stages"][0]["largest_increment"] = 0.2.into();
        scene["symmetry"] = json!([{"normal": "y"}]);
        scene["output"] = json!({"vtu_every": 1});
        fs::write(run.0.path().join("bend.scene.json"), scene.to_string()).unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_kanagata-solve"))
            .args(["run", "bend.scene.json", "-q", "--accept-doubts", "-o", "out"])
            .current_dir(run.0.path())
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
        run
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join("out").join(name)
    }

    fn grid(&self, name: &str) -> Grid {
        vtu_read::read(&self.at(&format!("steps/{name}.vtu"))).unwrap()
    }

    fn history(&self) -> History {
        History::parse(&fs::read_to_string(self.at("history.csv")).unwrap()).unwrap()
    }

    /// The number of the view of the formed sheet on the page: the figures before it are plots.
    fn view(&self) -> String {
        let page = fs::read_to_string(self.at("report.html")).unwrap();
        let (_, rest) = page.split_once("<figure class=\"view\" id=\"").unwrap();
        rest.split_once('"').unwrap().0.to_owned()
    }
}

/// A line of the probe.
#[derive(Debug)]
struct Probe {
    part: String,
    value: Option<f64>,
    cell: usize,
    point: usize,
    point_value: Option<f64>,
    place: Vec3,
}

impl Probe {
    /// From, for example, `sheet; thickness [mm] 0.81; element 3; point 17: 0.80; (1.0, 2.0, 3.0) mm`.
    fn parse(text: &str, field: &str) -> Self {
        let words: Vec<&str> = text.split("; ").collect();
        let after = |start: &str| words.iter().find_map(|word| word.strip_prefix(start));
        let number =
            |text: &str| text.trim().parse::<f64>().unwrap_or_else(|e| panic!("{text}: {e}"));
        let cell = after("element ").or(after("patch ")).unwrap();
        let mut point = after("point ").unwrap().split(": ");
        let place = words.last().unwrap().trim_start_matches('(').trim_end_matches(") mm");
        let place: Vec<f64> = place.split(", ").map(number).collect();
        Self {
            part: words[0].to_owned(),
            value: after(field).map(number),
            cell: cell.parse().unwrap(),
            point: point.next().unwrap().parse().unwrap(),
            point_value: point.next().map(number),
            place: Vec3::new(place[0], place[1], place[2]),
        }
    }

    fn all(texts: &Value, field: &str) -> Vec<Self> {
        let all = texts.as_array().unwrap_or_else(|| panic!("{texts}"));
        all.iter().map(|text| Self::parse(text.as_str().unwrap(), field)).collect()
    }
}

fn array<'g>(grid: &'g Grid, name: &str) -> &'g [f64] {
    let mut all = grid.point_data.iter().chain(&grid.cell_data);
    &all.find(|a| a.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

/// Asserts that probes of the thickness have numbers, values and places of the grid; `error`: of the values on the page.
fn check_thickness(probes: &[Probe], grid: &Grid, error: f64) {
    let thickness = array(grid, "thickness_mm");
    assert!(probes.len() > 30, "{} probes", probes.len());
    for probe in probes {
        // Five digits.
        let near = |found: f64, exact: f64| (found - exact).abs() <= error + 5e-5 * exact.abs();
        let exact = thickness[probe.point];
        assert!(near(probe.point_value.unwrap(), exact), "{probe:?} {exact}");
        let nodes = &grid.cells[probe.cell].1;
        assert!(nodes[4..].contains(&(probe.point as u32)), "{probe:?} {nodes:?}");
        let corners = nodes[4..].iter().map(|&n| thickness[n as usize]);
        let (low, high) = corners.fold((f64::MAX, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
        let value = probe.value.unwrap();
        assert!(
            value > low - error - 5e-5 && value < high + error + 5e-5,
            "{probe:?} {low} {high}"
        );
        check_place(probe, grid);
    }
}

/// Asserts that a probe is at the element that it names; of a mirrored one y is negative.
fn check_place(probe: &Probe, grid: &Grid) {
    let nodes = &grid.cells[probe.cell].1;
    let mirrored = probe.part.ends_with("(mirrored)");
    // Places have three decimals.
    assert!(probe.place.y.abs() < 0.001 || mirrored == (probe.place.y < 0.0), "{probe:?}");
    let place = Vec3::new(probe.place.x, probe.place.y.abs(), probe.place.z);
    let corners = || nodes[4..].iter().map(|&n| grid.points[n as usize]);
    let low = corners().reduce(|a, b| a.inf(&b)).unwrap();
    let high = corners().reduce(|a, b| a.sup(&b)).unwrap();
    for k in 0..3 {
        let inside = place[k] > low[k] - 0.002 && place[k] < high[k] + 0.002;
        assert!(inside, "{probe:?} {low} {high}");
    }
}

const THICKNESS: &str = "thickness [mm] ";

#[test]
fn the_probe_reads_the_values_of_the_result_files() {
    let Some(browser) = chromium() else { return skipping::skip(CHROMIUM) };
    let run = Run::new();
    let script = format!(
        r#"
        const figure = await live("{}");
        const field = figure.querySelector("select.field");
        const step = figure.querySelector("input.step");
        const out = {{ end: probes(figure, 60, 40) }};
        change(field, "equivalent plastic strain", "change");
        out.plastic = probes(figure, 60, 40);
        change(field, "thickness [mm]", "change");
        change(step, 8, "input");
        press(figure.querySelector("canvas"), "f");
        await wait(100);
        out.name = figure.querySelector(".steps output").textContent;
        out.step = probes(figure, 60, 40);
        return out;"#,
        run.view()
    );
    let found = driven(&browser, &run.at("report.html"), &script);
    assert!(found.is_object(), "{found}");
    let last = run.grid("last");
    let end = Probe::all(&found["end"], THICKNESS);
    check_thickness(&end, &last, 0.0);
    assert!(
        end.iter().any(|p| p.part == "sheet (mirrored)") && end.iter().any(|p| p.part == "sheet")
    );
    let plastic = Probe::all(&found["plastic"], "equivalent plastic strain ");
    let exact = array(&last, "plastic_strain");
    assert_eq!(plastic.len(), end.len());
    for probe in &plastic {
        let (value, exact) = (probe.value.unwrap(), exact[probe.cell]);
        // Five digits; four where there is an exponent.
        let error = if exact < 1e-4 { 5e-4 * exact } else { 5e-5 * exact };
        assert!((value - exact).abs() <= error, "{probe:?} {exact}");
    }
    // An earlier step: values in 65534 steps of their range.
    let name = found["name"].as_str().unwrap();
    let increment = name.strip_prefix("increment ").unwrap().split(',').next().unwrap();
    let increment: usize = increment.parse().unwrap();
    let earlier = run.grid(&format!("{increment:06}"));
    let thickness = array(&earlier, "thickness_mm");
    let range = thickness.iter().fold(0.0_f64, |a, t| a.max((t - thickness[0]).abs()));
    check_thickness(&Probe::all(&found["step"], THICKNESS), &earlier, 2.0 * range / 65534.0);
}

#[test]
fn tools_move_with_the_steps_and_sections_cut() {
    let Some(browser) = chromium() else { return skipping::skip(CHROMIUM) };
    let run = Run::new();
    let script = format!(
        r#"
        const figure = await live("{}");
        const canvas = figure.querySelector("canvas");
        const [sheet, post, plane] = figure.querySelectorAll("select.part");
        const step = figure.querySelector("input.step");
        const settled = async () => {{ press(canvas, "f"); await wait(100); }};
        const out = {{}};
        change(sheet, "hidden", "change");
        change(plane, "shown", "change");
        await settled();
        out.toolAtEnd = probes(figure, 12, 12);
        change(step, 0, "input");
        await settled();
        out.toolAtStart = probes(figure, 12, 12);
        change(step, step.max, "input");
        change(sheet, "shown", "change");
        change(plane, "hidden", "change");
        await settled();
        out.whole = {{ ...pixels(figure), probes: probes(figure, 60, 40) }};
        press(canvas, "w");
        await wait(100);
        out.half = {{ ...pixels(figure), probes: probes(figure, 60, 40) }};
        press(canvas, "w");
        press(canvas, "e");
        await wait(100);
        out.edges = pixels(figure);
        press(canvas, "e");
        change(figure.querySelector("select.section"), "0", "change");
        change(figure.querySelector("input.cut"), 250, "input");
        await wait(100);
        out.at = figure.querySelector("input.cut + output").textContent;
        out.cut = {{ ...pixels(figure), probes: probes(figure, 60, 40) }};
        [...figure.querySelectorAll("button")].find((b) => b.textContent === "Other side").click();
        await wait(100);
        out.other = {{ ...pixels(figure), probes: probes(figure, 60, 40) }};
        change(figure.querySelector("select.section"), "", "change");
        change(figure.querySelector("input.limit0"), 0.5, "change");
        change(figure.querySelector("input.limit1"), 2.5, "change");
        await wait(100);
        out.limits = pixels(figure);
        out.key = [...figure.querySelectorAll(".key span")].map((one) => one.textContent);
        return out;"#,
        run.view()
    );
    let found = driven(&browser, &run.at("report.html"), &script);
    // The plane travels along -z; the whole tool is not mirrored.
    let history = run.history();
    let travel = history.rows.last().unwrap().travel_mm[1];
    let height = |what: &str| -> f64 {
        let probes = Probe::all(&found[what], THICKNESS);
        assert!(probes.len() > 10 && probes.iter().all(|p| p.part == "plane"), "{probes:?}");
        assert!(probes.iter().all(|p| (p.place.z - probes[0].place.z).abs() < 0.002));
        probes[0].place.z
    };
    assert!(travel.abs() > 0.5, "{travel}");
    let moved = height("toolAtStart") - height("toolAtEnd");
    assert!((moved - travel).abs() < 0.002, "{moved} {travel}");

    let [whole, half, cut, other] = ["whole", "half", "cut", "other"].map(|k| &found[k]);
    let count = |one: &Value| one["count"].as_u64().unwrap();
    let places = |one: &Value| Probe::all(&one["probes"], THICKNESS);
    assert!(places(half).iter().all(|p| p.part == "sheet" && p.place.y >= 0.0));
    assert!(count(half) < count(whole) && places(half).len() < places(whole).len());
    assert_ne!(found["edges"]["sum"], whole["sum"]);
    assert_ne!(found["limits"]["sum"], whole["sum"]);
    assert_eq!(found["key"], json!(["0.5", "1", "1.5", "2", "2.5"]));
    let at: f64 = found["at"].as_str().unwrap().trim_end_matches(" mm").parse().unwrap();
    let (below, above) = (places(cut), places(other));
    assert!(below.len() > 10 && below.iter().all(|p| p.place.x <= at + 0.01), "{below:?} {at}");
    assert!(above.len() > 10 && above.iter().all(|p| p.place.x >= at - 0.01), "{above:?} {at}");
    assert!(count(cut) < count(whole) && count(other) < count(whole));
}

#[test]
fn plots_show_their_values_on_hover() {
    let Some(browser) = chromium() else { return skipping::skip(CHROMIUM) };
    let run = Run::new();
    let script = r##"
        const svg = document.querySelector("#plot1 svg");
        const box = svg.getBoundingClientRect();
        const out = [];
        for (let k = 0; k < 40; k++) {
          for (let j = 0; j < 20; j++) {
            const [clientX, clientY] = [box.left + (box.width * (k + 0.5)) / 40, box.top + (box.height * (j + 0.5)) / 20];
            svg.dispatchEvent(new PointerEvent("pointermove", { clientX, clientY, bubbles: true }));
            const label = document.querySelector("#plot1 .hover");
            if (label) out.push(label.textContent);
          }
        }
        return out;"##;
    let found = driven(&browser, &run.at("report.html"), script);
    let history = run.history();
    let labels: Vec<&str> = found.as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect();
    assert!(labels.len() > 20, "{labels:?}");
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b.abs() + 1e-9;
    for label in labels {
        let (name, values) = label.split_once(": ").unwrap();
        let (_, y) = values.split_once(", ").unwrap();
        let tool = history.tools.iter().position(|tool| tool == name).unwrap();
        let y: f64 = y.parse().unwrap();
        assert!(history.rows.iter().any(|row| near(y, row.force_n[tool])), "{label}");
    }
}

/// The page as it is, with its policy: views run, and without WebGL they are pictures.
#[test]
fn views_run_under_the_policy_of_the_page_and_are_pictures_without_webgl() {
    let Some(browser) = chromium() else { return skipping::skip(CHROMIUM) };
    let run = Run::new();
    let page = run.at("report.html");
    let open = |more: &[&str]| document(&browser, &page, 6000, more);
    let live = |html: &str| html.matches("<figure class=\"view live\"").count();
    // The browser's clock may run ahead of its other threads on a busy machine.
    let with = (0..5).map(|_| open(&[])).find(|html| live(html) == 2).expect("two views");
    assert_eq!((live(&with), with.matches("<canvas").count()), (2, 2));
    let without = open(&["--disable-3d-apis"]);
    assert_eq!((live(&without), without.matches("<canvas").count()), (0, 0));
    assert_eq!(without.matches("src=\"data:image/png;base64,").count(), 2);
    assert!(Path::new(&page).metadata().unwrap().len() < 400_000);
}
