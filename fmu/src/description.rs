//! `modelDescription.xml` of a unit, for FMI 2.0 and 3.0.
//!
//! It contains no date: the same plant file and options give the same bytes. The token that identifies a unit (`guid`,
//! `instantiationToken`) is a digest of its description, so that the library can tell whether it is the one that the description
//! was written for.

use std::collections::BTreeMap;
use std::fmt::Write;

use simulation::control_loop::CONTROLLERS;

use crate::unit::{Kind, Unit};
use crate::variable::{Form, Role, Variable};
use crate::variables::variables;

/// End of the experiment that an importer proposes, in s.
const STOP_S: f64 = 10.0;
/// Name of the enumeration of the controllers.
const CONTROLLER: &str = "Controller";
/// Category of the messages about errors, which both standards name so.
pub(crate) const ERRORS: &str = "logStatusError";

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Version {
    /// Both versions.
    pub const ALL: [Self; 2] = [Self::Two, Self::Three];

    /// Number on the command line and in the names of files.
    pub const fn number(self) -> u32 {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

impl Kind {
    /// Name of the unit's library in the archive, without its ending.
    pub const fn identifier(self) -> &'static str {
        match self {
            Self::Spring => "vsj_spring",
            Self::Controller => "vsj_controller",
            Self::Both => "vsj_both",
        }
    }

    const fn description(self) -> &'static str {
        match self {
            Self::Spring => "Variable-stiffness spring, as the fixed-point model of its controller",
            Self::Controller => "Controller of a variable-stiffness spring, bit for bit that of the microcontroller",
            Self::Both => "Variable-stiffness spring and its controller, bit for bit that of the microcontroller",
        }
    }
}

impl Unit {
    /// The token that an importer passes to the library.
    pub fn token(&self, version: Version) -> String {
        let digest = fnv_1a(self.text(version, "").as_bytes());
        let hex = format!("{digest:032x}");
        format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
    }

    /// Text of `modelDescription.xml`.
    pub fn description(&self, version: Version) -> String {
        self.text(version, &self.token(version))
    }

    fn text(&self, version: Version, token: &str) -> String {
        let variables = variables(self);
        let name = self.kind.identifier();
        let left_out = self.plant.left_out();
        let mut description = self.kind.description().to_owned();
        if !left_out.is_empty() {
            description += &format!("; not simulated: {}", left_out.join(", "));
        }
        let tick = 1.0 / self.options.rate_hz;
        let (number, of_token, of_state, fixed, events) = match version {
            Version::Two => ("2.0", "guid", "canGetAndSetFMUstate", String::new(), " numberOfEventIndicators=\"0\""),
            Version::Three => {
                let fixed = format!(" fixedInternalStepSize=\"{tick}\"");
                ("3.0", "instantiationToken", "canGetAndSetFMUState", fixed, "")
            }
        };
        let parts = [
            units(&variables),
            types(&variables, version),
            format!("  <LogCategories>\n    <Category name=\"{ERRORS}\"/>\n  </LogCategories>\n"),
            format!("  <DefaultExperiment startTime=\"0\" stopTime=\"{STOP_S}\" stepSize=\"{tick}\"/>\n"),
            listed(&variables, version),
            structure(&variables, version),
        ];
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"{number}\" modelName=\"{name}\" \
             {of_token}=\"{token}\" description=\"{}\" generationTool=\"vsj {}\" \
             variableNamingConvention=\"structured\"{events}>\n  <CoSimulation modelIdentifier=\"{name}\" \
             canHandleVariableCommunicationStepSize=\"true\" {of_state}=\"true\"{fixed}/>\n{}</fmiModelDescription>\n",
            escaped(&description),
            env!("CARGO_PKG_VERSION"),
            parts.concat(),
        )
    }
}

/// The definitions of all units of measurement that a variable has.
fn units(variables: &[Variable]) -> String {
    let used: BTreeMap<&str, &str> =
        variables.iter().filter(|it| !it.unit.is_empty()).map(|it| (it.unit.as_str(), exponents(&it.unit))).collect();
    let mut text = String::from("  <UnitDefinitions>\n");
    for (name, exponents) in used {
        let name = escaped(name);
        let _ = match exponents {
            "" => writeln!(text, "    <Unit name=\"{name}\"/>"),
            base => writeln!(text, "    <Unit name=\"{name}\"><BaseUnit {base}/></Unit>"),
        };
    }
    text + "  </UnitDefinitions>\n"
}

/// Exponents of the base units of the SI; empty for the unit of a plant file's readings, of which only the name is known.
fn exponents(unit: &str) -> &'static str {
    match unit {
        "s" => "s=\"1\"",
        "V" => "kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\"",
        "V/s" => "kg=\"1\" m=\"2\" s=\"-4\" A=\"-1\"",
        "Hz" | "1/s" => "s=\"-1\"",
        _ => "",
    }
}

/// The definition of the enumeration, if a variable has it.
fn types(variables: &[Variable], version: Version) -> String {
    if variables.iter().all(|it| it.form != Form::Controller) {
        return String::new();
    }
    let numbered = CONTROLLERS.iter().zip(1..);
    let items: String =
        numbered.map(|(name, value)| format!("      <Item name=\"{name}\" value=\"{value}\"/>\n")).collect();
    let definition = match version {
        Version::Two => {
            format!("    <SimpleType name=\"{CONTROLLER}\"><Enumeration>\n{items}    </Enumeration></SimpleType>\n")
        }
        Version::Three => format!("    <EnumerationType name=\"{CONTROLLER}\">\n{items}    </EnumerationType>\n"),
    };
    format!("  <TypeDefinitions>\n{definition}  </TypeDefinitions>\n")
}

