//! Access to the attributes of simple and complex instances by position.

use std::borrow::Cow;

use super::lexer::decode;
use super::table::{Part, Span, Table, Value};
use crate::{CadError, Diagnostic, Severity};

/// The reason why an entity cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{place}: {found}; allowed: {allowed}; {remedy}")]
pub struct Fault {
    /// `#45 (ADVANCED_FACE)`.
    pub place: String,
    /// What was found.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
    /// Remedy.
    pub remedy: &'static str,
    /// The entire file is rejected, not only this entity.
    pub fatal: bool,
}

/// Result of reading an entity.
pub type Outcome<T> = Result<T, Box<Fault>>;

impl Fault {
    /// Converts the fault to an error of the entire file.
    #[must_use]
    pub fn into_error(self, file: &str) -> CadError {
        let Self { place, found, allowed, remedy, .. } = self;
        CadError::Invalid { file: file.into(), place, found, allowed, remedy: remedy.into() }
    }

    /// Converts the fault to a diagnostic with the given code.
    #[must_use]
    pub fn into_diagnostic(self, code: &'static str) -> Diagnostic {
        let text = format!("{}; allowed: {}; {}", self.found, self.allowed, self.remedy);
        Diagnostic { severity: Severity::Warning, code, place: self.place, text }
    }
}

/// Supertypes with attributes, in the order of their attributes in a simple instance. Unlisted parts of a complex
/// instance are placed between both lists, in the order of the file.
const BEFORE: [&str; 15] = [
    "REPRESENTATION_ITEM",
    "REPRESENTATION",
    "REPRESENTATION_RELATIONSHIP",
    "EDGE",
    "FACE",
    "FACE_SURFACE",
    "CONNECTED_FACE_SET",
    "MANIFOLD_SOLID_BREP",
    "ELEMENTARY_SURFACE",
    "SWEPT_SURFACE",
    "B_SPLINE_CURVE",
    "B_SPLINE_SURFACE",
    "COMPOSITE_CURVE",
    "SURFACE_CURVE",
    "TOROIDAL_SURFACE",
];
const AFTER: [&str; 4] = [
    "B_SPLINE_CURVE_WITH_KNOTS",
    "B_SPLINE_SURFACE_WITH_KNOTS",
    "RATIONAL_B_SPLINE_CURVE",
    "RATIONAL_B_SPLINE_SURFACE",
];

/// Keywords that identify a complex instance, by precedence.
const IDENTIFYING: [&str; 28] = [
    "B_SPLINE_CURVE_WITH_KNOTS",
    "B_SPLINE_SURFACE_WITH_KNOTS",
    "BEZIER_CURVE",
    "BEZIER_SURFACE",
    "UNIFORM_CURVE",
    "UNIFORM_SURFACE",
    "QUASI_UNIFORM_CURVE",
    "QUASI_UNIFORM_SURFACE",
    "B_SPLINE_CURVE",
    "B_SPLINE_SURFACE",
    "SEAM_CURVE",
    "INTERSECTION_CURVE",
    "SURFACE_CURVE",
    "OUTER_BOUNDARY_CURVE",
    "BOUNDARY_CURVE",
    "COMPOSITE_CURVE_ON_SURFACE",
    "COMPOSITE_CURVE",
    "PCURVE",
    "CURVE_BOUNDED_SURFACE",
    "RECTANGULAR_TRIMMED_SURFACE",
    "BREP_WITH_VOIDS",
    "FACETED_BREP",
    "MANIFOLD_SOLID_BREP",
    "ADVANCED_FACE",
    "FACE_SURFACE",
    "EDGE_CURVE",
    "CONVERSION_BASED_UNIT",
    "SI_UNIT",
];

/// An instance.
#[derive(Clone, Copy)]
pub struct Entity<'t> {
    /// The table that contains it.
    pub table: &'t Table<'t>,
    /// Index in the table.
    pub index: u32,
}

