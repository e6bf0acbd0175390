//! Names of columns: the columns that a user asks for, and usual names with units in them.

use anyhow::Result;

use super::{APPLIED, ESTIMATE, MEASURED};
use crate::bad_input;
use crate::bad_input::{BadInput, excerpt};
use crate::csv_table::{Table, plain};
use crate::units::{Unit, part_of_quotient, usual, usual_volts};

/// The columns of a record as a user names them, `NAME` or `NAME:UNIT`; those without a name are recognised.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ColumnNames {
    /// Column of the time.
    pub time: Option<String>,
    /// Column of the commanded voltage.
    pub voltage: Option<String>,
    /// Column of the reading.
    pub reading: Option<String>,
    /// Column of a reading that is the stiffness as the equivalent static voltage, in V; takes the place of `reading`.
    pub stiffness: Option<String>,
}

/// A column of a table and its unit, as far as known from its name or an option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) index: usize,
    pub(super) unit: Option<String>,
    /// True if the unit is that of an option: no other one is then used.
    pub(super) is_asked: bool,
}

/// The columns of a record.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) time: Column,
    pub(super) voltage: Column,
    pub(super) reading: Column,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Time,
    Voltage,
    Reading,
}

impl Role {
    const ALL: [Self; 3] = [Self::Time, Self::Voltage, Self::Reading];

    fn option(self) -> &'static str {
        ["--time", "--voltage", "--reading"][self as usize]
    }

    /// Names of the column in a record of this program, the first of which is written.
    fn contract(self) -> &'static [&'static str] {
        [&["time_s"][..], &["voltage_v", APPLIED], &[MEASURED]][self as usize]
    }

    /// Names of the column without its unit, as other programs write them.
    fn usual(self) -> &'static [&'static str] {
        const VOLTAGES: &[&str] =
            &["u", "v", "voltage", "command", "input", "drive", "v_in", "vin", "applied", "command_voltage"];
        [&["time", "t", "timestamp", "datetime", "elapsed"][..], VOLTAGES, &[MEASURED]][self as usize]
    }

    /// True if a column with a unit, or without one, can be this quantity: a command may have any unit but one of time.
    fn fits(self, unit: Option<&str>) -> bool {
        unit.is_none_or(|unit| (Unit::of_time(unit).is_ok()) == (self == Self::Time))
    }

    /// True if a unit is one of this quantity.
    fn takes(self, unit: &str) -> bool {
        match self {
            Self::Time => Unit::of_time(unit).is_ok(),
            Self::Voltage => usual_volts(unit).is_some(),
            Self::Reading => Unit::of_time(unit).is_err(),
        }
    }
}

impl ColumnNames {
    fn of(&self, role: Role) -> Option<&str> {
        [&self.time, &self.voltage, &self.reading][role as usize].as_deref()
    }