fn listed(variables: &[Variable], version: Version) -> String {
    let mut text = String::from("  <ModelVariables>\n");
    for (reference, variable) in variables.iter().enumerate() {
        let (causality, variability, has_start) = match (variable.role, variable.form) {
            (Role::Time, _) => ("independent", "continuous", false),
            (Role::Setting(_) | Role::Model(_) | Role::Spring(_), _) => ("parameter", "fixed", true),
            (Role::Input, _) => ("input", "continuous", true),
            (Role::Output(_), Form::Real) => ("output", "continuous", false),
            (Role::Output(_), _) => ("output", "discrete", false),
        };
        let common = format!(
            "name=\"{}\" valueReference=\"{reference}\" description=\"{}\" causality=\"{causality}\" variability=\"{variability}\"",
            escaped(&variable.name),
            escaped(&variable.description)
        );
        let mut typed = String::new();
        if variable.form == Form::Controller {
            let _ = write!(typed, " declaredType=\"{CONTROLLER}\"");
        }
        if !variable.unit.is_empty() {
            let _ = write!(typed, " unit=\"{}\"", escaped(&variable.unit));
        }
        for (key, value) in
            [("min", variable.lowest), ("max", variable.highest), ("start", has_start.then_some(variable.start))]
        {
            if let Some(value) = value {
                let _ = write!(typed, " {key}=\"{value}\"");
            }
        }
        let element = match (variable.form, version) {
            (Form::Real, Version::Two) => "Real",
            (Form::Real, Version::Three) => "Float64",
            (Form::Integer, Version::Two) => "Integer",
            (Form::Integer, Version::Three) => "Int32",
            (Form::Controller, _) => "Enumeration",
        };
        let _ = match version {
            Version::Two => writeln!(text, "    <ScalarVariable {common}><{element}{typed}/></ScalarVariable>"),
            Version::Three => writeln!(text, "    <{element} {common}{typed}/>"),
        };
    }
    text + "  </ModelVariables>\n"
}

/// The outputs: none depends on an input without a step in between, and all are known after the initialization.
fn structure(variables: &[Variable], version: Version) -> String {
    let outputs =
        || variables.iter().enumerate().filter(|(_, it)| matches!(it.role, Role::Output(_))).map(|(index, _)| index);
    let list = |element: &str, of: fn(usize) -> String| -> String {
        outputs().map(|index| format!("    <{element} {} dependencies=\"\"/>\n", of(index))).collect()
    };
    match version {
        Version::Two => {
            let unknowns = list("Unknown", |index| format!("index=\"{}\"", index + 1));
            format!(
                "  <ModelStructure>\n    <Outputs>\n{unknowns}    </Outputs>\n    <InitialUnknowns>\n{unknowns}    \
                 </InitialUnknowns>\n  </ModelStructure>\n"
            )
        }
        Version::Three => {
            let reference = |index| format!("valueReference=\"{index}\"");
            let (known, initial) = (list("Output", reference), list("InitialUnknown", reference));
            format!("  <ModelStructure>\n{known}{initial}  </ModelStructure>\n")
        }
    }
}

/// Replaces what has a meaning in an attribute of XML.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            letter if letter.is_control() => escaped.push(' '),
            letter => escaped.push(letter),
        }
    }
    escaped
}

/// FNV-1a with 128 bits.
fn fnv_1a(bytes: &[u8]) -> u128 {
    bytes.iter().fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |digest, &byte| {
        (digest ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::control_loop::Options;
    use simulation::plant_file;

    #[test]
    fn the_token_follows_version_kind_settings_and_spring() {
        let paper = || plant_file::load("paper").expect("the report's spring");
        let unit = Unit { kind: Kind::Both, plant: paper(), options: Options::PAPER };
        let mut slower = paper();
        slower.relaxation.tau_s[0] = 5.6;
        let others = [
            Unit { kind: Kind::Spring, ..unit.clone() },
            Unit { options: Options { kp: 3.0, ..Options::PAPER }, ..unit.clone() },
            Unit { plant: slower, ..unit.clone() },
        ];
        let tokens = |unit: &Unit| Version::ALL.map(|version| unit.token(version));
        assert_eq!(tokens(&unit), tokens(&unit.clone()));
        let mut all: Vec<String> = others.iter().chain([&unit]).flat_map(tokens).collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 8);
        assert!(unit.description(Version::Three).contains(&unit.token(Version::Three)));
    }

    /// Test vectors published by the authors of FNV.
    #[test]
    fn the_digest_is_fnv_1a_with_128_bits() {
        assert_eq!(fnv_1a(b""), 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        assert_eq!(fnv_1a(b"a"), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }

    #[test]
    fn texts_of_a_plant_file_do_not_end_an_attribute() {
        assert_eq!(escaped("a\"<&>\n\u{b5}"), "a&quot;&lt;&amp;&gt; \u{b5}");
    }
}