impl<'t> Entity<'t> {
    /// Its parts.
    #[must_use]
    pub fn parts(&self) -> &'t [Part<'t>] {
        self.table.parts(self.index)
    }

    /// The identifying keyword.
    #[must_use]
    pub fn kind(&self) -> &'t str {
        match self.parts() {
            [] => "",
            [only] => only.keyword,
            parts => IDENTIFYING
                .iter()
                .find_map(|k| parts.iter().find(|p| p.keyword == *k))
                .or_else(|| parts.iter().find(|p| p.keyword.ends_with("SHAPE_REPRESENTATION")))
                .or_else(|| parts.iter().find(|p| self.table.values(p.values).len() > 1))
                .map_or("complex instance", |p| p.keyword),
        }
    }

    /// Name in the entity statistics: the keyword, or `(A+B+C)` for a complex instance.
    #[must_use]
    pub fn counted_as(&self) -> Cow<'t, str> {
        match self.parts() {
            [only] => Cow::Borrowed(only.keyword),
            parts => {
                let mut names: Vec<&str> = parts.iter().map(|p| p.keyword).collect();
                names.sort_unstable();
                Cow::Owned(format!("({})", names.join("+")))
            }
        }
    }

    /// `#45 (ADVANCED_FACE)`.
    #[must_use]
    pub fn place(&self) -> String {
        format!("#{} ({})", self.table.id(self.index), self.kind())
    }

    /// True when a part has this keyword.
    #[must_use]
    pub fn has(&self, keyword: &str) -> bool {
        self.parts().iter().any(|p| p.keyword == keyword)
    }

    /// Attributes of one part.
    #[must_use]
    pub fn part(&self, keyword: &str) -> Option<Attributes<'t>> {
        let part = self.parts().iter().find(|p| p.keyword == keyword)?;
        Some(Attributes { entity: *self, values: Cow::Borrowed(self.table.values(part.values)) })
    }

    /// All attributes in the order of a simple instance.
    #[must_use]
    pub fn attributes(&self) -> Attributes<'t> {
        let values = match self.parts() {
            [only] => Cow::Borrowed(self.table.values(only.values)),
            parts => {
                let rank = |part: &Part| {
                    let place = |list: &[&str]| list.iter().position(|k| *k == part.keyword);
                    place(&BEFORE).or_else(|| place(&AFTER).map(|k| k + 100)).unwrap_or(50)
                };
                let mut ordered: Vec<&Part> = parts.iter().collect();
                ordered.sort_by_key(|part| rank(part));
                let values = ordered.iter().flat_map(|p| self.table.values(p.values));
                Cow::Owned(values.copied().collect())
            }
        };
        Attributes { entity: *self, values }
    }

    /// A fault of this entity.
    #[must_use]
    pub fn fault(&self, found: impl Into<String>, allowed: impl Into<String>) -> Box<Fault> {
        Box::new(Fault {
            place: self.place(),
            found: found.into(),
            allowed: allowed.into(),
            remedy: "repair the model where it was made and export it again",
            fatal: false,
        })
    }
}

/// The attributes of an instance.
pub struct Attributes<'t> {
    entity: Entity<'t>,
    values: Cow<'t, [Value<'t>]>,
}