    /// The option that names the column of a quantity.
    fn option(&self, role: Role) -> &'static str {
        if role == Role::Reading && self.stiffness.is_some() { "--column" } else { role.option() }
    }

    /// Finds the columns in a table: those that are asked for, else those of this program's records, else those whose names
    /// and units leave no choice.
    ///
    /// # Errors
    /// [`BadInput`] that lists the columns and an option line that names them.
    pub(super) fn find(&self, table: &Table<'_>) -> Result<Columns> {
        let asked = |role: Role| match (role, &self.stiffness) {
            (Role::Reading, Some(name)) => Some((name.as_str(), Column::plain(table, name))),
            _ => self.of(role).map(|name| (name, Column::asked(table, name))),
        };
        let mut found = Role::ALL.map(|role| match asked(role) {
            Some((_, column)) => column,
            None => role.contract().iter().find_map(|name| Column::named(table, name)),
        });
        let is_asked = asked(Role::Reading).is_some();
        let has_estimates = |column: &Option<Column>| match column {
            Some(column) => {
                table.columns().eq(["time_s", "voltage_v", ESTIMATE]) && table.column(column.index) == ESTIMATE
            }
            None => !is_asked && table.columns().any(|name| name == ESTIMATE),
        };
        if has_estimates(&found[Role::Reading as usize]) {
            bad_input!(
                "{}: column `{ESTIMATE}` is the controller's own estimate, recorded without a sensor, and follows its model \
                 whatever the spring does; expected a column of readings",
                table.header_place()
            );
        }
        for role in Role::ALL {
            if found[role as usize].is_none() && asked(role).is_none() {
                found[role as usize] = Self::guess(table, role, &found);
            }
        }
        let [Some(time), Some(voltage), Some(reading)] = found.clone() else {
            let missing = Role::ALL.into_iter().find(|role| found[*role as usize].is_none()).unwrap_or(Role::Reading);
            let name = asked(missing).map_or(missing.contract()[0], |(name, _)| name);
            return Err(self.lacks(table, name, &found).into());
        };
        let reading_option = self.option(Role::Reading);
        for (taken, quantity, column, option) in [
            (&time, "time", &voltage, "--voltage"),
            (&time, "time", &reading, reading_option),
            (&voltage, "voltage", &reading, reading_option),
        ] {
            if taken.index == column.index {
                return Err(table.is_taken(taken.index, quantity, option).into());
            }
        }
        Ok(Columns { time, voltage, reading })
    }

    /// The only column that can have the role: by its name, or by its unit.
    fn guess(table: &Table<'_>, role: Role, found: &[Option<Column>; 3]) -> Option<Column> {
        let free = || {
            let is_free = |index: usize| found.iter().flatten().all(|column| column.index != index);
            table.columns().enumerate().filter(move |(index, _)| is_free(*index))
        };
        let has_unit = |unit: &Option<String>| unit.as_deref().is_some_and(|unit| role.takes(unit));
        let by_name = free().filter(|(_, name)| {
            let (base, unit) = split_unit(name);
            // A capital T is a temperature as often as a time.
            base != "T" && role.usual().contains(&plain(base).as_str()) && (unit.is_none() || has_unit(&unit))
        });
        let by_unit = free().filter(|(_, name)| has_unit(&split_unit(name).1));
        let only = |columns: Vec<usize>| (columns.len() == 1).then(|| columns[0]);
        let by_name: Vec<usize> = by_name.map(|(index, _)| index).collect();
        let index = if by_name.is_empty() { only(by_unit.map(|(index, _)| index).collect()) } else { only(by_name) };
        index.map(|index| Column::at(table, index))
    }

    /// The error for a missing column `name`: the columns that there are, and options that name them.
    fn lacks(&self, table: &Table<'_>, name: &str, found: &[Option<Column>; 3]) -> BadInput {
        const MOST_COLUMNS: usize = 12;
        let taken = |index: usize| found.iter().flatten().any(|column| column.index == index);
        let spec = |index: usize, role: Role| {
            let name = table.column(index);
            let unit = split_unit(name).1.filter(|unit| role.takes(unit)).map(|unit| format!(":{unit}"));
            let spec = excerpt(name).replace(['\n', '\r'], " ") + &unit.unwrap_or_default();
            if spec.contains(|letter: char| !(letter.is_alphanumeric() || "_-:%./".contains(letter))) {
                format!("'{spec}'")
            } else {
                spec
            }
        };
        let mut free: Vec<usize> = (0..table.columns().count())
            .filter(|index| !taken(*index) && !table.has_comments(*index))
            .take(MOST_COLUMNS)
            .collect();
        let has_columns = !free.is_empty();
        let missing = [Role::Voltage, Role::Reading].iter().filter(|role| found[**role as usize].is_none()).count();
        let options = Role::ALL.map(|role| {
            let choice = match &found[role as usize] {
                Some(column) => self.of(role).map_or_else(|| spec(column.index, role), str::to_owned),
                None => {
                    let fits = |index: &usize| role.fits(split_unit(table.column(*index)).1.as_deref());
                    let fitting: Vec<usize> = free.iter().copied().filter(fits).collect();
                    // Where too few columns fit, the unit of one may have been mistaken.
                    let are_enough = fitting.len() >= if role == Role::Time { 1 } else { missing };
                    let candidates = if are_enough { fitting } else { free.clone() };
                    if let [only] = candidates[..] {
                        free.retain(|index| *index != only);
                    }
                    match candidates.iter().map(|index| spec(*index, role)).collect::<Vec<_>>().as_slice() {
                        [] => "NAME:UNIT".to_owned(),
                        [only] => only.clone(),
                        several => format!("one of {}", several.join(", ")),
                    }
                }
            };
            format!("{} {choice}", self.option(role))
        });
        let names = Role::ALL.map(|role| match (role, &self.stiffness) {
            (Role::Reading, Some(name)) => name,
            _ => self.of(role).unwrap_or(role.contract()[0]),
        });
        let names = names.join(", ");
        table.lacks(name, &if has_columns { format!("{names}, or {}", options.join(" ")) } else { names })
    }
}

