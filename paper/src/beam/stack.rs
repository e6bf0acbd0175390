//! The layers of the spring, bottom to top, all clamped at the same end.

use anyhow::{Context, Result};

use simulation::bad_input;
use simulation::bad_input::check;
use simulation::csv_table::Table;

/// The report's Table 2, as printed.
pub const TABLE2: &str = include_str!("../../../data/table2_layers.csv");
/// Order of the layers in the report's spring: covers outside, the two electrodes around the active and the insulating
/// layer.
pub const ORDER: &str = "PET,aluminium,PVdF,nylon,aluminium,PET";
/// Material of the active layer, which a voltage stiffens.
pub const ACTIVE: &str = "PVdF";
/// Young's modulus of the active layer over the voltage (section 4.1.2), as printed.
const ACTIVE_LAW: &str = include_str!("../../../data/section412_active_layer.csv");

/// Largest number of layers; more would take minutes and gigabytes to bend.
const MOST_LAYERS: usize = 20;

/// A layer of the stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Name of its material.
    pub material: String,
    /// Young's modulus, in Pa.
    pub youngs_modulus_pa: f64,
    /// Length from the clamp, in m.
    pub length_m: f64,
    /// Width, in m.
    pub width_m: f64,
    /// Thickness, in m.
    pub thickness_m: f64,
}

/// Layers on top of each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Stack {
    layers: Vec<Layer>,
}

/// A kind of layer, as a table lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// Name of its material.
    pub material: String,
    /// Young's modulus, in GPa.
    pub youngs_modulus_gpa: f64,
    /// Length, in mm.
    pub length_mm: f64,
    /// Width, in mm.
    pub width_mm: f64,
    /// Thickness of one layer, in um.
    pub thickness_um: f64,
    /// Number of layers of this kind.
    pub count: usize,
}

/// Parses the kinds of layers from CSV text; `name` is what messages call the table.
///
/// # Errors
/// [`simulation::bad_input::BadInput`] with file, line, column and what was expected.
pub fn kinds(name: &str, text: &str) -> Result<Vec<Kind>> {
    const COLUMNS: [&str; 6] = ["material", "youngs_modulus_gpa", "length_mm", "width_mm", "thickness_um", "count"];
    let mut table = Table::new(name, text)?;
    let mut at = [0; 6];
    for (place, column) in at.iter_mut().zip(COLUMNS) {
        *place = table.require(column, &COLUMNS.join(", "))?;
    }
    let [material, youngs_modulus, length, width, thickness, count] = at;
    let mut kinds = Vec::new();
    while let Some(row) = table.next_row()? {
        kinds.push(Kind {
            material: row.text(material).to_owned(),
            youngs_modulus_gpa: row.number(youngs_modulus)?,
            length_mm: row.number(length)?,
            width_mm: row.number(width)?,
            thickness_um: row.number(thickness)?,
            count: row.whole(count)?,
        });
    }
    if kinds.is_empty() {
        bad_input!("{name}: 0 rows of data; expected one a kind of layer");
    }
    Ok(kinds)
}

impl Layer {
    /// Axial stiffness `E A`, in N.
    pub fn axial_n(&self) -> f64 {
        self.youngs_modulus_pa * self.width_m * self.thickness_m
    }

    /// Bending stiffness about the layer's own midplane, in N m2.
    pub fn bending_n_m2(&self) -> f64 {
        self.axial_n() * self.thickness_m * self.thickness_m / 12.0
    }
}

impl Stack {
    /// Creates a stack from layers, bottom to top. The first must be the longest, since it carries the load to the
    /// clamp.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] names layer and field.
    pub fn new(layers: Vec<Layer>) -> Result<Self> {
        let Some(first) = layers.first() else { bad_input!("the stack has no layers; expected at least one") };
        if layers.len() > MOST_LAYERS {
            bad_input!("the stack has {} layers; expected at most {MOST_LAYERS}", layers.len());
        }
        for (index, layer) in layers.iter().enumerate() {
            let field = |name: &str| format!("layer {} ({}): {name}", index + 1, layer.material);
            check(&field("youngs_modulus_pa"), layer.youngs_modulus_pa, 1.0..=1e14, "Pa")?;
            check(&field("length_m"), layer.length_m, 1e-6..=100.0, "m")?;
            check(&field("width_m"), layer.width_m, 1e-6..=100.0, "m")?;
            check(&field("thickness_m"), layer.thickness_m, 1e-9..=10.0, "m")?;
            check(&field("length_m"), layer.length_m, 1e-6..=first.length_m, "m, the length of the first layer")?;
        }
        Ok(Self { layers })
    }

