//! A body's history as bytes, for checkpoints.

use super::body::{Body, BodyError, Built};

impl Body {
    /// Bytes that [`Body::export_state`] takes for an element.
    #[must_use]
    pub fn state_bytes_an_element(&self) -> usize {
        let remembered =
            if self.material.history_layout().is_some() { 6 * self.kind.point_count() } else { 0 };
        8 * (self.stride() + remembered)
    }

    /// The committed history and what it was foreseen from, as bytes (little-endian 64-bit numbers), for checkpoints.
    #[must_use]
    pub fn export_state(&self) -> Vec<u8> {
        let Built { committed, before, .. } = self.built();
        committed.iter().chain(before).flat_map(|value| value.to_le_bytes()).collect()
    }

    /// Takes a history written by [`Body::export_state`]; the next evaluation repeats to the bit.
    ///
    /// # Errors
    /// [`BodyError::StateSize`] when the bytes belong to another model.
    pub fn import_state(&mut self, bytes: &[u8]) -> Result<(), BodyError> {
        let Built { committed, before, .. } = self.built_mut();
        let expected = 8 * (committed.len() + before.len());
        if bytes.len() != expected {
            return Err(BodyError::StateSize { found: bytes.len(), expected });
        }
        let all = committed.iter_mut().chain(before);
        for (value, chunk) in all.zip(bytes.chunks_exact(8)) {
            let mut raw = [0; 8];
            raw.copy_from_slice(chunk);
            *value = f64::from_le_bytes(raw);
        }
        self.restore();
        Ok(())
    }
}
