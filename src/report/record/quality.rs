//! Limits that the part must keep, and the doubts where it does not.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RunRecord;
use crate::doubt::{Doubt, DoubtCode, place_mm};

/// Limits of quality of the part. Each that is exceeded is a doubt, and the run ends with exit code 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Quality {
    /// Largest thinning: decrease of the thickness over the initial thickness, above 0 and below 1 (0.2 is 20 %).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_thinning: Option<f64>,
    /// Largest thickening: increase of the thickness over the initial thickness, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_thickening: Option<f64>,
    /// Smallest thickness [mm], above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_thickness_mm: Option<f64>,
    /// Smallest margin to the forming limit, at least 0 and below 1: 1 less the strain over the limit strain on the
    /// straight path. The material card must have a `forming_limit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flc_margin: Option<f64>,
    /// Largest displacement of a node in springback [mm], above 0. A stage must release all tools.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_springback_mm: Option<f64>,
}

/// Verdict on the quality of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum QualityVerdict {
    /// All limits of quality are kept.
    Kept,
    /// A limit of quality is exceeded.
    Exceeded,
    /// A part of the sheet is beyond the forming limit.
    Cracks,
}

impl fmt::Display for QualityVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kept => "kept",
            Self::Exceeded => "exceeded",
            Self::Cracks => "cracks",
        })
    }
}

impl RunRecord {
    /// Verdict on the part so far. `None` before the first equilibrium with tools, and for a part without a crack in a
    /// scene without limits of quality.
    #[must_use]
    pub fn quality_verdict(&self) -> Option<QualityVerdict> {
        self.formability.as_ref()?;
        if self.beyond_forming_limit().is_some() {
            return Some(QualityVerdict::Cracks);
        }
        self.quality?;
        let exceeded = !self.quality_doubts().is_empty();
        Some(if exceeded { QualityVerdict::Exceeded } else { QualityVerdict::Kept })
    }

    /// Doubts about the formability of the part and about its limits of quality.
    pub(super) fn quality_doubts(&self) -> Vec<Doubt> {
        let found = [
            self.beyond_forming_limit(),
            self.margin_too_small(),
            self.thinning_too_large(),
            self.thickening_too_large(),
            self.thickness_too_small(),
            self.springback_too_large(),
        ];
        found.into_iter().flatten().collect()
    }

    /// The warning of a verdict about strains whose path turned at the element concerned.
    fn path_warning(&self, turned: bool) -> String {
        let angle = self.formability.as_ref().map_or(0.0, |f| f.turned_paths.angle_deg);
        if turned {
            format!(
                " The strain path there turned by more than {angle:.0} degrees: the limit of a straight path holds less well."
            )
        } else {
            String::new()
        }
    }

    fn beyond_forming_limit(&self) -> Option<Doubt> {
        let formability = self.formability.as_ref()?;
        let worst = formability.margin.as_ref().filter(|worst| worst.margin < 0.0)?;
        let ratio = 1.0 - worst.margin;
        let share = 100.0 * formability.zones.crack.unwrap_or(0.0);
        Some(Doubt::of(
            DoubtCode::FormingLimitExceeded,
            format!("increment {}, {}", formability.increment, place_mm(&worst.at_mm)),
            [ratio, 1.0],
            format!(
                "The sheet cracks: {share:.2} % of its area is beyond the forming limit, worst at {} with {ratio:.2} times the limit strain (major {:.3}, limit {:.3} at minor {:.3}). Reduce the depth, the friction or the holder force, enlarge the radius there, or use a sheet with a higher limit.{}",
                place_mm(&worst.at_mm),
                worst.major,
                worst.limit_major,
                worst.minor,
                self.path_warning(worst.turned)
            ),
        ))
    }

    fn margin_too_small(&self) -> Option<Doubt> {
        let limit = self.quality?.flc_margin?;
        let worst = self.formability.as_ref()?.margin.as_ref()?;
        (worst.margin < limit).then(|| {
            Doubt::of(
                DoubtCode::FormingLimitMargin,
                place_mm(&worst.at_mm),
                [worst.margin, limit],
                format!(
                    "The margin to the forming limit is {:.3} at {} ({limit} required by `quality.flc_margin`): major strain {:.3}, limit {:.3} at minor strain {:.3}. Reduce the depth, the friction or the holder force, or enlarge the radius there.{}",
                    worst.margin,
                    place_mm(&worst.at_mm),
                    worst.major,
                    worst.limit_major,
                    worst.minor,
                    self.path_warning(worst.turned)
                ),
            )
        })
    }

    fn thinning_too_large(&self) -> Option<Doubt> {
        let limit = self.quality?.max_thinning?;
        let worst = &self.formability.as_ref()?.thinning;
        (0.01 * worst.percent > limit).then(|| {
            Doubt::of(
                DoubtCode::ThinningExceeded,
                place_mm(&worst.at_mm),
                [0.01 * worst.percent, limit],
                format!(
                    "The sheet thins by {:.1} % of the initial thickness at {} ({:.1} % allowed by `quality.max_thinning`). Reduce the friction or the holder force, or enlarge the radius there.",
                    worst.percent,
                    place_mm(&worst.at_mm),
                    100.0 * limit
                ),
            )
        })
    }

    fn thickening_too_large(&self) -> Option<Doubt> {
        let limit = self.quality?.max_thickening?;
        let worst = &self.formability.as_ref()?.thickening;
        (-0.01 * worst.percent > limit).then(|| {
            Doubt::of(
                DoubtCode::ThickeningExceeded,
                place_mm(&worst.at_mm),
                [-0.01 * worst.percent, limit],
                format!(
                    "The sheet thickens by {:.1} % of the initial thickness at {} ({:.1} % allowed by `quality.max_thickening`). Reduce the blank there, or raise the holder force.",
                    -worst.percent,
                    place_mm(&worst.at_mm),
                    100.0 * limit
                ),
            )
        })
    }

