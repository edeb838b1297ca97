//! A scene: blank, material, tools, stages.

use std::path::{Path, PathBuf};

use super::error::{Error, ErrorKind};
use super::run::{Run, RunProgress};
use crate::run::advice::{Finding, advice};
use crate::run::cost::{Cost, estimate};
use crate::run::folder::row;
use crate::run::{RunOptions, run};
use crate::scene::Plan;
use crate::scene::preview::SheetCounts;
use crate::scene::read::{read_text_with, read_with};
use crate::scene::set_value::SetValue;

/// A scene file with its tools and material, ready to run.
///
/// ```
/// use kanagata::prelude::Scene;
///
/// let scene = Scene::read_with("examples/strip/strip.scene.json", &["tools.die.friction=0.05"])?;
/// let check = scene.check()?;
/// assert!(check.cost.memory_mb > 0.0);
/// # Ok::<(), kanagata::prelude::Error>(())
/// ```
#[derive(Clone)]
pub struct Scene {
    plan: Plan,
    path: PathBuf,
    set: Vec<SetValue>,
    is_file: bool,
}

/// What a check of a scene finds.
#[derive(Debug, Clone)]
pub struct Check {
    /// Errors, doubts and notes, the most severe and effective first.
    pub findings: Vec<Finding>,
    /// Estimated size and time of a run.
    pub cost: Cost,
}

impl Scene {
    /// Reads and checks a scene and the files that it names.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] for files that cannot be read, [`ErrorKind::Input`] with the key, what was found and what is allowed.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_with(path, &[])
    }

    /// As [`Self::read`], with values set: keys, names of tools or indices joined by dots, as `tools.die.friction=0.08`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_with(path: impl AsRef<Path>, set: &[&str]) -> Result<Self, Error> {
        let path = path.as_ref().to_path_buf();
        let set = values_set(set)?;
        Ok(Self { plan: read_with(&path, &set)?, path, set, is_file: true })
    }

    /// A scene from memory: its JSON text. The files that it names are relative to `folder`; nothing is written there.
    ///
    /// ```
    /// use kanagata::prelude::Scene;
    ///
    /// let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/strip/strip.scene.json"));
    /// let scene = Scene::of_text(text, "examples/strip", &["tools.die.friction=0.05"])?;
    /// assert_eq!(scene.values().tools[0].friction, Some(0.05));
    /// # Ok::<(), kanagata::prelude::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::read`]; messages name the scene `<memory>`.
    pub fn of_text(text: &str, folder: impl AsRef<Path>, set: &[&str]) -> Result<Self, Error> {
        let path = folder.as_ref().join("<memory>");
        let set = values_set(set)?;
        let plan = read_text_with(text.as_bytes(), &path, &set)?;
        Ok(Self { plan, path, set, is_file: false })
    }

    /// The scene file.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for a scene from memory.
    pub(super) fn file(&self) -> Result<&Path, Error> {
        let in_memory = "the scene is in memory; allowed: a scene file, which every run of a sequence reads; write it to a file first";
        if self.is_file { Ok(&self.path) } else { Err(Error::input(in_memory)) }
    }

    /// The values that are set.
    pub(super) fn set(&self) -> &[SetValue] {
        &self.set
    }

    /// Name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.plan.scene.name
    }

    /// Names of the tools.
    #[must_use]
    pub fn tools(&self) -> Vec<String> {
        self.plan.scene.tools.iter().map(|tool| tool.name.clone()).collect()
    }

    /// The scene with its defaults, in the form of the scene file.
    #[must_use]
    pub fn values(&self) -> &crate::scene::Scene {
        &self.plan.scene
    }

    /// Findings about the scene and the cost of a run.
    ///
    /// # Errors
    /// [`ErrorKind::Input`] for a scene that cannot be set up.
    pub fn check(&self) -> Result<Check, Error> {
        let mut setup = self.plan.simulation_setup(&self.path)?;
        setup.place().map_err(|cause| Error::new(ErrorKind::Input, cause))?;
        let cost = estimate(&setup, &SheetCounts::of_mesh(setup.body.mesh()));
        Ok(Check { findings: advice(&self.plan, &setup, 1.0, &cost), cost })
    }

    /// Runs the scene into `folder` and calls `watch` after every increment. The folder is readable at any time.
    ///
    /// A run that does not converge is an error; its folder keeps what was computed.
    ///
    /// # Errors
    /// [`ErrorKind::NoConvergence`], [`ErrorKind::Stopped`] after a stop request of `options`, [`ErrorKind::Input`] for a scene
    /// that cannot be run and a folder that may not be replaced, [`ErrorKind::Io`].
    pub fn run(
        &self,
        folder: impl AsRef<Path>,
        options: &RunOptions<'_>,
        watch: &mut dyn FnMut(&RunProgress),
    ) -> Result<Run, Error> {
        run(&self.plan, &self.path, folder.as_ref(), options, &mut |progress| {
            watch(&RunProgress {
                row: row(progress.report),
                done: progress.done,
                elapsed_s: progress.elapsed_s,
            });
        })?;
        Run::open(folder)
    }
}

/// Parses values that are set.
pub(super) fn values_set(set: &[&str]) -> Result<Vec<SetValue>, Error> {
    set.iter().map(|text| text.parse()).collect::<Result<_, _>>().map_err(Error::input)
}
