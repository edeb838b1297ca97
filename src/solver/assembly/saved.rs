//! History of a body as bytes, for checkpoints.

use super::body::{Body, BodyError, EvaluationData};

impl Body {
    /// Size of [`Body::export_state`] for one element [bytes].
    #[must_use]
    pub fn state_bytes_per_element(&self) -> usize {
        let strain_len =
            if self.material.history_layout().is_some() { 6 * self.kind.point_count() } else { 0 };
        8 * (self.stride() + strain_len)
    }

    /// Committed history and the strains needed for a prediction, as little-endian 64-bit numbers, for checkpoints.
    #[must_use]
    pub fn export_state(&self) -> Vec<u8> {
        let EvaluationData { committed, previous_strains, .. } = self.evaluation_data();
        committed.iter().chain(previous_strains).flat_map(|value| value.to_le_bytes()).collect()
    }

    /// Sets a history written by [`Body::export_state`]; the next evaluation is bit-identical.
    ///
    /// # Errors
    /// [`BodyError::StateSize`] if the bytes belong to another model.
    pub fn import_state(&mut self, bytes: &[u8]) -> Result<(), BodyError> {
        let EvaluationData { committed, previous_strains, .. } = self.evaluation_data_mut();
        let expected = 8 * (committed.len() + previous_strains.len());
        if bytes.len() != expected {
            return Err(BodyError::StateSize { found: bytes.len(), expected });
        }
        let all = committed.iter_mut().chain(previous_strains);
        for (value, chunk) in all.zip(bytes.chunks_exact(8)) {
            let mut raw = [0; 8];
            raw.copy_from_slice(chunk);
            *value = f64::from_le_bytes(raw);
        }
        self.restore();
        Ok(())
    }
}
