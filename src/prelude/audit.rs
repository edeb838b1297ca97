//! The shape error of a tool.

use super::cad::Cad;
use super::error::Error;
use super::tool::Tool;
use crate::audit::{Audit, AuditOptions, CadReference, audit, doubts};
use crate::convert::origin::origin;
use crate::convert::select::ChosenReference;

impl Tool {
    /// Shape error against the CAD from which the tool was made (Eq. 24): of the faces and the offset in its provenance.
    /// Against another file every patch is compared with the face nearest to it.
    ///
    /// # Errors
    /// [`super::ErrorKind::Input`] when nothing can be compared.
    pub fn audit(&self, cad: &Cad, options: &AuditOptions) -> Result<Audit, Error> {
        let is_same = self.provenance.cad_sha256 == cad.sha256;
        let chosen = origin(&self.provenance, &cad.model)?;
        let mut model = self.model.clone();
        let mut found = if let Some(chosen) = &chosen {
            let reference = ChosenReference::new(chosen);
            if !is_same {
                model.faces = reference.faces_of(&model);
            }
            audit(&model, &reference, options)?
        } else {
            let reference = CadReference::new(&cad.model);
            if !is_same {
                model.faces = reference.faces_of(&model);
            }
            audit(&model, &reference, options)?
        };
        found.report.doubts = doubts(&found.report);
        Ok(found)
    }
}