    fn thickness_too_small(&self) -> Option<Doubt> {
        let limit = self.quality?.min_thickness_mm?;
        let worst = self.thickness.as_ref()?;
        (worst.minimum_mm < limit).then(|| {
            Doubt::of(
                DoubtCode::ThicknessTooSmall,
                place_mm(&worst.at_mm),
                [worst.minimum_mm, limit],
                format!(
                    "The thickness is {:.4} mm at {} ({limit} mm required by `quality.min_thickness_mm`). Use a thicker blank, or reduce the friction or the holder force.",
                    worst.minimum_mm,
                    place_mm(&worst.at_mm)
                ),
            )
        })
    }

    fn springback_too_large(&self) -> Option<Doubt> {
        let limit = self.quality?.max_springback_mm?;
        let found = self.springback.as_ref()?;
        (found.largest_mm > limit).then(|| {
            Doubt::of(
                DoubtCode::SpringbackExceeded,
                String::new(),
                [found.largest_mm, limit],
                format!(
                    "Springback displaces the sheet by up to {:.3} mm ({limit} mm allowed by `quality.max_springback_mm`). Stretch the sheet more (holder force, beads), or compensate the tools.",
                    found.largest_mm
                ),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{
        FormabilityRecord, LimitMarginRecord, SpringbackRecord, ThicknessRecord, ThinningRecord,
        TurnedPathsRecord, ZoneShares,
    };

    /// Thinning by 21 %, thickening by 6 % and a margin to the limit.
    fn formability(margin: f64) -> FormabilityRecord {
        let thinning = |percent| ThinningRecord { percent, element: 3, at_mm: [1.0, 2.0, 3.0] };
        FormabilityRecord {
            increment: 7,
            area_mm2: 100.0,
            thinning: thinning(21.0),
            thickening: thinning(-6.0),
            margin: Some(LimitMarginRecord {
                margin,
                major: 0.3,
                minor: 0.0,
                limit_major: 0.31,
                element: 3,
                at_mm: [1.0, 2.0, 3.0],
                turned: true,
            }),
            zones: ZoneShares { crack: Some(0.02), ..ZoneShares::default() },
            turned_paths: TurnedPathsRecord {
                angle_deg: 30.0,
                elements: 1,
                share: 0.01,
                largest_deg: 40.0,
            },
            limit_curve: Vec::new(),
        }
    }

    /// A part with a margin to the limit, thinned by 21 % and thickened by 6 %, 0.79 mm thick, with 1.5 mm of springback.
    fn part(margin: f64) -> RunRecord {
        RunRecord {
            formability: Some(formability(margin)),
            thickness: Some(ThicknessRecord {
                minimum_mm: 0.79,
                initial_mm: 1.0,
                at_mm: [0.0; 3],
                maximum_mm: 1.06,
            }),
            springback: Some(SpringbackRecord {
                largest_mm: 1.5,
                rms_mm: 1.0,
                force_n: 1.0,
                energy_nmm: 1.0,
                from_increment: None,
                normal_max: None,
                normal_min: None,
            }),
            ..RunRecord::default()
        }
    }

    fn codes(record: &RunRecord) -> Vec<&'static str> {
        record.quality_doubts().iter().map(|doubt| doubt.code.as_str()).collect()
    }

    #[test]
    fn each_limit_that_is_exceeded_is_a_doubt_and_the_others_are_not() {
        let mut record = part(0.05);
        assert!(codes(&record).is_empty());
        let strict = Quality {
            max_thinning: Some(0.2),
            max_thickening: Some(0.05),
            min_thickness_mm: Some(0.8),
            flc_margin: Some(0.1),
            max_springback_mm: Some(1.0),
        };
        record.quality = Some(strict);
        let all = [
            "forming-limit-margin",
            "thinning-exceeded",
            "thickening-exceeded",
            "thickness-too-small",
            "springback-exceeded",
        ];
        assert_eq!(codes(&record), all);
        assert_eq!(record.quality_verdict(), Some(QualityVerdict::Exceeded));
        let text = record.quality_doubts()[1].to_string();
        assert!(text.contains("thins by 21.0 %") && text.contains("(20.0 % allowed"), "{text}");
        record.quality = Some(Quality {
            max_thinning: Some(0.22),
            max_thickening: Some(0.07),
            min_thickness_mm: Some(0.78),
            flc_margin: Some(0.04),
            max_springback_mm: Some(1.6),
        });
        assert!(codes(&record).is_empty());
        assert_eq!(record.quality_verdict(), Some(QualityVerdict::Kept));
        assert_eq!(part(0.05).quality_verdict(), None);
        for (key, code) in [
            (Quality { max_thinning: strict.max_thinning, ..Quality::default() }, all[1]),
            (Quality { max_springback_mm: Some(1.0), ..Quality::default() }, all[4]),
        ] {
            record.quality = Some(key);
            assert_eq!(codes(&record), [code]);
        }
    }

    #[test]
    fn a_crack_is_a_doubt_without_any_limit_and_names_the_turned_path() {
        let record = part(-0.1);
        assert_eq!(codes(&record), ["forming-limit-exceeded"]);
        assert_eq!(record.quality_verdict(), Some(QualityVerdict::Cracks));
        let doubt = &record.quality_doubts()[0];
        assert!((doubt.value.unwrap() - 1.1).abs() < 1e-12 && doubt.limit == Some(1.0));
        assert!(doubt.text.contains("2.00 % of its area"), "{}", doubt.text);
        assert!(doubt.text.contains("turned by more than 30 degrees"), "{}", doubt.text);
    }
}
