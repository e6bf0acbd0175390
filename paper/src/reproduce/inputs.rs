//! The inputs of a computation, as `data/printed.toml` gives them.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use toml::Value;

/// What goes into a computation.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a>(pub &'a BTreeMap<String, Value>);

impl Inputs<'_> {
    /// A number.
    ///
    /// # Errors
    /// If it is missing.
    pub fn number(&self, name: &str) -> Result<f64> {
        self.0.get(name).and_then(number).with_context(|| format!("no number `{name}`"))
    }

    /// Several numbers.
    ///
    /// # Errors
    /// If one is missing.
    pub fn numbers(&self, name: &str) -> Result<Vec<f64>> {
        let list = self.0.get(name).and_then(Value::as_array).with_context(|| format!("no list `{name}`"))?;
        list.iter().map(|value| number(value).with_context(|| format!("`{name}` holds no numbers"))).collect()
    }

    /// A word.
    ///
    /// # Errors
    /// If it is missing.
    pub fn word(&self, name: &str) -> Result<&str> {
        self.0.get(name).and_then(Value::as_str).with_context(|| format!("no word `{name}`"))
    }
}

/// A value as a number, if it is one.
pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}