impl<'t> Attributes<'t> {
    /// Number of attributes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Attribute `k`; missing beyond the end of the instance.
    #[must_use]
    pub fn get(&self, k: usize) -> Value<'t> {
        self.values.get(k).copied().unwrap_or(Value::Missing)
    }

    fn wrong(&self, k: usize, allowed: &str) -> Box<Fault> {
        let found = match self.get(k) {
            Value::Missing => "nothing".into(),
            Value::List(span) => format!("a list of {}", self.entity.table.values(span).len()),
            Value::Reference(id) => match self.entity.table.find(id) {
                Some(_) => format!("#{id}"),
                None => format!("#{id}, which is not in the file"),
            },
            other => format!("{other:?}").chars().take(60).collect(),
        };
        self.entity.fault(format!("attribute {} is {found}", k + 1), allowed)
    }

    /// A number, also inside a typed value.
    ///
    /// # Errors
    /// The attribute is not a number.
    pub fn real(&self, k: usize) -> Outcome<f64> {
        number(self.entity.table, self.get(k)).ok_or_else(|| self.wrong(k, "a number"))
    }

    /// A whole number.
    ///
    /// # Errors
    /// The attribute is not a whole number.
    pub fn integer(&self, k: usize) -> Outcome<i64> {
        match self.get(k) {
            Value::Integer(n) => Ok(n),
            _ => Err(self.wrong(k, "a whole number")),
        }
    }

    /// `.T.` or `.F.`
    ///
    /// # Errors
    /// The attribute is neither.
    pub fn flag(&self, k: usize) -> Outcome<bool> {
        match self.get(k) {
            Value::Enumeration("T" | "TRUE") => Ok(true),
            Value::Enumeration("F" | "FALSE") => Ok(false),
            _ => Err(self.wrong(k, ".T. or .F.")),
        }
    }

    /// Name of an enumeration value, if it is one.
    #[must_use]
    pub fn enumeration(&self, k: usize) -> Option<&'t str> {
        match self.get(k) {
            Value::Enumeration(name) => Some(name),
            _ => None,
        }
    }

    /// A decoded string; empty for other values.
    #[must_use]
    pub fn text(&self, k: usize) -> String {
        match self.get(k) {
            Value::Text(raw) => decode(raw),
            _ => String::new(),
        }
    }

    /// A reference to an existing instance.
    ///
    /// # Errors
    /// The attribute is not such a reference.
    pub fn entity(&self, k: usize) -> Outcome<Entity<'t>> {
        self.referenced(self.get(k)).ok_or_else(|| self.wrong(k, "the id of an instance"))
    }

    fn referenced(&self, value: Value) -> Option<Entity<'t>> {
        let Value::Reference(id) = value else { return None };
        let table = self.entity.table;
        table.find(id).map(|index| Entity { table, index })
    }

    /// An optional reference: `None` for `$` and `*`.
    ///
    /// # Errors
    /// The attribute is anything else.
    pub fn maybe_entity(&self, k: usize) -> Outcome<Option<Entity<'t>>> {
        match self.get(k) {
            Value::Missing | Value::Derived => Ok(None),
            _ => self.entity(k).map(Some),
        }
    }

    /// The values of a list.
    ///
    /// # Errors
    /// The attribute is not a list.
    pub fn list(&self, k: usize) -> Outcome<&'t [Value<'t>]> {
        match self.get(k) {
            Value::List(span) => Ok(self.entity.table.values(span)),
            _ => Err(self.wrong(k, "a list")),
        }
    }

    /// A list of references.
    ///
    /// # Errors
    /// The attribute is not a list, or an instance does not exist.
    pub fn entities(&self, k: usize) -> Outcome<Vec<Entity<'t>>> {
        let refer = |value: &Value| {
            self.referenced(*value).ok_or_else(|| {
                let found = match value {
                    Value::Reference(id) => format!("#{id}, which is not in the file"),
                    other => format!("{other:?}").chars().take(60).collect(),
                };
                let found = format!("attribute {} lists {found}", k + 1);
                self.entity.fault(found, "ids of instances")
            })
        };
        self.list(k)?.iter().map(refer).collect()
    }

    /// A list of numbers.
    ///
    /// # Errors
    /// The attribute is not such a list.
    pub fn reals(&self, k: usize) -> Outcome<Vec<f64>> {
        self.numbers(self.list(k)?, k)
    }

    /// A list of lists of numbers.
    ///
    /// # Errors
    /// The attribute is not such a list.
    pub fn real_rows(&self, k: usize) -> Outcome<Vec<Vec<f64>>> {
        self.rows(k)?.iter().map(|row| self.numbers(row, k)).collect()
    }

    /// A list of lists of references.
    ///
    /// # Errors
    /// The attribute is not such a list.
    pub fn entity_rows(&self, k: usize) -> Outcome<Vec<Vec<Entity<'t>>>> {
        let refer =
            |v: &Value| self.referenced(*v).ok_or_else(|| self.wrong(k, "ids of instances"));
        self.rows(k)?.iter().map(|row| row.iter().map(refer).collect()).collect()
    }

    fn rows(&self, k: usize) -> Outcome<Vec<&'t [Value<'t>]>> {
        let row = |value: &Value<'t>| match value {
            Value::List(span) => Ok(self.entity.table.values(*span)),
            _ => Err(self.wrong(k, "a list of lists")),
        };
        self.list(k)?.iter().map(row).collect()
    }

    fn numbers(&self, values: &[Value], k: usize) -> Outcome<Vec<f64>> {
        let one = |v: &Value| number(self.entity.table, *v).ok_or_else(|| self.wrong(k, "numbers"));
        values.iter().map(one).collect()
    }
}

/// Numeric value, also of one enclosing typed value.
#[must_use]
pub fn number(table: &Table, value: Value) -> Option<f64> {
    match value {
        Value::Integer(n) => Some(n as f64),
        Value::Real(x) => Some(x),
        Value::Typed(part) => match typed(table, part).1 {
            [Value::Integer(n)] => Some(*n as f64),
            [Value::Real(x)] => Some(*x),
            _ => None,
        },
        _ => None,
    }
}

/// Keyword and values of a typed value.
#[must_use]
pub fn typed<'t>(table: &'t Table<'t>, part: u32) -> (&'t str, &'t [Value<'t>]) {
    let part = table.typed(part);
    let span = part.map_or(Span::default(), |p| p.values);
    (part.map_or("", |p| p.keyword), table.values(span))
}