impl Column {
    fn at(table: &Table<'_>, index: usize) -> Self {
        Self { index, unit: split_unit(table.column(index)).1, is_asked: false }
    }

    fn named(table: &Table<'_>, name: &str) -> Option<Self> {
        table.find(name).map(|index| Self::at(table, index))
    }

    /// A column without unit.
    fn plain(table: &Table<'_>, name: &str) -> Option<Self> {
        table.find(name).map(|index| Self { index, unit: None, is_asked: false })
    }

    /// The column `NAME` or `NAME:UNIT`; a column's own name may contain a colon, and a unit that is left out.
    fn asked(table: &Table<'_>, asked: &str) -> Option<Self> {
        let with_unit = || {
            let (name, unit) = asked.rsplit_once(':')?;
            let unit = Some(unit.trim().to_owned()).filter(|unit| !unit.is_empty());
            let column = Self::named(table, name).or_else(|| Self::without_unit(table, name))?;
            Some(Self { is_asked: unit.is_some(), unit, ..column })
        };
        Self::named(table, asked).or_else(with_unit).or_else(|| Self::without_unit(table, asked))
    }

    /// The only column whose name without its unit is `name`.
    fn without_unit(table: &Table<'_>, name: &str) -> Option<Self> {
        let mut columns = (0..table.columns().count()).map(|index| Self::at(table, index));
        let is_named = |column: &Self| plain(split_unit(table.column(column.index)).0) == plain(name);
        let found = columns.by_ref().find(is_named)?;
        (!columns.any(|column| is_named(&column))).then_some(found)
    }
}

/// Splits a column's name into its base and its unit: `x [mm]`, `x (mm)`, `x / mm`, `x_mm`, `x mm`. In brackets any unit is
/// one, elsewhere a usual one only, and behind a blank or `_` none that is as often a label: `Channel A`.
fn split_unit(name: &str) -> (&str, Option<String>) {
    let name = name.trim().trim_matches(['"', '\'', '\u{feff}']).trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((base, unit)) = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open))
            && !unit.trim().is_empty()
            && !base.trim().is_empty()
        {
            let base = base.trim_end_matches([' ', '_']);
            if is_clock_form(unit.trim()) {
                return (base, None);
            }
            return (base, Some(usual(unit.trim()).unwrap_or(unit.trim().to_owned())));
        }
    }
    if let Some(split) = split_quotient(name) {
        return split;
    }
    for (mark, at) in [('_', name.find('_')), ('_', name.rfind('_')), ('/', name.find('/')), (' ', name.rfind(' '))] {
        let Some(at) = at.filter(|at| *at > 0) else { continue };
        let unit = name[at + 1..].trim();
        let is_label = match mark {
            '_' => unit == "A",
            ' ' => unit.len() == 1 && !["s", "h", "d", "V", "v"].contains(&unit),
            _ => false,
        };
        if let Some(unit) = usual(unit).filter(|_| !is_label) {
            return (name[..at].trim_end(), Some(unit));
        }
    }
    (name, None)
}

