//! `modelDescription.xml` of a unit, for FMI 2.0 and 3.0.
//!
//! It contains no date: the same plant file and options give the same bytes. The token that identifies a unit (`guid`,
//! `instantiationToken`) is a digest of its description, so that the library can tell whether it is the one that the description
//! was written for.

use crate::parts::{escaped, listed, structure, types, units};
use crate::status::{ERRORS, WARNINGS};
use crate::unit::{Kind, Unit};
use crate::variables::variables;
use crate::version::Version;

/// End of the experiment that an importer proposes, in s.
const STOP_S: f64 = 10.0;

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
            format!(
                "  <LogCategories>\n    <Category name=\"{WARNINGS}\"/>\n    <Category name=\"{ERRORS}\"/>\n  </LogCategories>\n"
            ),
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

/// FNV-1a with 128 bits.
fn fnv_1a(bytes: &[u8]) -> u128 {
    bytes.iter().fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |digest, &byte| {
        (digest ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::{ERROR, WARNING, category};
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

    #[test]
    fn every_category_of_a_message_is_described() {
        let plant = plant_file::load("paper").expect("the report's spring");
        let unit = Unit { kind: Kind::Both, plant, options: Options::PAPER };
        for (version, status) in Version::ALL.into_iter().flat_map(|version| [(version, WARNING), (version, ERROR)]) {
            let expected = format!("<Category name=\"{}\"/>", category(status));
            assert!(unit.description(version).contains(&expected), "{expected}");
        }
    }

    /// Test vectors published by the authors of FNV.
    #[test]
    fn the_digest_is_fnv_1a_with_128_bits() {
        assert_eq!(fnv_1a(b""), 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        assert_eq!(fnv_1a(b"a"), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }
}
