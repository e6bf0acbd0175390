//! Units in which a user reads times, voltages and readings. Inside the libraries a time is in s and a voltage in V; a reading
//! keeps its own unit, which is only a name.

use serde::{Deserialize, Serialize};

use crate::bad_input::{BadInput, excerpt, one_line};

/// A unit of time or voltage: its name, and its size in s or V.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Name, e.g. `ms`.
    pub name: String,
    /// Size in the SI unit, e.g. 1e-3 for `ms`; positive.
    pub si: f64,
}

/// Units of the three quantities of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Units {
    /// Unit of times.
    pub time: Unit,
    /// Unit of the commanded voltage.
    pub voltage: Unit,
    /// Name of the reading's unit; `V` for stiffness as the equivalent static voltage.
    pub reading: String,
}

impl Default for Units {
    /// Seconds, volts, and stiffness as the equivalent static voltage in V.
    fn default() -> Self {
        Self { time: Unit::of("s", 1.0), voltage: Unit::of("V", 1.0), reading: "V".into() }
    }
}

/// Sizes of the units of time in s, their names and other spellings.
const TIMES: &[(f64, &str, &[&str])] = &[
    (1.0, "s", &["sec", "second", "seconds"]),
    (1e-9, "ns", &[]),
    (1e-6, "us", &["\u{b5}s", "\u{3bc}s", "usec"]),
    (1e-3, "ms", &["msec"]),
    (60.0, "min", &["minute", "minutes"]),
    (3600.0, "h", &["hr", "hour", "hours"]),
    (86400.0, "d", &["day", "days"]),
];

/// Decimal prefixes of the volt, their sizes and other spellings.
const PREFIXES: &[(f64, &str, &[&str])] = &[
    (1.0, "", &[]),
    (1e-9, "n", &[]),
    (1e-6, "u", &["\u{b5}", "\u{3bc}"]),
    (1e-3, "m", &[]),
    (1e3, "k", &["K"]),
    (1e6, "M", &[]),
];

/// Units of readings that a column's name may end in.
const READINGS: &[&str] = &[
    "nm", "um", "\u{b5}m", "\u{3bc}m", "mm", "cm", "m", "uN", "mN", "N", "kN", "N/m", "kN/m", "mN/m", "N/mm", "uN/m",
    "N m/rad", "Nm/rad", "Nm", "N m", "Pa", "kPa", "MPa", "GPa", "bar", "mbar", "degC", "\u{b0}C", "degF", "\u{b0}F",
    "K", "deg", "\u{b0}", "rad", "mrad", "%", "percent", "counts", "codes", "lsb", "uA", "mA", "A", "W", "Hz", "rpm",
    "g", "kg",
];

/// Further units above or below the line of a quotient.
const PARTS: &[&str] =
    &["ft", "m2", "cm2", "mm2", "s2", "m3", "cm3", "mm3", "ft3", "l", "L", "ml", "mL", "gal", "mol", "J", "kJ", "rev"];

/// The name of a unit of voltage, as [`Unit::of_voltage`] knows it, in its usual spelling; `None` for any other unit.
pub(crate) fn usual_volts(name: &str) -> Option<String> {
    let prefix = name.strip_suffix(['V', 'v'])?;
    let known = PREFIXES.iter().find(|(_, usual, others)| *usual == prefix || others.contains(&prefix));
    known.map(|(_, usual, _)| format!("{usual}V"))
}

/// True for a usual unit of readings other than volts.
pub(crate) fn usual_reading(name: &str) -> bool {
    READINGS.contains(&name)
}

/// True for the name of a usual unit of time, voltage or readings.
pub fn is_usual(name: &str) -> bool {
    Unit::of_time(name).is_ok() || usual_volts(name).is_some() || usual_reading(name)
}

/// The name of a unit above or below the line of a quotient; `None` for a word that is none.
pub(crate) fn part_of_quotient(unit: &str) -> Option<String> {
    usual(unit).or_else(|| PARTS.contains(&unit).then(|| unit.to_owned()))
}

/// The name of a usual unit of time, voltage or reading; `None` for a word that is none.
pub(crate) fn usual(unit: &str) -> Option<String> {
    // A header in capitals: `TIME_MS`. A single capital is another unit.
    let lower = if unit.len() > 1 { unit.to_lowercase() } else { unit.to_owned() };
    let time = Unit::of_time(unit).or_else(|_| Unit::of_time(&lower)).ok().map(|unit| unit.name);
    time.or_else(|| usual_volts(unit)).or_else(|| usual_reading(unit).then(|| unit.to_owned()))
}

