//! The text of a proposed scene: JSON with comments in keys that begin with `_comment`.

use std::fmt::Write as _;

use super::blank::Outline;
use super::layout::{Layout, PlacedTool, TravelFrom};
use super::roles::Role;
use super::symmetry::Cut;

/// Friction of lubricated sheet steel.
const FRICTION: f64 = 0.1;

impl Layout {
    /// The scene as a JSON file.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::from("{\n  \"format\": \"kanagata-scene\",\n  \"version\": 1,\n");
        let _ = writeln!(out, "  \"name\": {},", quoted(&self.name));
        comment(
            &mut out,
            1,
            "",
            "Lengths in mm, forces in N, stresses in MPa. Forces are those of the whole process, also where a part of the sheet is modelled.",
        );
        self.blank(&mut out);
        comment(
            &mut out,
            1,
            "_material",
            "A card of the library, or a path ending in .json: a card of your own.",
        );
        let _ = writeln!(out, "  \"material\": {},", quoted(&self.material));
        self.supports(&mut out);
        self.tools(&mut out);
        self.stages(&mut out);
        self.output(&mut out);
        out
    }

    /// Steps and sections: at the symmetry planes, or along the middle of a strip.
    fn output(&self, out: &mut String) {
        let section = |axis: usize, at: f64| {
            let axis = ["x", "y"][axis];
            format!("{{ \"normal\": \"{axis}\", \"at_mm\": {} }}", number(at))
        };
        let sections: Vec<String> = match self.outline {
            Outline::Rectangle { corner, size, .. } if self.plane_strain => {
                vec![section(1, corner[1] + 0.5 * size[1])]
            }
            _ => self.cuts.iter().map(|cut| section(cut.axis, cut.at)).collect(),
        };
        if sections.is_empty() {
            out.push_str("  \"output\": { \"vtu_every\": 5 }\n}\n");
            return;
        }
        comment(
            out,
            1,
            "_output",
            "Sections give angles and curl of walls before and after springback.",
        );
        let all = sections.join(", ");
        let _ = writeln!(out, "  \"output\": {{ \"vtu_every\": 5, \"sections\": [{all}] }}\n}}");
    }

    fn blank(&self, out: &mut String) {
        out.push_str("  \"blank\": {\n");
        comment(
            out,
            2,
            "",
            "The lower face lies at z = 0. Outline and elements are proposals: the check of the scene says where elements are too long for a radius.",
        );
        let shape = match self.outline {
            Outline::Rectangle { corner, size, elements } => format!(
                "\"rectangle\": {{ \"corner_mm\": [{}, {}], \"size_mm\": [{}, {}], \"elements\": [{}, {}] }}",
                number(corner[0]),
                number(corner[1]),
                number(size[0]),
                number(size[1]),
                elements[0],
                elements[1]
            ),
            Outline::QuarterDisc { radius, core, rings } => format!(
                "\"quarter_disc\": {{ \"radius_mm\": {}, \"core\": {core}, \"rings\": {rings} }}",
                number(radius)
            ),
            Outline::Disc { radius, core, rings } => format!(
                "\"disc\": {{ \"radius_mm\": {}, \"core\": {core}, \"rings\": {rings} }}",
                number(radius)
            ),
        };
        let _ = writeln!(out, "    \"shape\": {{ {shape} }},");
        let _ = writeln!(out, "    \"thickness_mm\": {},", number(self.thickness));
        comment(out, 2, "_element", "One layer of solid-shells bends and springs back.");
        out.push_str("    \"element\": \"solid-shell\"\n  },\n");
    }

    fn supports(&self, out: &mut String) {
        if !self.cuts.is_empty() {
            comment(
                out,
                1,
                "_symmetry",
                "The blank ends at these planes, and the tools are symmetric about them. Remove them, and model the whole blank, if the part is not symmetric.",
            );
            let plane = |cut: &Cut| {
                let axis = ["x", "y"][cut.axis];
                format!("{{ \"normal\": \"{axis}\", \"at_mm\": {} }}", number(cut.at))
            };
            let planes: Vec<String> = self.cuts.iter().map(plane).collect();
            let _ = writeln!(out, "  \"symmetry\": [{}],", planes.join(", "));
        }
        if self.plane_strain {
            comment(out, 1, "_holds", "Plane strain: no node moves along y.");
            out.push_str("  \"holds\": [{ \"where\": { \"all\": true }, \"axes\": [\"y\"] }],\n");
        }
    }

    fn tools(&self, out: &mut String) {
        comment(
            out,
            1,
            "_tools",
            "`direction` points from the tool to the sheet. Each tool is moved along it until it touches the sheet. `friction` is that of lubricated steel: give your own.",
        );
        if self.tools.iter().any(|tool| tool.cad.is_some()) {
            comment(
                out,
                1,
                "_cad",
                "`cad` is the CAD from which the tool file is made, within the shape error `tol_mm`.",
            );
        }
        out.push_str("  \"tools\": [\n");
        let line = |tool: &PlacedTool| {
            // Serialisation of texts and numbers does not fail.
            let cad = tool.cad.as_ref().map(|cad| serde_json::to_string(cad).unwrap_or_default());
            let cad = cad.map_or_else(String::new, |cad| format!(",\n      \"cad\": {cad}"));
            format!(
                "    {{ \"name\": {}, \"file\": {}, \"direction\": [0, 0, {}], \"friction\": {FRICTION}{cad} }}",
                quoted(&tool.name),
                quoted(&tool.file),
                if tool.below { 1 } else { -1 }
            )
        };
        let lines: Vec<String> = self.tools.iter().map(line).collect();
        let _ = writeln!(out, "{}\n  ],", lines.join(",\n"));
    }

    /// Where force and travel come from, and what has no drive.
    fn comments_of_stages(&self, out: &mut String, has_holder: bool) {
        if has_holder {
            comment(
                out,
                1,
                "_stages",
                "The force of the holder is a pressure of 2 MPa on the blank outside the punch, usual for mild steel; aluminium takes about half of it.",
            );
        }
        let from = match self.travel.1 {
            TravelFrom::Closing => {
                "The travel of the punch is that at which the tools close on the sheet."
            }
            TravelFrom::Height => {
                "The die is open below the punch, so the travel is half of the punch's height. Give your own."
            }
            TravelFrom::Template => "Give the travel of your punch.",
        };
        comment(out, 1, "_travel", from);
        let idle: Vec<&str> = self.idle().collect();
        if !idle.is_empty() {
            let text = format!(
                "Without a drive, standing where they touch the sheet: {}. Give each a drive.",
                idle.join(", ")
            );
            comment(out, 1, "_idle", &text);
        }
    }

    fn stages(&self, out: &mut String) {
        let named = |role: Role| self.tools.iter().find(|tool| tool.role == role);
        let holder = named(Role::Holder);
        let force = holder.map(|holder| {
            format!("{}: {{ \"force_n\": {} }}", quoted(&holder.name), number(self.holder_force))
        });
        self.comments_of_stages(out, force.is_some());
        out.push_str("  \"stages\": [\n");
        if let Some(force) = &force {
            let _ = writeln!(out, "    {{ \"name\": \"clamp\", \"drive\": {{ {force} }} }},");
        }
        let punch = named(Role::Punch).map(|punch| {
            format!("{}: {{ \"travel_mm\": {} }}", quoted(&punch.name), number(self.travel.0))
        });
        let drives: Vec<String> = force.into_iter().chain(punch).collect();
        let _ =
            writeln!(out, "    {{ \"name\": \"draw\", \"drive\": {{ {} }} }},", drives.join(", "));
        let release =
            |tool: &PlacedTool| format!("{}: {{ \"release\": true }}", quoted(&tool.name));
        let all: Vec<String> = self.tools.iter().map(release).collect();
        let _ = writeln!(
            out,
            "    {{ \"name\": \"springback\", \"drive\": {{ {} }} }}\n  ],",
            all.join(", ")
        );
    }
}

/// A comment as a member of an object that is open at `depth`.
fn comment(out: &mut String, depth: usize, name: &str, text: &str) {
    let _ = writeln!(out, "{:1$}\"_comment{name}\": {2},", "", 2 * depth, quoted(text));
}

fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A number without digits that are rounding.
fn number(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded == 0.0 { 0.0 } else { rounded }
}
