//! Drive of a tool during a stage.

use schemars::JsonSchema;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::course::Course;

/// Drive of a tool during a stage.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// Travel along its direction since the start of the run [mm].
    TravelMm(Course),
    /// Travel along its direction during this stage [mm].
    AdvanceMm(Course),
    /// Force on the sheet along its direction, of the whole process (all symmetric parts together) [N].
    ForceN(Course),
    /// Supported by a spring.
    Spring(Spring),
    /// Released (`true`). If another tool supports the sheet, the tool first retracts with the sheet over half of the
    /// stage while its force falls to a hundredth. The remaining forces fall to zero over the rest of the stage; then
    /// the tool is absent.
    Release(bool),
    /// Absent from this stage on, until a later stage drives it (`true`).
    Absent(bool),
}

/// A spring behind a tool, of the whole process. It pushes along the tool's direction with `force_n - stiffness_n_per_mm
/// * travel`. The travel is along that direction since the start of the run; a tool pushed back has a negative one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Stiffness [N/mm], > 0.
    pub stiffness_n_per_mm: f64,
    /// Force at zero travel [N]. It starts from the value that balances the tool's force at the start of the stage,
    /// unless an equal spring supports the tool already.
    #[serde(default)]
    pub force_n: Course,
}

/// Keys of the drives.
const DRIVE_KEYS: [&str; 6] = ["travel_mm", "advance_mm", "force_n", "spring", "release", "absent"];

impl<'de> Deserialize<'de> for Drive {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DriveVisitor)
    }
}

/// Visitor with specific error messages, which derived code does not have.
struct DriveVisitor;

impl<'de> Visitor<'de> for DriveVisitor {
    type Value = Drive;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "one way to drive a tool, as {{\"travel_mm\": 20}}: {}", DRIVE_KEYS.join(", "))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Drive, A::Error> {
        let mut map = map;
        let Some(key) = map.next_key::<String>()? else {
            return Err(de::Error::custom(format_args!(
                "no way to drive the tool, where one is wanted of {}; a tool that a stage does not name keeps its travel or its force",
                DRIVE_KEYS.join(", ")
            )));
        };
        let drive = match key.as_str() {
            "travel_mm" => Drive::TravelMm(map.next_value()?),
            "advance_mm" => Drive::AdvanceMm(map.next_value()?),
            "force_n" => Drive::ForceN(map.next_value()?),
            "spring" => Drive::Spring(map.next_value()?),
            "release" => Drive::Release(only_true(&key, map.next_value()?)?),
            "absent" => Drive::Absent(only_true(&key, map.next_value()?)?),
            _ => return Err(de::Error::unknown_variant(&key, &DRIVE_KEYS)),
        };
        match map.next_key::<String>()? {
            None => Ok(drive),
            Some(other) => Err(de::Error::custom(format_args!(
                "`{key}` and `{other}` for one tool, which is driven one way in a stage"
            ))),
        }
    }
}

/// Rejects `false`, which has no meaning.
fn only_true<E: de::Error>(key: &str, value: bool) -> Result<bool, E> {
    if value {
        return Ok(true);
    }
    Err(E::custom(format_args!(
        "`{key}`: false, which drives nothing; leave the tool out of `drive` and it keeps its travel or its force"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Drive, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    #[test]
    fn every_way_is_read_back_as_it_is_written() {
        let ways = [
            r#"{"travel_mm":[[0.5,3.0],[1.0,2.0]]}"#,
            r#"{"advance_mm":2.0}"#,
            r#"{"force_n":4.0}"#,
            r#"{"spring":{"stiffness_n_per_mm":3.0,"force_n":0.0}}"#,
            r#"{"release":true}"#,
            r#"{"absent":true}"#,
        ];
        for (text, key) in ways.into_iter().zip(DRIVE_KEYS) {
            assert!(text.contains(key));
            assert_eq!(serde_json::to_string(&read(text).unwrap()).unwrap(), text);
        }
    }

    #[test]
    fn invalid_drives_have_clear_messages() {
        for (text, expected) in [
            (r#"{"travel_mm":3,"force_n":4}"#, "`travel_mm` and `force_n` for one tool"),
            ("{}", "no way to drive the tool"),
            ("3", "one way to drive a tool"),
            ("null", "one way to drive a tool"),
            (r#"{"release":false}"#, "leave the tool out of `drive`"),
            (r#"{"absent":false}"#, "`absent`: false"),
            (r#"{"travl_mm":3}"#, "unknown variant `travl_mm`"),
            (r#"{"travel_mm":[[0.5]]}"#, ""),
        ] {
            let found = read(text).unwrap_err();
            assert!(found.contains(expected), "{text}: {found}");
        }
    }
}