/// The name of the unit of a quotient: `mm/V`, `percent/(ft3/min)`.
pub fn quotient(above: &str, below: &str) -> String {
    if below.contains(['/', ' ']) { format!("{above}/({below})") } else { format!("{above}/{below}") }
}

/// True for a cell that holds a unit and nothing else: a usual one, or any in brackets.
pub(crate) fn is_unit(cell: &str) -> bool {
    let is_in = |open, close| cell.len() > 2 && cell.starts_with(open) && cell.ends_with(close);
    is_usual(cell) || is_in('[', ']') || is_in('(', ')')
}

/// True for letters that number the channels of an instrument: `A`, `B` and so on in their order, cells without content left out. A
/// single `A` is an ampere.
pub(crate) fn are_labels<'t>(cells: impl Iterator<Item = &'t str>) -> bool {
    let mut letters = 'A'..='Z';
    let are_in_order =
        cells.filter(|cell| !cell.is_empty()).all(|cell| letters.next().is_some_and(|it| cell.chars().eq([it])));
    are_in_order && letters.start() > &'B'
}

impl Unit {
    fn of(name: &str, si: f64) -> Self {
        Self { name: name.into(), si }
    }

    /// Returns the unit of time with a name.
    ///
    /// # Errors
    /// [`BadInput`] with the names that are known.
    pub fn of_time(name: &str) -> Result<Self, BadInput> {
        let known = TIMES.iter().find(|(_, usual, others)| *usual == name || others.contains(&name));
        let known = known.map(|&(si, usual, _)| Self::of(usual, si));
        known.ok_or_else(|| {
            let name = one_line(&excerpt(name));
            BadInput(format!("`{name}` is not a unit of time; expected ns, us, ms, s, min, h or d"))
        })
    }

    /// Returns the unit of voltage with a name. A command in any other unit (a heater's percent, an ampere, a code) is
    /// accepted as it is: its unit takes the place of the volt.
    pub fn of_voltage(name: &str) -> Self {
        let name = usual_volts(name).unwrap_or_else(|| name.to_owned());
        let known = PREFIXES.iter().find(|(_, prefix, _)| name.strip_suffix('V') == Some(prefix));
        Self::of(&name, known.map_or(1.0, |&(si, ..)| si))
    }

    /// True for a unit of voltage; false for any other unit of a command.
    pub fn is_voltage(&self) -> bool {
        usual_volts(&self.name).is_some()
    }
}

/// The names of [`Units`] as the table `[units]` of a plant file; an absent name is that of the default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitNames {
    /// Name of the unit of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Name of the unit of the commanded voltage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voltage: Option<String>,
    /// Name of the unit of the reading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reading: Option<String>,
}

impl UnitNames {
    /// Returns the units with these names.
    ///
    /// # Errors
    /// [`BadInput`] for an unknown unit of time.
    pub fn units(&self) -> Result<Units, BadInput> {
        let default = Units::default();
        Ok(Units {
            time: self.time.as_deref().map_or(Ok(default.time), Unit::of_time)?,
            voltage: self.voltage.as_deref().map_or(default.voltage, Unit::of_voltage),
            reading: self.reading.clone().unwrap_or(default.reading),
        })
    }

    /// Name of the command's unit if it is no voltage.
    pub fn other_command(&self) -> Option<&str> {
        self.voltage.as_deref().filter(|name| usual_volts(name).is_none())
    }
}

impl From<&Units> for UnitNames {
    fn from(units: &Units) -> Self {
        let [time, voltage] = [&units.time, &units.voltage].map(|unit| Some(unit.name.clone()));
        Self { time, voltage, reading: Some(units.reading.clone()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_give_sizes_and_read_back() {
        let names = UnitNames { time: Some("ms".into()), voltage: Some("kV".into()), reading: Some("mm".into()) };
        let units = names.units().unwrap();
        assert_eq!((units.time.si, units.voltage.si, &*units.reading), (1e-3, 1e3, "mm"));
        assert_eq!(UnitNames::from(&units), names);
        assert_eq!(UnitNames::default().units().unwrap(), Units::default());
        assert_eq!(Unit::of_voltage("%").si, 1.0);
        assert_eq!(["kV", "V", "A"].map(|name| Unit::of_voltage(name).is_voltage()), [true, true, false]);
        assert_eq!(names.other_command(), None);
        assert_eq!([quotient("mm", "V"), quotient("N/m", "ft3/min")], ["mm/V", "N/m/(ft3/min)"]);
        let heater = UnitNames { voltage: Some("%".into()), ..names };
        assert_eq!(heater.other_command(), Some("%"));
        assert!(Unit::of_time("parsec").unwrap_err().to_string().contains("expected ns, us, ms, s, min, h or d"));
    }
}