    /// Creates a stack from the kinds in the order of a list such as [`ORDER`].
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] for an unknown layer, and for one listed more or less often than its kind's
    /// count.
    pub fn in_order(kinds: &[Kind], order: &str) -> Result<Self> {
        let names: Vec<&str> = order.split(',').map(str::trim).collect();
        for kind in kinds {
            let listed = names.iter().filter(|name| **name == kind.material).count();
            if listed != kind.count {
                bad_input!(
                    "--stack: {listed} layer(s) of {}; expected {}, as among the layers",
                    kind.material,
                    kind.count
                );
            }
        }
        let layer = |name: &&str| match kinds.iter().find(|kind| kind.material == **name) {
            Some(kind) => Ok(Layer {
                material: kind.material.clone(),
                youngs_modulus_pa: 1e9 * kind.youngs_modulus_gpa,
                length_m: 1e-3 * kind.length_mm,
                width_m: 1e-3 * kind.width_mm,
                thickness_m: 1e-6 * kind.thickness_um,
            }),
            None => {
                let known: Vec<&str> = kinds.iter().map(|kind| kind.material.as_str()).collect();
                bad_input!("--stack: `{name}` is not among the layers; expected {}", known.join(", "))
            }
        };
        Self::new(names.iter().map(layer).collect::<Result<_>>()?)
    }

    /// The report's spring: Table 2 in the order [`ORDER`].
    ///
    /// # Errors
    /// If the built-in data file is damaged.
    pub fn paper() -> Result<Self> {
        Self::in_order(&kinds("data/table2_layers.csv", TABLE2)?, ORDER)
    }

    /// The layers, bottom to top.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Free length, in m.
    pub fn length_m(&self) -> f64 {
        self.layers[0].length_m
    }

    /// Total thickness, in m.
    pub fn thickness_m(&self) -> f64 {
        self.layers.iter().map(|layer| layer.thickness_m).sum()
    }

    /// Height of each layer's midplane above the bottom of the stack, in m.
    pub fn heights_m(&self) -> Vec<f64> {
        let tops = self.layers.iter().scan(0.0, |top, layer| {
            *top += layer.thickness_m;
            Some(*top)
        });
        tops.zip(&self.layers).map(|(top, layer)| top - 0.5 * layer.thickness_m).collect()
    }

    /// The stack with Young's modulus `pascal` (Pa) in every layer of a material.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if no layer has that material.
    pub fn with_modulus(&self, material: &str, pascal: f64) -> Result<Self> {
        if !self.layers.iter().any(|layer| layer.material == material) {
            bad_input!("the stack has no layer of `{material}`, the active one");
        }
        let layers = self.layers.iter().map(|layer| {
            let same = layer.material == material;
            Layer { youngs_modulus_pa: if same { pascal } else { layer.youngs_modulus_pa }, ..layer.clone() }
        });
        Self::new(layers.collect())
    }
}

/// Young's modulus of the active layer, in Pa, at a voltage in V: linear between the report's values and beyond the
/// last.
///
/// # Errors
/// If the built-in data file is damaged.
pub fn active_modulus_pa(voltage_v: f64) -> Result<f64> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(ACTIVE_LAW.as_bytes());
    let points: Vec<(f64, f64)> =
        reader.deserialize().collect::<Result<_, _>>().context("data/section412_active_layer.csv")?;
    let pair = points.windows(2).find(|pair| voltage_v <= pair[1].0).or_else(|| points.windows(2).last());
    let [(from_v, from), (to_v, to)] = *pair.context("data/section412_active_layer.csv: two rows")? else {
        unreachable!("windows of two")
    };
    Ok(1e9 * (from + (to - from) * (voltage_v - from_v) / (to_v - from_v)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stack_of_the_report_has_the_thickness_of_its_beam() {
        let stack = Stack::paper().unwrap();
        assert!((stack.thickness_m() - 190e-6).abs() < 1e-12);
        assert!((stack.heights_m()[5] - 167.5e-6).abs() < 1e-12);
    }

    #[test]
    fn the_active_layer_follows_the_printed_values() {
        for (volts, pascal) in [(0.0, 1e9), (400.0, 1.7e9), (550.0, 2.5e9), (700.0, 3.3e9), (850.0, 4.1e9)] {
            assert!((active_modulus_pa(volts).unwrap() - pascal).abs() < 1.0, "{volts}");
        }
    }

    #[test]
    fn an_invalid_stack_is_rejected_with_layer_and_field() {
        let kinds = kinds("k", TABLE2).unwrap();
        let with = |change: fn(&mut Vec<Kind>)| {
            let mut changed = kinds.clone();
            change(&mut changed);
            Stack::in_order(&changed, ORDER).unwrap_err().to_string()
        };
        let thin = Stack::paper().unwrap().layers()[0].clone();
        for (found, expected) in [
            (with(|k| k[0].thickness_um = 0.0), "layer 2 (aluminium): thickness_m = 0 is not allowed"),
            (with(|k| k[2].width_mm = -1.0), "layer 1 (PET): width_m = -0.001 is not allowed"),
            (with(|k| k[3].youngs_modulus_gpa = f64::NAN), "layer 3 (PVdF): youngs_modulus_pa = NaN"),
            (with(|k| k[3].length_mm = 90.0), "layer 3 (PVdF): length_m = 0.09 is not allowed"),
            (with(|k| k.truncate(3)), "--stack: `PVdF` is not among the layers"),
            (Stack::in_order(&kinds, "PET,PVdF,PET").unwrap_err().to_string(), "--stack: 0 layer(s) of aluminium"),
            (Stack::new(Vec::new()).unwrap_err().to_string(), "the stack has no layers"),
            (Stack::new(vec![thin; 21]).unwrap_err().to_string(), "the stack has 21 layers; expected at most 20"),
        ] {
            assert!(found.starts_with(expected), "{found}");
        }
        for (table, expected) in [
            ("material\nPET\n".to_owned(), "k, line 1: no column `youngs_modulus_gpa`"),
            (TABLE2.replace(",20,1", ",20,-1"), "k, line 4, column count: `-1` is not a whole number"),
            (TABLE2.replace("PVdF,0.4", "PVdF,soft"), "k, line 6, column youngs_modulus_gpa: `soft`"),
            (TABLE2.lines().take(2).collect::<Vec<_>>().join("\n"), "k: 0 rows of data"),
        ] {
            let error = super::kinds("k", &table).unwrap_err();
            assert!(
                error.is::<simulation::bad_input::BadInput>() && error.to_string().starts_with(expected),
                "{error}"
            );
        }
    }
}
