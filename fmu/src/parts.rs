//! The parts of `modelDescription.xml`, for both versions.

use std::collections::BTreeMap;
use std::fmt::Write;

use simulation::control_loop::CONTROLLERS;

use crate::variable::{Form, Role, Variable};
use crate::version::Version;

/// Name of the enumeration of the controllers.
const CONTROLLER: &str = "Controller";

/// The definitions of all units of measurement that a variable has.
pub(crate) fn units(variables: &[Variable]) -> String {
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
pub(crate) fn types(variables: &[Variable], version: Version) -> String {
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

/// The variables with types, units, ranges and start values.
pub(crate) fn listed(variables: &[Variable], version: Version) -> String {
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
pub(crate) fn structure(variables: &[Variable], version: Version) -> String {
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
pub(crate) fn escaped(text: &str) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_a_plant_file_do_not_end_an_attribute() {
        assert_eq!(escaped("a\"<&>\n\u{b5}"), "a&quot;&lt;&amp;&gt; \u{b5}");
    }
}
