//! The branches of the law of Bogacz and Ryczek, from the table "Reading" of `docs/paper-law.md`.

use serde_json::Value;

use crate::law::Table;

/// Its lines.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// The document.
    pub document: Value,
    /// α(f_s).
    pub alpha: Table,
}

impl Geometry {
    /// From its document.
    pub fn read(document: &Value, alpha: Table) -> Option<Self> {
        Some(Self {
            document: document.clone(),
            alpha,
        })
    }
}