/// True for the form of a time stamp, such as `hh:mm:ss.s`, which is no unit.
fn is_clock_form(text: &str) -> bool {
    text.contains(':') && text.chars().all(|letter| "HMShms:.,f0".contains(letter))
}

/// Splits a name that ends in a quotient of units, `v_m_per_s`, `flow l per min`, `omega_rad/s`, whose last word alone is not its
/// unit. Without a unit where the beginning of the quotient is not known; `None` for any other name.
fn split_quotient(name: &str) -> Option<(&str, Option<String>)> {
    let lower = name.to_ascii_lowercase();
    let per = lower.rfind("_per_").or_else(|| lower.rfind(" per "));
    let (above, below) = match per {
        Some(at) => (&name[..at], &name[at + "_per_".len()..]),
        // `x/mm` is the quotient of a quantity and its unit.
        None => name.rsplit_once('/').filter(|(_, below)| Unit::of_time(below).is_ok())?,
    };
    let (base, unit) = above.rsplit_once(['_', ' ']).unwrap_or(("", above));
    if below.contains(['_', ' ', '/']) || (per.is_none() && unit == "A") {
        return None;
    }
    let has_base = !base.is_empty() && !base.to_ascii_lowercase().ends_with("per");
    match part_of_quotient(unit).zip(part_of_quotient(below)) {
        Some((unit, below)) if has_base => Some((base.trim_end(), Some(format!("{unit}/{below}")))),
        None if per.is_none() => None,
        _ => Some((name, None)),
    }
}

