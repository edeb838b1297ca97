//! The chosen faces as the reference of an audit.

use std::collections::BTreeSet;

use super::chosen::Chosen;
use kanagata_audit::reference::{
    Border, BorderEdge, CadReference, ReferenceFoot, ReferenceSurface,
};
use kanagata_cad::health::OpenJoints;
use kanagata_cad::raw::LostFace;
use kanagata_geometry::Vec3;
use kanagata_tool::ToolModel;

/// The chosen faces of a model, with the numbers of the complete model. Faces that are not chosen are not there: a foot
/// point never lies on them, and the border between chosen and other faces is free.
pub struct ChosenReference<'m> {
    inner: CadReference<'m>,
    kept: &'m [usize],
}

impl<'m> ChosenReference<'m> {
    /// Builds the search structure over the chosen faces.
    #[must_use]
    pub fn new(chosen: &'m Chosen) -> Self {
        Self { inner: CadReference::new(&chosen.model), kept: &chosen.kept }
    }

    /// The chosen face closest to the centre of every patch.
    #[must_use]
    pub fn faces_of(&self, tool: &ToolModel) -> Vec<u32> {
        self.inner.faces_of(tool).into_iter().map(|face| self.whole(face)).collect()
    }

    /// Number of a chosen face in the complete model.
    fn whole(&self, face: u32) -> u32 {
        self.kept.get(face as usize).map_or(face, |&f| f as u32)
    }

    /// Number among the chosen faces; one beyond them for a face that is not chosen.
    fn own(&self, face: u32) -> u32 {
        self.kept.binary_search(&(face as usize)).map_or(u32::MAX, |k| k as u32)
    }

    fn own_faces(&self, faces: &BTreeSet<u32>) -> BTreeSet<u32> {
        faces.iter().map(|&f| self.own(f)).collect()
    }
}

impl ReferenceSurface for ChosenReference<'_> {
    fn closest(&self, p: &Vec3, face: u32) -> Option<ReferenceFoot> {
        let foot = self.inner.closest(p, self.own(face))?;
        Some(ReferenceFoot { face: self.whole(foot.face), ..foot })
    }

    fn lost_faces(&self) -> Vec<LostFace> {
        self.inner.lost_faces()
    }

    fn open_joints(&self, faces: &BTreeSet<u32>) -> Option<OpenJoints> {
        let found = self.inner.open_joints(&self.own_faces(faces))?;
        Some(OpenJoints { face: self.whole(found.face as u32) as usize, ..found })
    }

    fn border(&self, p: &Vec3, face: u32) -> Option<Border> {
        let found = self.inner.border(p, self.own(face))?;
        let beyond = found.beyond.iter().map(|&f| self.whole(f)).collect();
        Some(Border { beyond, ..found })
    }

    fn border_edges(&self, faces: &BTreeSet<u32>) -> Option<Vec<BorderEdge<'_>>> {
        let found = self.inner.border_edges(&self.own_faces(faces))?;
        Some(found.into_iter().map(|e| BorderEdge { face: self.whole(e.face), ..e }).collect())
    }

    fn continues(&self, p: &Vec3, own: u32, faces: &BTreeSet<u32>) -> bool {
        self.inner.continues(p, self.own(own), &self.own_faces(faces))
    }
}
