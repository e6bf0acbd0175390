//! The inputs of a computation, as given in `data/printed.toml`.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use toml::Value;

/// The named inputs of a computation.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a>(pub &'a BTreeMap<String, Value>);

impl Inputs<'_> {
    /// The number named `name`.
    ///
    /// # Errors
    /// If it is missing or no number.
    pub fn number(&self, name: &str) -> Result<f64> {
        self.0.get(name).and_then(number).with_context(|| format!("no number `{name}`"))
    }

    /// The list of numbers named `name`.
    ///
    /// # Errors
    /// If it is missing or an element is no number.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>> {
        let list = self.0.get(name).and_then(Value::as_array).with_context(|| format!("no list `{name}`"))?;
        list.iter().map(|value| number(value).with_context(|| format!("`{name}` holds no numbers"))).collect()
    }

    /// The text named `name`.
    ///
    /// # Errors
    /// If it is missing or no text.
    pub fn word(&self, name: &str) -> Result<&str> {
        self.0.get(name).and_then(Value::as_str).with_context(|| format!("no word `{name}`"))
    }
}

/// A TOML value as a number; `None` if it is neither integer nor float.
pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}