/// Returns the name of a column that says its unit: the name itself where it does, or where the unit is the one that is taken
/// without a word, else `NAME [UNIT]`.
pub fn with_unit(name: &str, unit: &str) -> String {
    let own = split_unit(name).1;
    let unit = unit.trim();
    let is_said = own.is_some() && own == Some(usual(unit).unwrap_or_else(|| unit.to_owned()));
    let is_default = [MEASURED, ESTIMATE].contains(&name) && usual_volts(unit).as_deref() == Some("V");
    if unit.is_empty() || is_said || is_default { name.to_owned() } else { format!("{name} [{unit}]") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(header: &str, names: &ColumnNames) -> Result<[(usize, Option<String>); 3], String> {
        let columns = names.find(&Table::new("r", header).unwrap()).map_err(|error| error.to_string())?;
        Ok([columns.time, columns.voltage, columns.reading].map(|column| (column.index, column.unit)))
    }

    #[test]
    fn units_are_split_from_names() {
        for (name, base, unit) in [
            ("t_ms", "t", Some("ms")),
            ("time [ms]", "time", Some("ms")),
            ("Time(s)", "Time", Some("s")),
            ("T1 (degC)", "T1", Some("degC")),
            ("x / mm", "x", Some("mm")),
            ("k_N/m", "k", Some("N/m")),
            ("u kV", "u", Some("kV")),
            ("voltage_v", "voltage", Some("V")),
            ("U [kv]", "U", Some("kV")),
            ("t [\u{b5}s]", "t", Some("us")),
            ("flow [furlong/h]", "flow", Some("furlong/h")),
            ("dac_code", "dac_code", None),
            ("Channel A", "Channel A", None),
            ("phase_A", "phase_A", None),
            ("node K", "node K", None),
            ("I / A", "I", Some("A")),
            ("F_N", "F", Some("N")),
            ("Time s", "Time", Some("s")),
            ("Q1", "Q1", None),
            ("[mm]", "[mm]", None),
            ("gas_ft3_per_min", "gas", Some("ft3/min")),
            ("v_m_per_s", "v", Some("m/s")),
            ("feed_mm_per_s", "feed", Some("mm/s")),
            ("OMEGA_rad_PER_SEC", "OMEGA", Some("rad/s")),
            ("p_bar_per_s", "p", Some("bar/s")),
            ("gain_um_per_V", "gain", Some("um/V")),
            ("Flow l per min", "Flow", Some("l/min")),
            ("omega_rad/s", "omega", Some("rad/s")),
            ("Flow l/min", "Flow", Some("l/min")),
            ("t_rel/s", "t_rel", Some("s")),
            ("phase_A/s", "phase_A", Some("s")),
            ("co2_percent", "co2", Some("percent")),
            ("force_per_area_Pa", "force_per_area", Some("Pa")),
            // The beginning of the unit is not known.
            ("flow_rate_per_min", "flow_rate_per_min", None),
            ("x_m_per_s_per_min", "x_m_per_s_per_min", None),
            ("clicks_per_s", "clicks_per_s", None),
            ("m_per_s", "m_per_s", None),
            ("mm/s", "mm/s", None),
            ("Time (mm:ss.s)", "Time", None),
            ("t [HH:MM:SS]", "t", None),
        ] {
            assert_eq!(split_unit(name), (base, unit.map(str::to_owned)), "{name}");
        }
    }

    #[test]
    fn a_unit_is_added_to_a_name_that_does_not_say_it() {
        for (name, unit, said) in [
            ("time_s", "s", "time_s"),
            ("t_ms", "msec", "t_ms"),
            ("t_ms", "s", "t_ms [s]"),
            ("x", "mm", "x [mm]"),
            ("U", "kv", "U [kv]"),
            ("stiffness", "V", "stiffness"),
            ("stiffness", "N/m", "stiffness [N/m]"),
            ("gauge", "", "gauge"),
        ] {
            assert_eq!(with_unit(name, unit), said);
        }
    }

    #[test]
    fn usual_names_are_recognised_where_they_leave_no_choice() {
        let none = ColumnNames::default();
        let units = |time: &str, voltage: &str, reading: &str| {
            [(0, time), (1, voltage), (2, reading)].map(|(index, unit)| (index, Some(unit.to_owned())))
        };
        assert_eq!(found("t_ms,u_kV,x_mm\n", &none), Ok(units("ms", "kV", "mm")));
        assert_eq!(found("time [h],pump_v,T1 (degC)\n", &none), Ok(units("h", "V", "degC")));
        assert_eq!(found(" TIME_MS ,Voltage_V,Stiffness [N/m]\n", &none), Ok(units("ms", "V", "N/m")));
        assert_eq!(found("Time,U,F_N,note\n", &none), Ok([(0, None), (1, None), (2, Some("N".into()))]));
        // The only unit of time, in any language.
        assert_eq!(found("Zeit [ms],Spannung [kV],Weg [mm]\n", &none), Ok(units("ms", "kV", "mm")));
        let error = found("t_ms,u_kV,x_mm,force_N\n", &none).unwrap_err();
        assert_eq!(
            error,
            "r, line 1: no column `stiffness`; expected a header with time_s, voltage_v, stiffness, or --time t_ms:ms \
             --voltage u_kV:kV --reading one of x_mm:mm, force_N:N, found `t_ms,u_kV,x_mm,force_N`"
        );
        for (header, expected) in [
            ("Time,Q1,T1\n", "--time Time --voltage one of Q1, T1 --reading one of Q1, T1"),
            ("time_s,pump_v,level_v\n", "--time time_s:s --voltage one of pump_v:V, level_v:V"),
            ("T,U,x_mm\n", "--time T --voltage U --reading x_mm:mm"),
            (
                "start [h],end [h],u_V,x_mm\n",
                "--time one of 'start [h]:h', 'end [h]:h' --voltage u_V:V --reading x_mm:mm",
            ),
            (
                "T,drive [%],x_mm,F_N\n",
                "--time T --voltage one of 'drive [%]', x_mm, F_N --reading one of 'drive [%]:%', x",
            ),
            ("t_us,i_A,omega_rad/s\n", "--time t_us:us --voltage i_A --reading omega_rad/s:rad/s, found"),
            (
                "time_s,gas_ft3_per_min,co2_percent\n",
                "--voltage one of gas_ft3_per_min, co2_percent --reading one of gas_ft3_per_min:ft3/min, co2_percent:percent",
            ),
            // A column is proposed for one quantity, and one with another's unit where no others are left.
            ("time_s,x\n", "--time time_s:s --voltage x --reading NAME:UNIT, found"),
            ("time_s,x,y_min\n", "--time time_s:s --voltage one of x, y_min --reading one of x, y_min, found"),
            ("time_s,u_V,y_min\n", "--time time_s:s --voltage u_V:V --reading y_min, found"),
            ("time_s,voltage_v,strain\n", "no column `stiffness`"),
            (
                "time_s,voltage_v,estimate\n",
                "r, line 1: column `estimate` is the controller's own estimate, recorded without a sensor, and follows its model \
                 whatever the spring does; expected a column of readings",
            ),
            ("time_s,volts,stiffness\n", "no column `voltage_v`"),
        ] {
            let error = found(header, &none).unwrap_err();
            assert!(error.contains(expected), "{header}: {error}");
        }
        let estimate = ColumnNames { reading: Some("estimate".into()), ..ColumnNames::default() };
        assert!(found("time_s,voltage_v,estimate\n", &estimate).unwrap_err().contains("the controller's own estimate"));
        assert!(found("time_s,voltage_v,estimate,remark\n", &estimate).is_ok(), "not a recording of this program");
        assert!(found("time_s,voltage_v,stiffness,estimate\n", &none).is_ok());
    }

    #[test]
    fn asked_columns_win_over_recognised_ones() {
        let asked = ColumnNames {
            time: Some("T Ms:ms".into()),
            reading: Some("force_N".into()),
            voltage: Some("a:b".into()),
            ..ColumnNames::default()
        };
        let expected = [(2, Some("ms".to_owned())), (1, None), (3, Some("N".to_owned()))];
        assert_eq!(found("x_mm,a:b,\"t ms\",force_N,time_s\n", &asked), Ok(expected));
        let error = found("time_s,voltage_v,x_mm\n", &ColumnNames { reading: Some("y:mm".into()), ..asked.clone() });
        assert!(error.unwrap_err().contains("no column `T Ms:ms`"));
        let names = |reading: &str| ColumnNames { reading: Some(reading.into()), ..ColumnNames::default() };
        let without_unit = [(0, Some("s".to_owned())), (1, Some("V".to_owned())), (2, Some("mm".to_owned()))];
        assert_eq!(found("time_s,voltage_v,x [mm]\n", &names("X")), Ok(without_unit.clone()));
        assert_eq!(found("time_s,voltage_v,x [m]\n", &names("x:mm")), Ok(without_unit));
        assert!(found("time_s,voltage_v,x [mm],x_N\n", &names("x")).unwrap_err().contains("no column `x`"));
    }

    #[test]
    fn a_column_is_one_quantity() {
        let names = |time: &str, voltage: &str, reading: &str, stiffness: &str| {
            let [time, voltage, reading, stiffness] =
                [time, voltage, reading, stiffness].map(|name| (!name.is_empty()).then(|| name.to_owned()));
            ColumnNames { time, voltage, reading, stiffness }
        };
        for (names, expected) in [
            (names("a", "a", "", ""), "r, line 1: column `a` is the time; expected another one for --voltage"),
            (names("a", "", "a:mm", ""), "r, line 1: column `a` is the time; expected another one for --reading"),
            (names("a", "", "", "a"), "r, line 1: column `a` is the time; expected another one for --column"),
            (names("a", "b", "b", ""), "r, line 1: column `b` is the voltage; expected another one for --reading"),
            (names("a", "b:%", "B:mm", ""), "r, line 1: column `b` is the voltage; expected another one for --reading"),
            (names("a", "u_V", "", "u_V"), "r, line 1: column `u_V` is the voltage; expected another one for --column"),
        ] {
            assert_eq!(found("a,b,u_V,stiffness\n", &names).unwrap_err(), expected);
        }
    }
}
